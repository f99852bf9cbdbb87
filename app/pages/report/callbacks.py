"""Callbacks of the panel *Report*: rewrite, stop, ask."""

from dash import Dash, Input, Output, State
from dash.exceptions import PreventUpdate

from app.kit.wiring import show_error
from app.report_desk import ReportDesk
from core.errors import MirrorTwinError


def register(app: Dash, desk: ReportDesk) -> None:
    """Attach the callbacks of the panel; the jobs they begin reach pages by `ReportDesk.watch`."""

    @app.callback(
        Input("report-write", "n_clicks"),
        State("report-writer", "value"),
        State("run-id", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def write(clicks: int | None, kind: str, run_id: str) -> None:
        """Let the chosen writer rewrite the report of the shown run."""
        if not clicks:
            raise PreventUpdate
        try:
            desk.begin(run_id, kind)
        except MirrorTwinError as error:
            show_error("The report cannot be written", str(error))

    @app.callback(
        Input("report-stop", "n_clicks"),
        State("run-id", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def stop(clicks: int | None, run_id: str) -> None:
        """Stop the writer."""
        if not clicks:
            raise PreventUpdate
        desk.stop(run_id)

    @app.callback(
        Output("question", "error"),
        Input("report-ask", "n_clicks"),
        Input("question", "n_submit"),
        State("question", "value"),
        State("report-writer", "value"),
        State("run-id", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def ask(
        clicks: int | None, entered: int | None, question: str | None, kind: str, run_id: str
    ) -> str | None:
        """Put a question about the shown report to the chosen writer."""
        if not clicks and not entered:
            raise PreventUpdate
        try:
            desk.begin(run_id, kind, question or "")
        except MirrorTwinError as error:
            return str(error)
        return None

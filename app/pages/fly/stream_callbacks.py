"""The callbacks that serve a page over its socket, and what the browser draws of what arrives."""

from dash import Dash, Input, Output, State, ctx

from app.kit.wiring import in_browser, show_error
from app.pages.fly import page as fly
from app.pages.report import panel as report_panel
from app.services import Services
from app.sessions import BrowserPage

NO_SOCKET = (
    "This browser cannot open a live connection. Runs still fly; reload the page to see how far "
    "they are."
)

DRAWN = {
    "report": report_panel.REPORT_NODES_ID,
    "answers": report_panel.ANSWER_NODES_ID,
    "ranking": fly.RANKING_NODES_ID,
}
"""What the browser draws by itself: the element, and the store of its nodes."""


def register(app: Dash, services: Services) -> None:
    """Attach the callbacks of the live connection."""
    _register_attend(app, services)
    _register_follow(app, services)
    in_browser(
        app,
        "tiles",
        "showFlight",
        Output("taken", "data"),
        Input("flight", "data"),
        Input("tile-specs", "data"),
    )
    for name, store in DRAWN.items():
        # With an output: Dash calls what has none only when its inputs change.
        in_browser(app, "draw", name, Output(name, "data-parts"), Input(store, "data"))


def _register_attend(app: Dash, services: Services) -> None:
    # No output and no input: Dash starts such a callback on page load, and starts it again when a
    # lost connection is back.
    @app.callback(
        State("session", "data"), State("run-id", "data"), websocket=True, persistent=True
    )
    async def attend(session_id: str, run_id: str | None) -> None:
        """Serve this page for as long as it is open."""
        socket = ctx.websocket
        if socket is None:
            show_error("No live connection", NO_SOCKET)
            return
        await services.sessions.attend(session_id, run_id, BrowserPage(socket))


def _register_follow(app: Dash, services: Services) -> None:
    @app.callback(
        Input("run-id", "data"),
        Input("awake", "data"),
        State("session", "data"),
        State("page-kind", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def follow(
        run_id: str | None, awake: float | None, session_id: str, kind: str | None
    ) -> None:
        """Follow the run that the address now names.

        A page that slept, in a frozen tab or a closed laptop, was given up: serve it again.
        """
        if kind != "fly":
            return
        session = services.sessions.get(session_id)
        session.show(run_id)
        # One that slept for long was forgotten, too; one that loads is about to be attended.
        is_left = session.abandoned or (ctx.triggered_id == "awake" and session.is_unattended)
        if ctx.websocket is not None and is_left:
            await services.sessions.attend(session_id, run_id, BrowserPage(ctx.websocket))

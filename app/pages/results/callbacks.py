"""The callbacks of the pages *Results*: the flights behind the cells of a confusion matrix."""

import asyncio
from typing import Any

from dash import ALL, MATCH, Dash, Input, Output, State, ctx
from dash.exceptions import PreventUpdate

from app.kit.addresses import run_path
from app.pages.results.cell_runs import Card, flights, stored_run, test_runs
from app.services import Services
from core.experiments.stored import model_cards


def register(app: Dash, services: Services) -> None:
    """Attach the callbacks of the pages to ``app``."""
    _register_cells(app, services)
    _register_flights(app, services)


def _register_cells(app: Dash, services: Services) -> None:
    @app.callback(
        Output({"type": "cell-runs", "card": MATCH}, "children"),
        Input({"type": "confusion", "card": MATCH}, "clickData"),
        Input({"type": "confused", "card": MATCH, "true": ALL, "said": ALL}, "n_clicks"),
        State({"type": "confusion", "card": MATCH}, "id"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def open_cell(
        click: dict[str, Any] | None, clicks: list[int | None], matrix: dict[str, str]
    ) -> Any:
        """List the flights behind the cell that was chosen."""
        card = _card(matrix["card"])
        chosen = ctx.triggered_id
        if chosen["type"] == "confused" and any(clicks):
            true, said = chosen["true"], chosen["said"]
        elif click and chosen["type"] == "confusion":
            point = click["points"][0]
            true, said = (card["classes"][int(point[axis])] for axis in ("y", "x"))
        else:
            raise PreventUpdate
        return await asyncio.to_thread(flights, card, true, said, services.store.records())


def _register_flights(app: Dash, services: Services) -> None:
    @app.callback(
        Output("url", "pathname", allow_duplicate=True),
        Input({"type": "fly-test", "card": ALL, "run": ALL}, "n_clicks"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def fly(clicks: list[int | None]) -> str:
        """Open a test flight: the stored one, or flown now."""
        if not any(clicks) or ctx.triggered_id is None:
            raise PreventUpdate
        card = _card(ctx.triggered_id["card"])
        wanted = next(run for run in test_runs(card) if run.id == ctx.triggered_id["run"])
        stored = stored_run(wanted, await asyncio.to_thread(services.store.records))
        if stored is not None:
            return run_path(stored.id)
        run_id = await asyncio.to_thread(services.engine.submit, wanted.plan, wanted.fault)
        services.recorder.record(run_id)
        return run_path(run_id)


def _card(name: str) -> Card:
    found = [card for card in model_cards() if card["name"] == name]
    if not found:
        raise PreventUpdate
    return found[0]

"""The callbacks of a live flight: from a click to the engine. The stream shows the result."""

import asyncio
from typing import Any

from dash import Dash, Input, Output, State, ctx
from dash.exceptions import PreventUpdate

from app.kit.wiring import show_error
from app.pages.fly import live_controls
from core.errors import InputError, MirrorTwinError
from core.jobs.engine import Engine
from core.jobs.live import PACES


def register(app: Dash, engine: Engine) -> None:
    """Attach the callbacks of the live bar."""
    _register_pace(app, engine)
    _register_actions(app, engine)


def _register_pace(app: Dash, engine: Engine) -> None:
    by_button = {live_controls.pace_id(pace): pace for pace in PACES}

    @app.callback(
        Input(live_controls.PAUSE_ID, "n_clicks"),
        *(Input(button, "n_clicks") for button in by_button),
        State(live_controls.PAUSE_ID, "children"),
        State("run-id", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def steer(clicks: int | None, *rest: Any) -> None:
        """Pause, resume, or change the pace."""
        *_, pause_says, run_id = rest
        if run_id is None or not ctx.triggered[0]["value"]:
            raise PreventUpdate
        pace = by_button.get(str(ctx.triggered_id))
        is_paused = pause_says == "Pause" if pace is None else None
        try:
            await asyncio.to_thread(engine.steer, run_id, pace=pace, is_paused=is_paused)
        except MirrorTwinError as error:
            show_error("The action failed", str(error))


def _register_actions(app: Dash, engine: Engine) -> None:
    @app.callback(
        output={
            name: Output(live_controls.field_id(name), "error") for name in live_controls.FIELDS
        },
        inputs={
            "clicks": [
                Input(live_controls.button_id(name), "n_clicks") for name in live_controls.BUTTONS
            ],
            "values": {
                name: State(live_controls.field_id(name), "value") for name in live_controls.FIELDS
            },
            "run_id": State("run-id", "data"),
        },
        websocket=True,
        prevent_initial_call=True,
    )
    async def act(
        clicks: list[int | None], values: dict[str, Any], run_id: str | None
    ) -> dict[str, str | None]:
        """Inject a fault, repair, or set targets in the flight that is shown, now."""
        if run_id is None or not ctx.triggered[0]["value"]:
            raise PreventUpdate
        errors: dict[str, str | None] = dict.fromkeys(live_controls.FIELDS)
        try:
            action = live_controls.read_action(str(ctx.triggered_id), values)
            await asyncio.to_thread(engine.act, run_id, action)
        except MirrorTwinError as error:
            if isinstance(error, InputError) and error.field in errors:
                errors[error.field] = error.problem
            else:
                show_error("The action failed", str(error))
        return errors

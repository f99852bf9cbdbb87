"""The callbacks of the page *Fly*: its form, its runs, their diagnosis, its 3D views."""

import asyncio
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from dash import Dash, Input, Output, State, no_update, set_props
from dash.exceptions import PreventUpdate

from app.kit.addresses import run_path
from app.kit.wiring import in_browser, show_error
from app.kit.words import takes_cylinder
from app.pages.fly import (
    cursor_tools,
    live_callbacks,
    live_controls,
    playback,
    present,
    scene_bar,
    stream_callbacks,
)
from app.pages.fly import page as fly
from app.pages.fly.setup import (
    FIELDS,
    WEATHER_FIELDS,
    error_id,
    fault_note,
    field_id,
    read_form,
)
from app.pages.fly.view import RunView
from app.services import Services
from core.errors import InputError, MirrorTwinError

if TYPE_CHECKING:  # it loads torch
    from core.diagnosis.predict import Residual


def register(app: Dash, services: Services) -> None:
    """Attach all callbacks of the page *Fly*, those of the panel *Report* aside."""
    for attach in (_register_run, _register_again, _register_retry, _register_cancel):
        attach(app, services)
    _register_diagnosis(app, services)
    _register_form(app)
    _register_scene(app, services)
    stream_callbacks.register(app, services)
    live_callbacks.register(app, services.engine)
    scene_bar.register(app, services.sessions)
    playback.register(
        app, lambda session_id, time_s: services.sessions.get(session_id).seek(time_s)
    )
    cursor_tools.register(app)
    present.register(app)


def _register_run(app: Dash, services: Services) -> None:
    fields = {name: State(field_id(name), "value") for name in FIELDS}

    @app.callback(
        # With an output that is not part of the page, Dash would call this when the page comes.
        output={
            "errors": {name: Output(error_id(name), "error") for name in FIELDS},
            "weather": Output("weather", "open"),
        },
        inputs={
            "clicks": Input("run", "n_clicks"),
            "session_id": State("session", "data"),
            "values": fields,
            "pace": State(live_controls.PACE_ID, "value"),
            "shown": {name: State(error_id(name), "error") for name in FIELDS},
        },
        running=[(Output("run", "loading"), True, False)],
        websocket=True,
        prevent_initial_call=True,
    )
    async def run(
        clicks: int | None,
        session_id: str,
        values: dict[str, Any],
        pace: str | None,
        shown: dict[str, str | None],
    ) -> dict[str, Any]:
        """Fly the plan and fault of the form; ``shown`` are the errors that it shows so far."""
        _require(clicks)
        # Only what changes: the browser would draw every field again before the first sample.
        errors: dict[str, Any] = {name: None if shown[name] else no_update for name in FIELDS}
        try:
            plan, fault = read_form(values)
            submit = partial(
                services.engine.submit, plan, fault, pace=live_controls.read_pace(pace)
            )
            path = await _submit(services, session_id, submit, form_is_current=True)
            set_props("url", {"pathname": path})
        except MirrorTwinError as error:
            if isinstance(error, InputError) and error.field in errors:
                errors[error.field] = error.problem
            else:
                show_error("The run could not be started", str(error))
        # The weather may be folded away: an error in it must be seen.
        unfold = any(isinstance(errors[name], str) for name in WEATHER_FIELDS) or no_update
        return {"errors": errors, "weather": unfold}


def _register_again(app: Dash, services: Services) -> None:
    @app.callback(
        Output("url", "pathname", allow_duplicate=True),
        Input("again", "n_clicks"),
        State("run-id", "data"),
        State("session", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def again(clicks: int | None, run_id: str, session_id: str) -> Any:
        """Fly the shown run once more, as a new run."""
        _require(clicks)
        try:
            record = await asyncio.to_thread(services.store.get, run_id)
            submit = partial(services.engine.submit, record.plan, record.fault, record.actions)
            return await _submit(services, session_id, submit)
        except MirrorTwinError as error:
            show_error("The run could not be started", str(error))
            return no_update


def _register_retry(app: Dash, services: Services) -> None:
    @app.callback(
        Input("retry", "n_clicks"),
        State("run-id", "data"),
        State("session", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def retry(clicks: int | None, run_id: str, session_id: str) -> None:
        """Fly a failed run again under its own name."""
        _require(clicks)
        if await _attempt(services.engine.retry, run_id):
            services.recorder.record(run_id)
            services.sessions.get(session_id).show(run_id, again=True)


def _register_cancel(app: Dash, services: Services) -> None:
    @app.callback(
        Input("cancel", "n_clicks"),
        State("run-id", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def cancel(clicks: int | None, run_id: str) -> None:
        """Stop the run that is shown."""
        _require(clicks)
        await _attempt(services.engine.cancel, run_id)


def _register_diagnosis(app: Dash, services: Services) -> None:
    @app.callback(
        Input(fly.RESIDUAL_SWITCH_ID, "value"),
        State("run-id", "data"),
        running=[(Output(fly.RESIDUAL_SWITCH_ID, "disabled"), True, False)],
        websocket=True,
        prevent_initial_call=True,
    )
    async def judge(residual: "Residual", run_id: str | None) -> None:
        """Diagnose the flight that is shown with the other kind of residual."""
        if run_id is None:
            return
        try:
            record = await asyncio.to_thread(services.store.get, run_id)
            if record.status != "done":
                return
            if residual == "paired":
                diagnosis, _ = await asyncio.to_thread(services.store.load_result, run_id)
            else:
                diagnosis = await asyncio.to_thread(services.engine.diagnose, run_id, residual)
        except MirrorTwinError as error:
            show_error("This residual is not available for this run", str(error))
            return
        for update in RunView(record).diagnosed(diagnosis):
            set_props(update.component_id, {update.prop: update.value})


def _register_form(app: Dash) -> None:
    @app.callback(
        Output("fault-note", "children"),
        Output(field_id("cylinder"), "disabled"),
        Output(field_id("severity"), "disabled"),
        Output(field_id("onset_s"), "disabled"),
        Input(field_id("fault"), "value"),
        websocket=True,
    )
    async def explain_fault(mode: str) -> tuple[str, bool, bool, bool]:
        """Describe the chosen mode, and disable the controls that it does not use."""
        healthy = mode == "nominal"
        return fault_note(mode), not takes_cylinder(mode), healthy, healthy

    in_browser(
        app,
        "mirrortwin",
        "severityText",
        Output("severity-value", "children"),
        Input(field_id("severity"), "value"),
    )


def _register_scene(app: Dash, services: Services) -> None:
    @app.callback(
        Output("scene", "children"),
        Input("scene-tab", "value"),
        Input("run-id", "data"),
        Input("scheme", "data"),
        State("session", "data"),
        State("scene", "children"),
        websocket=True,
    )
    async def mount_scene(
        tab: str, run_id: str | None, scheme: str | None, session_id: str, mounted: Any
    ) -> Any:
        """Mount the chosen 3D view, and only that one."""
        if scheme is None:
            return no_update
        session = services.sessions.get(session_id)
        session.dark = scheme == "dark"
        frame = (
            fly.live_frame(session_id)
            if tab == "live"
            else fly.replay_frame(run_id, services.sandbox_prefix, dark=session.dark)
        )
        await asyncio.to_thread(session.scene)
        same = mounted and mounted["props"].get("src") == getattr(frame, "src", None)
        return no_update if same else frame


def _require(clicks: int | None) -> None:
    """End a callback that was called only because its button was mounted."""
    if not clicks:
        raise PreventUpdate


async def _submit(
    services: Services,
    session_id: str,
    submit: Callable[[], str],
    *,
    form_is_current: bool = False,
) -> str:
    """Start a run and turn the page to it at once; returns its address, which the page goes to."""
    run_id = await asyncio.to_thread(submit)
    services.recorder.record(run_id)
    services.sessions.get(session_id).show(run_id, form_is_current=form_is_current)
    return run_path(run_id)


async def _attempt(act: Callable[[str], None], run_id: str) -> bool:
    """Carry out a command of the engine; if it fails, show why and return False."""
    try:
        await asyncio.to_thread(act, run_id)
    except MirrorTwinError as error:
        show_error("The action failed", str(error))
        return False
    return True

"""The wiring: what a click, a keystroke or an address sets in motion."""

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

from dash import ClientsideFunction, Dash, Input, Output, State, ctx, html, no_update, set_props
from dash.exceptions import PreventUpdate

from app.live import UNEXPECTED, Page, Sessions
from app.pages import (
    cursor_tools,
    fault_page,
    faults,
    fly,
    help,
    library,
    live_callbacks,
    live_controls,
    missing,
    playback,
    present,
    report_callbacks,
    report_panel,
    runs_callbacks,
    teach_callbacks,
    tour,
)
from app.pages.report_writing import ReportDesk
from app.pages.run_view import RunView, alert
from app.pages.setup import (
    DEFAULT_FAULT,
    FIELDS,
    WEATHER_FIELDS,
    error_id,
    fault_note,
    field_id,
    read_form,
    takes_cylinder,
)
from app.pages.shell import Address, read_address, run_path
from app.recorder import Recorder
from core.errors import InputError, MirrorTwinError
from core.experiments.shelf import take
from core.jobs.engine import Engine
from core.jobs.store import RunStore
from core.teach.classroom import Classroom

if TYPE_CHECKING:  # it loads torch
    from core.diagnosis.predict import Residual

logger = logging.getLogger(__name__)

NO_SOCKET = (
    "This browser cannot open a live connection. Runs still fly; reload the page to see where "
    "they have come to."
)


@dataclass(frozen=True, slots=True)
class Services:
    """What the callbacks call upon."""

    engine: Engine
    store: RunStore
    sessions: Sessions
    recorder: Recorder
    desk: ReportDesk
    classroom: Classroom
    sandbox_prefix: str = ""


def tell(error: Exception) -> None:
    """Show an error that no callback expected; for ``Dash(on_error=...)``. Its text stays here."""
    logger.error("a callback failed", exc_info=error)
    _alert("Something went wrong", UNEXPECTED)


def register(app: Dash, services: Services) -> None:
    """Attach every callback to ``app``."""
    _register_address(app, services)
    _register_live(app, services)
    _register_runs(app, services)
    _register_diagnosis(app, services)
    _register_form(app)
    _register_scene(app, services)
    playback.register(
        app, lambda session_id, time_s: services.sessions.get(session_id).seek(time_s)
    )
    cursor_tools.register(app)
    library.register(app)
    live_callbacks.register(app, services.engine, _alert)
    runs_callbacks.register(app, services.store)
    present.register(app)
    tour.register(app)
    teach_callbacks.register(app, services.classroom, services.store)
    report_callbacks.register(app, services.desk, _alert)


def _register_address(app: Dash, services: Services) -> None:
    @app.callback(
        Output("page", "children"),
        Output("page-kind", "data"),
        Output("run-id", "data"),
        Output("page-title", "data"),
        Input("url", "pathname"),
        State("page-kind", "data"),
        State("session", "data"),
        websocket=True,
    )
    async def turn_page(
        path: str | None, kind: str | None, session_id: str
    ) -> tuple[Any, Any, Any, str]:
        """Show the page that the address names; a page that stays is left as it is."""
        address = await asyncio.to_thread(read_address, path or "/", services.store)
        if address.kind == kind == "fly":
            return no_update, no_update, address.run_id, address.title
        services.sessions.get(session_id).clear()
        page = await asyncio.to_thread(_page, address, services)
        return page, address.kind, address.run_id, address.title

    _in_browser(
        app,
        ClientsideFunction("workbench", "nameTab"),
        Input("page-title", "data"),
    )
    _in_browser(
        app,
        ClientsideFunction("mirrortwin", "markPage"),
        Input("page-kind", "data"),
    )
    _in_browser(
        app,
        ClientsideFunction("mirrortwin", "showRun"),
        Input("run-id", "data"),
    )


def _page(address: Address, services: Services) -> html.Div:
    store = services.store
    match address.kind:
        case "fly":
            return fly.layout(replace(DEFAULT_FAULT, mode=address.mode or DEFAULT_FAULT.mode))
        case "runs":
            return runs_callbacks.page(store)
        case "faults" if address.mode is not None:
            return fault_page.mode_layout(address.mode, take("signs"))
        case "faults":
            return faults.catalogue_layout()
        case "results" | "compare":
            return library.layout(address, store, services.sandbox_prefix)
        case "help":
            return help.layout()
        case "teach":
            return teach_callbacks.layout(address.attempt_id, services.classroom)
        case _:
            return missing.layout(address.problem)


def _register_live(app: Dash, services: Services) -> None:
    # No output and no input: Dash starts such a callback on page load, and starts it again when a
    # lost connection is back.
    @app.callback(
        State("session", "data"), State("run-id", "data"), websocket=True, persistent=True
    )
    async def attend(session_id: str, run_id: str | None) -> None:
        """Serve this page for as long as it is open."""
        socket = ctx.websocket
        if socket is None:
            _alert("No live connection", NO_SOCKET)
            return
        await services.sessions.attend(session_id, run_id, Page(socket))

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
        """Follow the run that the address has come to name.

        A page that slept, in a frozen tab or a closed laptop, was given up: serve it again.
        """
        if kind != "fly":
            return
        session = services.sessions.get(session_id)
        session.show(run_id)
        # One that slept for long was forgotten, too; one that loads is about to be attended.
        is_left = session.abandoned or (ctx.triggered_id == "awake" and session.is_unattended)
        if ctx.websocket is not None and is_left:
            await services.sessions.attend(session_id, run_id, Page(ctx.websocket))

    _in_browser(
        app,
        ClientsideFunction("tiles", "showFlight"),
        Output("taken", "data"),
        Input("flight", "data"),
        Input("tile-specs", "data"),
    )
    drawn = {
        "report": report_panel.REPORT_NODES_ID,
        "answers": report_panel.ANSWER_NODES_ID,
        "ranking": fly.RANKING_NODES_ID,
    }
    for name, store in drawn.items():
        # With an output: Dash calls what has none only when its inputs change.
        _in_browser(
            app, ClientsideFunction("draw", name), Output(name, "data-parts"), Input(store, "data")
        )


def _register_runs(app: Dash, services: Services) -> None:
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
        """Fly what the form says; ``shown`` are the errors that it shows so far."""
        _require(clicks)
        # Only what changes: the browser would draw every field anew before the first sample.
        errors: dict[str, Any] = {name: None if shown[name] else no_update for name in FIELDS}
        try:
            plan, fault = read_form(values)
            submit = partial(
                services.engine.submit, plan, fault, pace=live_controls.read_pace(pace)
            )
            path = await _submitted(services, session_id, submit, form_is_current=True)
            set_props("url", {"pathname": path})
        except MirrorTwinError as error:
            if isinstance(error, InputError) and error.field in errors:
                errors[error.field] = error.problem
            else:
                _alert("The run could not be started", str(error))
        # The weather may be folded away: an error in it must be seen.
        unfold = any(isinstance(errors[name], str) for name in WEATHER_FIELDS) or no_update
        return {"errors": errors, "weather": unfold}

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
            return await _submitted(services, session_id, submit)
        except MirrorTwinError as error:
            _alert("The run could not be started", str(error))
            return no_update

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
        if await _done(services.engine.retry, run_id):
            services.recorder.record(run_id)
            services.sessions.get(session_id).show(run_id, again=True)

    @app.callback(
        Input("cancel", "n_clicks"),
        State("run-id", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def cancel(clicks: int | None, run_id: str) -> None:
        """Stop the run that is shown."""
        _require(clicks)
        await _done(services.engine.cancel, run_id)


def _register_diagnosis(app: Dash, services: Services) -> None:
    @app.callback(
        Input(fly.RESIDUAL_SWITCH_ID, "value"),
        State("run-id", "data"),
        running=[(Output(fly.RESIDUAL_SWITCH_ID, "disabled"), True, False)],
        websocket=True,
        prevent_initial_call=True,
    )
    async def judge(residual: "Residual", run_id: str | None) -> None:
        """Show what the other kind of residual makes of the flight that is shown."""
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
            _alert("The flight could not be diagnosed so", str(error))
            return
        for update in RunView(record).diagnosed(diagnosis):
            set_props(update.component_id, {update.prop: update.value})


def _require(clicks: int | None) -> None:
    """End a callback that was called only because its button has come onto the page."""
    if not clicks:
        raise PreventUpdate


async def _submitted(
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


async def _done(act: Callable[[str], None], run_id: str) -> bool:
    """Whether the engine did as asked; if not, the page says why."""
    try:
        await asyncio.to_thread(act, run_id)
    except MirrorTwinError as error:
        _alert("That did not work", str(error))
        return False
    return True


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
        """Say what the chosen mode does, and rest the controls that it has no use for."""
        healthy = mode == "nominal"
        return fault_note(mode), not takes_cylinder(mode), healthy, healthy

    _in_browser(
        app,
        ClientsideFunction("mirrortwin", "severityText"),
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
        """Mount the 3D view that is asked for, and only that one."""
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


def _in_browser(app: Dash, function: ClientsideFunction, *dependencies: Output | Input) -> None:
    """Attach a function of ``assets/*.js``."""
    app.clientside_callback(  # type: ignore[no-untyped-call]  # dash types callback alone
        function, *dependencies
    )


def _alert(title: str, message: str) -> None:
    """Show an error on the page, from within a callback."""
    update = alert("error", title, message)
    set_props(update.component_id, {update.prop: update.value})

"""The callbacks of the page *Teach*. What is hidden is kept by `core.teach.classroom`."""

import asyncio
import logging
import re
from typing import Any, TypeGuard

from dash import Dash, Input, Output, State, html, no_update, set_props
from dash.exceptions import PreventUpdate

from app.figures.mystery import mystery_flight, shown_marks
from app.kit.addresses import TEACH_PREFIX, teach_path
from app.kit.wiring import in_browser
from app.pages.teach import page as teach
from app.pages.teach import reveal as teach_reveal
from app.pages.teach import start as teach_start
from app.scenes.recordings import with_recording
from core.errors import InputError, MirrorTwinError
from core.store.store import RunStore
from core.teach.attempt import Attempt
from core.teach.challenge import LEVELS, Challenge, mode_sets
from core.teach.classroom import Classroom
from core.teach.scoring import Mark

logger = logging.getLogger(__name__)

_LEARNER = re.compile(r"[A-Za-z0-9]{16,40}")


def current_layout(attempt_id: str | None, classroom: Classroom) -> html.Div:
    """The page at ``/teach``, or that of one mystery flight as it stands."""
    if attempt_id is None:
        return teach_start.start_layout()
    attempt = classroom.get(attempt_id)
    if attempt.over:
        truth = classroom.truth(attempt_id)
        return teach_reveal.reveal_layout(attempt, truth, _flight(attempt, classroom))
    held = classroom.altitude_and_speed(attempt_id)
    return teach.attempt_layout(attempt, *held, _flight(attempt, classroom))


def register(app: Dash, classroom: Classroom, store: RunStore) -> None:
    """Attach the callbacks of the page to ``app``."""
    _register_start(app, classroom)
    _register_marks(app, classroom)
    _register_end(app, classroom, store)
    for name, dependencies in (
        ("learner", (Output(teach_start.LEARNER_ID, "data"),
                     Input(teach_start.LEARNER_ID, "modified_timestamp"),
                     State(teach_start.LEARNER_ID, "data"))),
        ("draw", (Output(teach.DRAWN_ID, "data"),
                  Input(teach.FLIGHT_ID, "data"), Input(teach.MARKS_ID, "data"))),
    ):  # fmt: skip
        in_browser(app, "teach", name, *dependencies)


def _register_start(app: Dash, classroom: Classroom) -> None:
    @app.callback(
        Output(teach_start.PAST_ID, "children"),
        Input(teach_start.LEARNER_ID, "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def past(learner: str | None) -> Any:
        """The flights of this browser."""
        if not _is_learner(learner):
            raise PreventUpdate
        try:
            return teach_start.past_list(await asyncio.to_thread(classroom.attempts, learner))
        except MirrorTwinError as error:
            return html.P(str(error), className="teach-error")

    @app.callback(
        # With an output that is not part of the page, Dash would call this when the page comes.
        Output(teach_start.START_ERROR_ID, "children"),
        Input(teach_start.START_ID, "n_clicks"),
        State("mystery-level", "value"),
        State("mystery-set", "value"),
        State("mystery-code", "value"),
        State(teach_start.LEARNER_ID, "data"),
        running=[(Output(teach_start.START_ID, "loading"), True, False)],
        websocket=True,
        prevent_initial_call=True,
    )
    async def start(
        clicks: int | None, level: str, modes: str, code: str | None, learner: str | None
    ) -> str:
        """Fly a mystery and go to it."""
        if not clicks or not _is_learner(learner):
            raise PreventUpdate
        try:
            challenge = _challenge(level, modes, code)
            attempt = await asyncio.to_thread(classroom.start, challenge, learner)
        except MirrorTwinError as error:
            return str(error)
        set_props("url", {"pathname": teach_path(attempt.id)})
        return ""


def _register_marks(app: Dash, classroom: Classroom) -> None:
    @app.callback(
        Output(teach.MARKS_ID, "data"),
        Output(teach.EVIDENCE_ID, "children"),
        Output(teach.NOTE_ID, "children", allow_duplicate=True),
        Input(teach.MARK_ID, "data"),
        State("url", "pathname"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def mark(claim: dict[str, Any] | None, path: str) -> tuple[Any, Any, Any]:
        """Set a mark, or remove one."""
        if not isinstance(claim, dict):
            raise PreventUpdate
        try:
            attempt = await asyncio.to_thread(_change_marks, classroom, _id_of(path), claim)
        except MirrorTwinError as error:
            return no_update, no_update, _problem(error)
        return shown_marks(attempt.marks), teach.evidence_list(attempt.marks), None

    @app.callback(
        Output(teach.FLIGHT_ID, "data"),
        Output(teach.HINT_ID, "display"),
        Output("mystery-mirror-key", "hidden"),
        Output(teach.NOTE_ID, "children", allow_duplicate=True),
        Input(teach.HINT_ID, "n_clicks"),
        State("url", "pathname"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def show_mirror(clicks: int | None, path: str) -> tuple[Any, Any, Any, Any]:
        """Draw the mirror too, for points."""
        if not clicks:
            raise PreventUpdate
        try:
            attempt = await asyncio.to_thread(classroom.show_mirror, _id_of(path))
            flight = await asyncio.to_thread(_flight, attempt, classroom)
        except MirrorTwinError as error:
            return no_update, no_update, no_update, _problem(error)
        return flight, "none", False, None


def _register_end(app: Dash, classroom: Classroom, store: RunStore) -> None:
    @app.callback(
        Output("page", "children", allow_duplicate=True),
        Output(teach.ANSWER_ID, "error"),
        Output(teach.NOTE_ID, "children", allow_duplicate=True),
        Input(teach.SUBMIT_ID, "n_clicks"),
        State(teach.ANSWER_ID, "value"),
        State("url", "pathname"),
        running=[(Output(teach.SUBMIT_ID, "loading"), True, False)],
        websocket=True,
        prevent_initial_call=True,
    )
    async def submit(clicks: int | None, answer: str | None, path: str) -> tuple[Any, Any, Any]:
        """Score the answer and show the fault."""
        if not clicks:
            raise PreventUpdate
        if not isinstance(answer, str):
            return no_update, "name a fault first", no_update
        try:
            return await _end_attempt(classroom, store, _id_of(path), answer), no_update, no_update
        except MirrorTwinError as error:
            return no_update, None, _problem(error)

    @app.callback(
        Output("page", "children", allow_duplicate=True),
        Output(teach.NOTE_ID, "children", allow_duplicate=True),
        Input(teach.GIVE_UP_ID, "submit_n_clicks"),
        State("url", "pathname"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def give_up(clicks: int | None, path: str) -> tuple[Any, Any]:
        """Show the fault, for no points."""
        if not clicks:
            raise PreventUpdate
        try:
            return await _end_attempt(classroom, store, _id_of(path), None), no_update
        except MirrorTwinError as error:
            return no_update, _problem(error)


async def _end_attempt(
    classroom: Classroom, store: RunStore, attempt_id: str, answer: str | None
) -> html.Div:
    attempt = await asyncio.to_thread(classroom.submit, attempt_id, answer)
    page = await asyncio.to_thread(current_layout, attempt_id, classroom)
    if attempt.run_id is not None:
        asyncio.get_running_loop().run_in_executor(None, _record, store, attempt.run_id)
    return page


def _record(store: RunStore, run_id: str) -> None:
    """Write the recording that any other run has."""
    try:
        with_recording(store, run_id)
    except MirrorTwinError as error:
        logger.warning("no recording of run %s: %s", run_id, error)


def _flight(attempt: Attempt, classroom: Classroom) -> dict[str, Any]:
    onset_s = None
    if attempt.over:
        fault = classroom.truth(attempt.id).fault
        onset_s = None if fault.mode == "nominal" else fault.onset_s
    return mystery_flight(classroom.readings(attempt.id), classroom.mirror(attempt.id), onset_s)


def _change_marks(classroom: Classroom, attempt_id: str, claim: dict[str, Any]) -> Attempt:
    channel = str(claim.get("channel"))
    if claim.get("direction") is None:
        return classroom.unmark(attempt_id, channel)
    mark = Mark(channel, claim.get("time_s"), claim["direction"])  # type: ignore[arg-type]  # checked
    return classroom.mark(attempt_id, mark)


def _challenge(level: str, modes: str, code: str | None) -> Challenge:
    chosen = next((item for item in LEVELS if item.id == level), None)
    if chosen is None:
        raise InputError("level", f"must be one of {', '.join(item.id for item in LEVELS)}")
    if modes not in mode_sets():
        raise InputError("modes", f"must be one of {', '.join(mode_sets())}")
    chosen_code = (code or "").strip() or None
    return Challenge(chosen.severity_low, chosen.severity_high, mode_sets()[modes], chosen_code)


def _id_of(path: str) -> str:
    return path.removeprefix(TEACH_PREFIX)


def _is_learner(learner: object) -> TypeGuard[str]:
    return isinstance(learner, str) and _LEARNER.fullmatch(learner) is not None


def _problem(error: Exception) -> html.P:
    return html.P(str(error), className="teach-error")

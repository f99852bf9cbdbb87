"""The long-lived services that the callbacks and routes of all pages use."""

from dataclasses import dataclass

from app.recorder import Recorder
from app.report_desk import ReportDesk
from app.sessions import Sessions
from core.jobs.engine import Engine
from core.store.store import RunStore
from core.teach.classroom import Classroom


@dataclass(frozen=True, slots=True)
class Services:
    """The services of one server; they outlive every page load.

    ``sandbox_prefix`` is that of the addresses open to a sandboxed frame, which sends no cookie.
    """

    engine: Engine
    store: RunStore
    sessions: Sessions
    recorder: Recorder
    desk: ReportDesk
    classroom: Classroom
    sandbox_prefix: str = ""

"""What callbacks call upon."""

from dataclasses import dataclass

from app.pages.fly.session import Sessions
from app.recorder import Recorder
from app.report_desk import ReportDesk
from core.jobs.engine import Engine
from core.store.store import RunStore
from core.teach.classroom import Classroom


@dataclass(frozen=True, slots=True)
class Services:
    """All that outlives a page."""

    engine: Engine
    store: RunStore
    sessions: Sessions
    recorder: Recorder
    desk: ReportDesk
    classroom: Classroom
    sandbox_prefix: str = ""

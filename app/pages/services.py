"""What callbacks call upon."""

from dataclasses import dataclass

from app.live import Sessions
from app.pages.report_writing import ReportDesk
from app.recorder import Recorder
from core.jobs.engine import Engine
from core.jobs.store import RunStore
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

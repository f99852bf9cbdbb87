"""Archives of runs with their recordings, for the page *Runs* and the command line."""

import logging
from pathlib import Path

from app.scenes.recordings import with_recording
from core.errors import MirrorTwinError
from core.exchange.run_archive import MAX_PACKED_RUNS, pack, unpack
from core.store.records import RunRecord
from core.store.store import RunStore

logger = logging.getLogger(__name__)


def export_runs(store: RunStore, run_ids: list[str], path: Path) -> None:
    """Pack runs with their recordings; raises `InputError` or `StoreError`."""
    for run_id in run_ids[:MAX_PACKED_RUNS]:
        if store.get(run_id).status == "done":
            with_recording(store, run_id)
    pack(store, run_ids, path)


def import_runs(store: RunStore, path: Path) -> list[RunRecord]:
    """Unpack runs, and record those that came without a recording."""
    records = unpack(store, path)
    for record in records:
        try:
            with_recording(store, record.id)
        except MirrorTwinError as error:  # the runs are in; the recording is made when it is asked
            logger.warning("no recording of run %s: %s", record.id, error)
    return records

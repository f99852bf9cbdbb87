"""The recorder: a Rerun recording of every run, whether or not a page is watching."""

import asyncio
import logging

from app.kit.frames import frames, joined
from app.scenes.recording import RunLog, write_recording
from app.scenes.recordings import Recordings
from core.diagnosis.diagnosis import Diagnosis
from core.errors import MirrorTwinError
from core.fmea.fault import Fault
from core.jobs import events
from core.jobs.engine import Engine
from core.store.store import RunStore
from core.twin.plan import Plan

logger = logging.getLogger(__name__)

RECORDING_PERIOD_S = 1.0
"""How often a live recording grows: logging a batch costs a fifth of logging its parts."""


def warm_up() -> None:
    """Make a recording and drop it: the first one in a process takes half a second."""
    log = RunLog("warm-up")
    log.begin(Plan(), Plan().altitude_ft)
    log.read()
    log.close()


class Recorder:
    """Streams each live run into a growing recording, and leaves one compact file in the store."""

    def __init__(self, engine: Engine, store: RunStore, recordings: Recordings) -> None:
        """Start without recordings."""
        self._engine, self._store, self._recordings = engine, store, recordings
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def record(self, run_id: str) -> None:
        """Record a run from its first event to its end; call on the event loop."""
        task = asyncio.create_task(self._record(run_id), name=f"record {run_id}")
        self._tasks[run_id] = task
        task.add_done_callback(lambda _: self._tasks.pop(run_id, None))

    async def close(self) -> None:
        """Stop recording."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _record(self, run_id: str) -> None:
        try:
            await self._follow(run_id)
        except MirrorTwinError as error:
            # The run itself is stored by the engine; only its 3D replay is missing.
            logger.warning("no recording of run %s: %s", run_id, error)

    async def _follow(self, run_id: str) -> None:
        subscription = self._engine.subscribe(run_id)
        recording = self._recordings.open(run_id)
        diagnosis: Diagnosis | None = None
        try:
            async for batch in frames(subscription, RECORDING_PERIOD_S, RECORDING_PERIOD_S):
                if samples := joined(batch):
                    await asyncio.to_thread(recording.extend, samples)
                for event in batch:
                    match event:
                        case events.Diagnosed():
                            diagnosis = event.diagnosis
                        case events.Finished():
                            await asyncio.to_thread(self._keep, run_id, diagnosis)
        finally:
            subscription.close()
            await asyncio.to_thread(recording.finish, diagnosis)

    def _keep(self, run_id: str, diagnosis: Diagnosis | None) -> None:
        record = self._store.get(run_id)
        pair = self._store.load_pair(run_id)
        fault = record.first_fault or Fault("nominal")
        self._store.save_recording(
            run_id, lambda path: write_recording(path, pair, record.plan, fault, diagnosis)
        )

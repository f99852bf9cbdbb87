"""The recordings of all runs: streams while they are flown, files once they are stored.

A live recording is a growing ``.rrd`` over plain HTTP, which Rerun's viewer shows as it grows. The
run id in the address is what opens it, as it opens the run's page.
"""

import asyncio
import logging
import threading
import time
from collections.abc import AsyncIterator
from pathlib import Path

import numpy as np
from fastapi import FastAPI, Request, Response
from fastapi.responses import FileResponse, StreamingResponse

from app.scenes import rerun_viewer
from app.scenes.geometry import Poses
from app.scenes.recording import RunLog, write_recording
from app.scenes.rerun_viewer import ANY_ORIGIN
from core.diagnosis.diagnosis import Diagnosis
from core.errors import MirrorTwinError, NoSuchRunError
from core.fmea.fault import Fault
from core.jobs.events import Samples
from core.store.records import valid_run_id
from core.store.store import RunStore
from core.twin.plan import Plan

__all__ = ["Recording", "Recordings", "with_recording", "write_recording"]

logger = logging.getLogger(__name__)

_MEDIA_TYPE = "application/octet-stream"
_HEADERS = {**ANY_ORIGIN, "Cache-Control": "no-cache"}
_POLL_S = 0.15
_FLUSH_AFTER_S = 1.0
"""Longest wait of samples for more of them: a chunk costs the same whatever its size."""


class Recording:
    """One live run's recording. Methods may be called from any thread.

    Nothing is encoded before a first reader: most pages show the other 3D view. From then on
    `extend` takes some 10 ms.
    """

    def __init__(self, run_id: str, plan: Plan, fault: Fault) -> None:
        """Prepare to record."""
        self._lock = threading.Lock()
        self._run_id, self._plan, self._fault = run_id, plan, fault
        self._log: RunLog | None = None
        self._diagnosis: Diagnosis | None = None
        self._chunks: list[bytes] = []
        self._waiting: list[Samples] = []
        self._faulted: Poses | None = None
        self._mirror: Poses | None = None
        self._marked = fault.mode == "nominal"
        self._flushed_at = 0.0
        self._finished = False

    def extend(self, samples: Samples) -> None:
        """Record the next samples. What a second attempt flies again is recorded only once."""
        with self._lock:
            newest_s = self._waiting[-1].time_s[-1] if self._waiting else self._recorded_until_s
            if samples.time_s[-1] <= newest_s:
                return
            self._waiting.append(samples)
            if self._log is None:
                return
            span_s = float(samples.time_s[-1]) - self._recorded_until_s
            overdue = time.monotonic() - self._flushed_at > _FLUSH_AFTER_S
            if overdue or span_s >= max(10.0, self._plan.duration_s / 60.0):
                self._flush(self._log)

    def finish(self, diagnosis: Diagnosis | None) -> None:
        """Record the waiting samples and the verdict, and end the stream of its readers."""
        with self._lock:
            self._diagnosis = diagnosis
            if self._log is not None:
                self._conclude(self._log)
            self._finished = True

    async def stream(self) -> AsyncIterator[bytes]:
        """All bytes from the beginning, then the new ones as they come, until it is finished."""
        await asyncio.to_thread(self._begin)
        sent = 0
        while True:
            finished = self._finished  # before looking for chunks, so that none is missed
            for chunk in self._chunks[sent:]:
                sent += 1
                yield chunk
            if finished:
                return
            # Polling: a wake-up from other threads would save nobody anything at this rate.
            await asyncio.sleep(_POLL_S)

    @property
    def finished(self) -> bool:
        """Whether `finish` has been called."""
        return self._finished

    @property
    def _recorded_until_s(self) -> float:
        return -1.0 if self._mirror is None else float(self._mirror.time_s[-1])

    def _begin(self) -> None:
        """Encode for the first reader: the fixed parts, then the waiting samples."""
        with self._lock:
            if self._log is not None:
                return
            self._log = RunLog(self._run_id)
            self._log.begin(self._plan, self._plan.altitude_ft)
            self._log.describe(self._plan, self._fault, None)
            self._chunks.append(self._log.read())
            self._flush(self._log)
            if self._finished:
                self._conclude(self._log)

    def _conclude(self, log: RunLog) -> None:
        self._flush(log)
        if self._diagnosis is not None:
            log.describe(self._plan, self._fault, self._diagnosis)
            self._chunks.append(log.read())
        log.close()

    def _flush(self, log: RunLog) -> None:
        """Encode the waiting samples, one chunk per entity."""
        if not self._waiting:
            return
        batch, self._waiting = self._waiting, []
        time_s = np.concatenate([samples.time_s for samples in batch])
        # A second attempt flies the same samples again, in blocks of other lengths.
        before_s = np.concatenate([[self._recorded_until_s], time_s[:-1]])
        new = time_s > np.maximum.accumulate(before_s)
        time_s = time_s[new]
        faulted, mirror, faulted_states, mirror_states = (
            np.concatenate([getattr(samples, name) for samples in batch])[new]
            for name in ("faulted", "mirror", "faulted_states", "mirror_states")
        )
        new_faulted, new_mirror = Poses.of(time_s, faulted_states), Poses.of(time_s, mirror_states)
        if self._faulted is None or self._mirror is None:
            self._faulted, self._mirror = new_faulted, new_mirror
        else:
            self._faulted = self._faulted.joined(new_faulted)
            self._mirror = self._mirror.joined(new_mirror)
        log.channels(time_s, faulted, mirror)
        log.residuals(time_s, faulted, mirror)
        log.poses(new_faulted, new_mirror)
        log.paths(self._faulted, self._mirror, growing=True)
        if not self._marked and time_s[-1] >= self._fault.onset_s:
            log.onset(self._faulted.at(self._fault.onset_s))
            self._marked = True
        self._chunks.append(log.read())
        self._flushed_at = time.monotonic()


def with_recording(store: RunStore, run_id: str) -> bool:
    """Make the run's recording if it has none, as an imported run may.

    A damaged one is made again: it shows no more than the run's other files.
    Returns whether there is one now; raises `StoreError`.
    """
    if store.has_recording(run_id):
        return True
    record = store.get(run_id)
    if store.read_only_reason is not None or record.status != "done":
        return False
    diagnosis, _ = store.load_result(run_id)
    pair, fault = store.load_pair(run_id), record.first_fault or Fault("nominal")
    store.save_recording(
        run_id, lambda path: write_recording(path, pair, record.plan, fault, diagnosis)
    )
    return True


class Recordings:
    """The recordings of a run store: the live ones, and those in its files."""

    def __init__(self, store: RunStore) -> None:
        """Start with none live."""
        self._store = store
        self._live: dict[str, Recording] = {}

    def open(self, run_id: str) -> Recording:
        """Start the recording of a run, replacing an earlier one; raises `StoreError`.

        Recordings of earlier runs that failed or were cancelled are dropped here.
        """
        record = self._store.get(run_id)
        for name, recording in list(self._live.items()):
            if recording.finished:
                del self._live[name]
        self._live[run_id] = Recording(run_id, record.plan, record.fault)
        return self._live[run_id]

    def mount(self, app: FastAPI) -> None:
        """Add ``/recordings/{run_id}.rrd`` and the viewer's page. Before any catch-all route."""
        rerun_viewer.mount(app)

        @app.api_route("/recordings/{run_id}.rrd", methods=["GET", "HEAD"], include_in_schema=False)
        async def recording(run_id: str, request: Request) -> Response:
            live = self._live.get(run_id)
            path, problem = None, ""
            if live is None or live.finished:
                path, problem = await asyncio.to_thread(self._stored, run_id)
            if path is not None:
                return FileResponse(path, media_type=_MEDIA_TYPE, headers=_HEADERS)
            if live is None:
                return Response(problem, 404, ANY_ORIGIN, "text/plain")
            if request.method == "HEAD":
                return Response(media_type=_MEDIA_TYPE, headers=_HEADERS)
            return StreamingResponse(live.stream(), media_type=_MEDIA_TYPE, headers=_HEADERS)

    def _stored(self, run_id: str) -> tuple[Path | None, str]:
        """The run's file, made again if it was lost or damaged; else the reason."""
        try:
            if valid_run_id(run_id) and with_recording(self._store, run_id):
                return self._store.recording_path(run_id), ""
        except NoSuchRunError:
            pass
        except MirrorTwinError as error:
            logger.warning("no recording of run %s: %s", run_id, error)
            return None, f"No recording: {error}"
        return None, "No such recording."

"""Tasks of the cluster whose answer somebody waits for: no record, no events."""

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from distributed import CancelledError, Future, KilledWorker

from core.diagnosis.diagnosis import Diagnosis
from core.errors import WorkerError
from core.jobs.cluster import Cluster
from core.jobs.events import Failed
from core.jobs.worker import RunResult

LOOK_S = 1.0
"""How often what waits looks for a worker."""

WORKER_DIED = (
    "the worker flying this run died, and so did the next one that tried; the rest of the system "
    "is fine. Press Run again; if it happens again, is the machine out of memory?"
)
NO_WORKER = "no worker could be had for {:g} s ({}); press Run again"

_Answer = TypeVar("_Answer", RunResult, Diagnosis)


class Answers:
    """Has workers do something and waits for it, at most ``no_worker_s`` without any worker."""

    def __init__(self, cluster: Cluster, no_worker_s: float) -> None:
        """Answers by the workers of ``cluster``."""
        self._cluster = cluster
        self._no_worker_s = no_worker_s

    @property
    def no_worker(self) -> str:
        """That there was no worker, for how long and what to do."""
        return NO_WORKER.format(self._no_worker_s, self._cluster.no_worker_hint)

    def wait_for(
        self, task: Callable[..., _Answer | Failed], *inputs: Any, priority: int = 10
    ) -> _Answer:
        """The result of ``task`` on a worker; raises `WorkerError` saying why there is none."""
        client = self._cluster.client()
        future: Future[_Answer | Failed] = client.submit(
            task, *inputs, pure=False, priority=priority
        )
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        while not (done.wait(LOOK_S) or future.done()):
            if self._cluster.without_workers_s() > self._no_worker_s:
                cancel(future)
                raise WorkerError(self.no_worker)
        try:
            outcome = future.result()
        except (CancelledError, KilledWorker):
            raise WorkerError(WORKER_DIED) from None
        if isinstance(outcome, Failed):
            raise WorkerError(outcome.message)
        return outcome


def cancel(future: Future[Any]) -> None:
    """Cancel a task, unless its client has closed; what that held is seen to by the engine."""
    with suppress(RuntimeError):
        future.cancel()

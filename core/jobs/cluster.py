"""Dask `distributed`: workers on this machine, or behind a scheduler elsewhere; the same to us.

Dask itself is started in `core.workers.pool` and reached in `core.workers.remote`.
"""

import logging
import threading
import time
from concurrent.futures import Future as Promise

from distributed import Client

from core.errors import WorkerError
from core.jobs.worker import LocalWorkerSettings, WarmUp
from core.workers.pool import START_S, LocalPool
from core.workers.remote import remote_client
from core.workers.scheduler import RemoteScheduler

logger = logging.getLogger(__name__)

_STALE_S = 5.0
"""What was seen longer ago than this says nothing of the time since."""


class Cluster:
    """Workers to fly on.

    Without ``scheduler``: a `LocalPool` of ``n_workers``. With it: those of that Dask scheduler.
    """

    def __init__(self, scheduler: RemoteScheduler | None = None, n_workers: int = 2) -> None:
        """Start or connect; raises `WorkerError` if that takes over `CONNECT_TIMEOUT_S`.

        Workers go on loading what they need; a run that comes before waits for them.
        """
        self.scheduler = scheduler
        self._lock = threading.Lock()
        self._closed = False
        # A run whose worker died gets one more.
        self._local = (
            None if scheduler else LocalPool(n_workers, [LocalWorkerSettings()], allowed_failures=1)
        )
        self._n_workers = n_workers
        self._looked_s = self._last_worker_s = time.monotonic()
        self._client, self._warm = self._connected()

    def client(self) -> Client:
        """A connected client; raises `WorkerError`.

        A scheduler that went away is tried again, which may take `CONNECT_TIMEOUT_S`.
        """
        with self._lock:
            if self._closed:
                raise WorkerError("the server is stopping and takes no more runs")
            # One that is closing still takes runs, of which nobody would ever hear again.
            if self._client.status not in ("running", "connecting"):
                self._client, self._warm = self._connected()
            return self._client

    def wait_warm(self, timeout: float = 60.0) -> None:
        """Block until the workers have loaded what they need; raises `WorkerError`."""
        try:
            self._warm.result(timeout)
        except TimeoutError as error:
            raise WorkerError(f"the workers are not ready after {timeout:g} s") from error
        except Exception as error:
            raise WorkerError(f"the workers are not ready: {error}") from error

    def without_workers_s(self) -> float:
        """How long there has been no worker, as far as has been looked; 0 while there is one.

        To be asked every second or so while something waits. May take `CONNECT_TIMEOUT_S` where the
        scheduler is elsewhere.
        """
        count = self._count_workers()
        with self._lock:
            now_s = time.monotonic()
            if count or now_s - self._looked_s > _STALE_S:
                self._last_worker_s = now_s
            self._looked_s = now_s
            return now_s - self._last_worker_s

    @property
    def no_worker_hint(self) -> str:
        """What to do where there is no worker."""
        if self.scheduler is None:
            return "worker processes end as soon as they start; is the machine out of memory?"
        return f"the Dask scheduler at {self.scheduler.address} has none: start one there"

    def close(self) -> None:
        """Close the connection, and the workers where they are ours."""
        with self._lock:
            self._closed = True
        self._client.close()
        if self._local is not None:
            self._local.close()

    def _count_workers(self) -> int:
        if self._local is not None:
            return self._local.count()
        try:
            return len(self._client.nthreads())
        except Exception as error:  # the connection broke, of which the runs' futures tell
            logger.debug("the scheduler does not say who works for it: %s", error)
            return 1

    def _connected(self) -> tuple[Client, Promise[None]]:
        if self._local is not None:
            # Flights come ten times faster straight from the worker, where we can reach it.
            # It is there, in this very process, however long that takes on a busy machine.
            client = self._local.client(timeout=START_S, direct_to_workers=True)
        else:
            assert self.scheduler is not None
            client = remote_client(self.scheduler, direct_to_workers=False)
        return client, self._warm_up(client)

    def _warm_up(self, client: Client) -> Promise[None]:
        """Have all workers, present and future, load what they need, without waiting for it."""
        promise: Promise[None] = Promise()

        def register() -> None:
            try:
                while True:
                    if self._local is not None:
                        client.wait_for_workers(self._n_workers)
                    try:
                        client.register_plugin(WarmUp())
                        break
                    except OSError:
                        # A worker died as it loaded: wait for the one that takes its place. Or we,
                        # or the scheduler, went away.
                        if self._closed or client.status != "running":
                            raise
            except Exception as error:
                if not self._closed and not isinstance(error, OSError):
                    logger.warning("workers could not load MirrorTwin: %s", error)
                promise.set_exception(error)
            else:
                promise.set_result(None)

        threading.Thread(target=register, name="mirrortwin-warm-up", daemon=True).start()
        return promise

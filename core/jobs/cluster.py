"""Dask `distributed`: workers on this machine, or behind a scheduler elsewhere; the same to us.

The one place that starts, reaches and closes Dask, and that turns its failures into `WorkerError`.
"""

import asyncio
import logging
import os
import signal
import threading
from concurrent.futures import Future as Promise
from contextlib import suppress

import dask.config
from distributed import Client, LocalCluster
from distributed.comm.core import CommClosedError, connect
from distributed.utils import LoopRunner

from core.errors import WorkerError
from core.jobs.worker import HouseManners, WarmUp

logger = logging.getLogger(__name__)

CONNECT_TIMEOUT_S = 5.0

_LOCAL_SETTINGS = {
    # Dask keeps its latest messages for those who debug it. Ours carry samples: keep few.
    "distributed.admin.low-level-log-length": 50,
    "distributed.worker.profile.enabled": False,
    # A run whose worker died gets one more.
    "distributed.scheduler.allowed-failures": 1,
}


class Cluster:
    """Workers to fly on.

    Without ``scheduler``: ``n_workers`` processes of one thread each, with loopback ports only; a
    worker that dies is replaced. With it: those of the Dask scheduler at that address.
    """

    def __init__(self, scheduler: str | None = None, n_workers: int = 2) -> None:
        """Start or connect; raises `WorkerError` if that takes over `CONNECT_TIMEOUT_S`.

        Workers go on loading what they need; a run that comes before waits for them.
        """
        self.scheduler = scheduler
        self._lock = threading.Lock()
        self._closed = False
        self._local = None if scheduler else _local_cluster(n_workers)
        self._client, self._warm = self._connected()

    def client(self) -> Client:
        """A connected client; raises `WorkerError`.

        A scheduler that went away is tried again, which may take `CONNECT_TIMEOUT_S`.
        """
        with self._lock:
            if self._closed:
                raise WorkerError("the server is stopping and takes no more runs")
            if self._client.status == "closed":
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

    def close(self) -> None:
        """Close the connection, and the workers where they are ours."""
        with self._lock:
            self._closed = True
        self._client.close()
        if self._local is not None:
            # It speaks again once it is closed, of what was not sent to the workers any more.
            logging.getLogger("distributed").setLevel(logging.CRITICAL)
            _kill_workers(self._local)
            self._local.close()

    def _connected(self) -> tuple[Client, Promise[None]]:
        if self.scheduler is not None:
            _check_answers(self.scheduler)
        client = Client(
            self._local or self.scheduler,
            timeout=CONNECT_TIMEOUT_S,
            set_as_default=False,
            # Flights come ten times faster straight from the worker, where we can reach it.
            direct_to_workers=self._local is not None,
        )
        return client, _warm_up(client)


def _check_answers(address: str) -> None:
    """Raise `WorkerError` unless Dask answers at ``address``.

    Before a `Client` is made: one that something else than Dask answers cannot even be closed.
    """

    async def connect_once() -> None:
        # A timeout of our own: Dask waits for ever for a stranger's side of the handshake.
        async with asyncio.timeout(CONNECT_TIMEOUT_S):
            comm = await connect(address, timeout=CONNECT_TIMEOUT_S)
        comm.abort()

    try:
        LoopRunner().run_sync(connect_once)
    except Exception as error:  # whatever it is that a stranger's answer leads to
        raise WorkerError(
            f"no Dask scheduler answers at {address}: start one there by `dask scheduler`, correct "
            "the address (such as tcp://HOST:8786), or leave --scheduler out to fly on this machine"
        ) from error


def _is_worth_saying(record: logging.LogRecord) -> bool:
    """False of what asyncio says of a Dask message that a worker died over: the engine says it."""
    error = record.exc_info[1] if record.exc_info else None
    return not isinstance(error, CommClosedError)


def _local_cluster(n_workers: int) -> LocalCluster:
    logging.getLogger("asyncio").addFilter(_is_worth_saying)
    with dask.config.set(_LOCAL_SETTINGS):
        return LocalCluster(
            n_workers=n_workers,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",  # None would mean port 8787
            plugins=[HouseManners()],
            silence_logs=logging.CRITICAL,  # what matters to a run, the engine says
        )


def _kill_workers(cluster: LocalCluster) -> None:
    """End the worker processes now: asked, one that still loads torch would answer seconds later.

    They have nothing to lose.
    """
    for nanny in cluster.workers.values():
        if nanny.pid is not None:
            with suppress(ProcessLookupError):
                os.kill(nanny.pid, signal.SIGKILL)


def _warm_up(client: Client) -> Promise[None]:
    """Have all workers, present and future, load what they need, without waiting for it."""
    promise: Promise[None] = Promise()

    def register() -> None:
        try:
            client.register_plugin(WarmUp())
        except Exception as error:
            # A broken connection is a worker that died, whose successor loads anew, or our closing.
            if not isinstance(error, OSError):
                logger.warning("workers could not load MirrorTwin: %s", error)
            promise.set_exception(error)
        else:
            promise.set_result(None)

    threading.Thread(target=register, name="mirrortwin-warm-up", daemon=True).start()
    return promise

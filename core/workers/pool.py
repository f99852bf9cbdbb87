"""Worker processes of our own, on this machine, which nobody but this process can reach.

Those who can talk to Dask run code in it, and any user of a machine can connect to its loopback
ports. So scheduler, nannies and workers speak TLS, with a key made for this one pool that stands in
no file, command line or environment; Dask's status pages are shut; and the folder that Dask looks
for modules in is one that nobody else can write to.
"""

import logging
import os
import signal
import stat
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import dask.config
from distributed import Client, LocalCluster, Security, SpecCluster, Worker, WorkerPlugin
from distributed.comm.core import CommClosedError
from distributed.core import Status
from tornado.ioloop import PeriodicCallback

from core.errors import WorkerError

logger = logging.getLogger(__name__)

REFILL_S = 1.0
"""How often the pool looks whether a worker is missing."""

START_S = 60.0
"""How long to wait for workers; a slow machine takes half of it to start one."""

LONGEST_PAUSE_S = 30.0
"""Between two attempts to start workers that do not start."""

_SETTINGS = {
    # Dask keeps its latest messages for those who debug it. Ours carry samples: keep few.
    "distributed.admin.low-level-log-length": 50,
    "distributed.worker.profile.enabled": False,
    # Dask's own watches, 20 ms to 500 ms apart, are what an idle server burns: seconds do.
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.tick.limit": "30s",
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.worker.memory.monitor-interval": "1s",
    # Status pages, which tell anyone who asks.
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
}


class LocalPool(LocalCluster):
    """``n_workers`` processes of one thread each, in no hurry: it does not wait for them to start.

    One that dies is replaced, whenever that happens.
    """

    def __init__(
        self, n_workers: int, plugins: Iterable[WorkerPlugin] = (), allowed_failures: int = 3
    ) -> None:
        """Have the workers start; ``plugins`` are set up in each before it takes any work.

        A task is given up when more than ``allowed_failures`` workers died while they had it.
        """
        logging.getLogger("asyncio").addFilter(_is_worth_saying)
        self._wanted = n_workers
        self._failures = 0
        self._pause_until_s = 0.0
        scratch = _scratch_folder()
        # For as long as this process lives: nannies read them too, and start whenever one is lost.
        dask.config.set(_SETTINGS)
        with dask.config.set({"temporary-directory": scratch}):
            super().__init__(
                n_workers=0,
                threads_per_worker=1,
                memory_limit=1.0 / n_workers,
                processes=True,
                host="127.0.0.1",
                security=Security.temporary(),
                dashboard_address="127.0.0.1:0",  # None would mean port 8787
                scheduler_kwargs={"dashboard": False, "allowed_failures": allowed_failures},
                local_directory=scratch,
                plugins=[_NoStatusPage(), *plugins],
                config=_SETTINGS,  # of the workers, which are processes of their own
                silence_logs=logging.CRITICAL,  # what matters to a run, the engine says
            )
        self._scheduler.loop.add_callback(self._keep_full)

    def _update_worker_status(self, op: str, msg: Any) -> None:
        # Not SpecCluster's, which closes the nanny of a worker that is not there 15 s after one
        # died, be it that it takes so long to start or that it, too, has just been killed. Nobody
        # would open another, and a pool whose last nanny goes so stays empty.
        super(SpecCluster, self)._update_worker_status(op, msg)

    async def _keep_full(self) -> None:
        self._scheduler.http_server.stop()
        refill = PeriodicCallback(self._refill, REFILL_S * 1000.0)
        self.periodic_callbacks["refill"] = refill  # is stopped when the pool closes
        refill.start()
        await self._refill()

    async def _refill(self) -> None:
        """Start what is missing of the workers; a nanny that still lives sees to its own."""
        if self.status != Status.running or time.monotonic() < self._pause_until_s:
            return
        for name, nanny in list(self.workers.items()):
            if nanny.status in (Status.closed, Status.failed):
                del self.workers[name]
        while len(self.worker_spec) < self._wanted:
            self.worker_spec.update(self.new_worker_spec())
        if not self.worker_spec.keys() - self.workers.keys():
            self._failures = 0
            return
        try:
            await self._correct_state()
        except Exception as error:  # whatever kept a process from starting: try again
            self._failures += 1
            pause_s = min(REFILL_S * 2.0**self._failures, LONGEST_PAUSE_S)
            self._pause_until_s = time.monotonic() + pause_s
            logger.info("a worker did not start: %s", error)

    async def _close(self) -> None:
        # Dask speaks once more when it is closed, of what was not sent to the workers any more.
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        # Asked, a worker that still loads torch would answer seconds later, and one that is just
        # being started would have to be up first. They have nothing to lose.
        kill = PeriodicCallback(self._kill_workers, 50.0)
        kill.start()
        self._kill_workers()
        try:
            await super()._close()
        finally:
            kill.stop()

    def _kill_workers(self) -> None:
        for nanny in list(self._created):
            if nanny.pid is not None:
                with suppress(ProcessLookupError):
                    os.kill(nanny.pid, signal.SIGKILL)

    def client(self, **options: Any) -> Client:
        """A client of it; one given the pool itself would wait for the workers, and fail as one."""
        return Client(
            self.scheduler_address,
            loop=self.loop,
            security=self.security,
            set_as_default=False,
            **options,
        )

    def count(self) -> int:
        """How many workers there are, those that still load what they need included."""
        return len(self._scheduler.workers)

    @property
    def _scheduler(self) -> Any:
        assert self.scheduler is not None  # from its first moment to its last
        return self.scheduler


@contextmanager
def pool_client(n_workers: int) -> Iterator[Client]:
    """A client of a pool that lives as long as this; raises `WorkerError` if none comes up."""
    with LocalPool(n_workers) as pool, pool.client() as client:
        await_workers(client, n_workers, "on this machine")
        yield client


def await_workers(client: Client, n_workers: int, where: str) -> None:
    """Wait until so many are there; raises `WorkerError` that none is ``where`` it should be."""
    try:
        client.wait_for_workers(n_workers, timeout=START_S)
    except TimeoutError:
        raise WorkerError(f"no worker {where} within {START_S:g} s") from None


class _NoStatusPage(WorkerPlugin):
    """Shuts the port of a worker's status page, which Dask always opens."""

    name = "mirrortwin-no-status-page"

    def setup(self, worker: Worker) -> None:
        """Called by Dask before the worker takes any work."""
        worker.http_server.stop()


def _is_worth_saying(record: logging.LogRecord) -> bool:
    """False of what asyncio says of a Dask message that a worker died over: the engine says it."""
    error = record.exc_info[1] if record.exc_info else None
    return not isinstance(error, CommClosedError)


def _scratch_folder() -> str:
    """A folder for Dask's own files that only this user can write to.

    Dask puts it before all others that Python looks for modules in, in this process too. Its own
    choice, ``/tmp/dask-scratch-space``, may be somebody else's. Always the same where it can be:
    Dask clears what killed processes have left there.
    """
    folder = Path(tempfile.gettempdir()) / f"mirrortwin-{os.getuid()}"
    with suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if (
            stat.S_ISDIR(found.st_mode)
            and found.st_uid == os.getuid()
            and not found.st_mode & 0o077
        ):
            return str(folder)
    return tempfile.mkdtemp(prefix="mirrortwin-")

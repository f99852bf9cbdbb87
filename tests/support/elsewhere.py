"""A Dask scheduler elsewhere, and an engine on it."""

import os
import subprocess
import sys
import time
from pathlib import Path

from jobs_support import PATIENCE_S

from core.errors import WorkerError
from core.jobs.engine import Engine
from core.store.store import RunStore
from core.workers.scheduler import RemoteScheduler

DASK = str(Path(sys.executable).with_name("dask"))


class Elsewhere:
    """A Dask scheduler and its workers, started by the commands of the README."""

    def __init__(self, port: int) -> None:
        self.address = f"tcp://127.0.0.1:{port}"
        self._environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
        self._started: list[subprocess.Popen[bytes]] = []

    def start_scheduler(self) -> "subprocess.Popen[bytes]":
        port = self.address.rsplit(":", 1)[1]
        listen = ["--host", "127.0.0.1", "--port", port]
        return self._start("scheduler", *listen, "--dashboard-address", "127.0.0.1:0")

    def start_worker(self) -> "subprocess.Popen[bytes]":
        listen = ["--host", "127.0.0.1", "--no-dashboard"]
        return self._start("worker", self.address, "--nthreads", "1", *listen)

    def _start(self, *arguments: str) -> "subprocess.Popen[bytes]":
        process = subprocess.Popen(
            [DASK, *arguments], env=self._environment, stderr=subprocess.DEVNULL
        )
        self._started.append(process)
        return process

    def stop(self) -> None:
        for process in reversed(self._started):
            process.terminate()
        for process in self._started:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()


def connected(store: RunStore, address: str, no_worker_s: float = PATIENCE_S) -> Engine:
    """An engine on that scheduler, once it answers."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        try:
            return Engine(store, RemoteScheduler(address), no_worker_s=no_worker_s)
        except WorkerError:
            if time.monotonic() > deadline:
                raise

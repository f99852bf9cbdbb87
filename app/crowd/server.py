"""A server as a user starts it, in a process of its own, and the memory that it takes."""

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import psutil

from core.errors import WorkerError

START_S = 120.0
STOP_S = 15.0
_MB = 1 << 20


@dataclass(frozen=True, slots=True)
class Served:
    """A running ``mirrortwin serve`` and the folder of its runs."""

    process: psutil.Process
    url: str
    store: Path

    @property
    def server_mb(self) -> float:
        """Memory of the server itself, resident, in MB."""
        return float(self.process.memory_info().rss) / _MB

    @property
    def workers_mb(self) -> float:
        """Memory of its workers together, resident, in MB."""
        family = self.process.children(recursive=True)
        return sum(float(each.memory_info().rss) for each in family) / _MB

    @property
    def connections(self) -> int:
        """How many connections its port has."""
        port = int(self.url.rsplit(":", 1)[1])
        return sum(
            each.status == psutil.CONN_ESTABLISHED and each.laddr.port == port
            for each in self.process.net_connections("tcp4")
        )


@contextmanager
def served(folder: Path) -> Iterator[Served]:
    """Start a server whose runs go to ``folder``, and stop it; raises `WorkerError`."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-c", "import sys; from app.cli import main; sys.exit(main())"]
    command += ["serve", "--port", str(port), "--store", str(folder / "store")]
    with (folder / "server.log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
    server = Served(psutil.Process(process.pid), f"http://127.0.0.1:{port}", folder / "store")
    try:
        _wait_until_up(process, server.url)
        yield server
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            process.kill()


def _wait_until_up(process: "subprocess.Popen[bytes]", url: str) -> None:
    deadline_s = time.monotonic() + START_S
    while time.monotonic() < deadline_s:
        if process.poll() is not None:
            raise WorkerError("the server to be measured does not start; try `mirrortwin serve`")
        try:
            httpx.get(url, timeout=5.0)
            return
        except httpx.HTTPError:
            time.sleep(0.2)
    raise WorkerError(f"the server to be measured is not up after {START_S:g} s")

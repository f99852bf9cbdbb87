"""Schedulers elsewhere: only with TLS, unless they are on this machine or somebody insists."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from distributed import Security
from jobs_support import CRACK, SHORT_PLAN

from core.errors import InputError, WorkerError
from core.jobs.engine import Engine
from core.store.store import RunStore
from core.workers.scheduler import RemoteScheduler

DASK = str(Path(sys.executable).with_name("dask"))


@pytest.mark.parametrize(
    "address",
    ["tcp://10.0.0.5:8786", "10.0.0.5:8786", "ws://twin.example:80", "tcp://localhost.evil:1",
     "tcp://127.0.0.1.evil.example:1", "tcp://0.0.0.0:8786", "tcp://[2001:db8::1]:8786", "", "x:y"],
)  # fmt: skip
def test_beyond_this_machine_it_takes_tls_or_insisting(address: str) -> None:
    with pytest.raises(InputError, match="--insecure-scheduler") as caught:
        RemoteScheduler(address)
    assert "tls://" in str(caught.value)
    insisted = RemoteScheduler(address, is_insecure=True).warning
    assert insisted is not None and "anyone" in insisted


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.8.8", "localhost", "[::1]"])
def test_on_this_machine_it_is_taken_and_said(host: str) -> None:
    warning = RemoteScheduler(f"tcp://{host}:8786").warning
    assert warning is not None and "every user of this machine can run code" in warning
    assert RemoteScheduler(f"{host}:8786").warning


@pytest.fixture(scope="module")
def pem(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ``own.pem`` and ``other.pem``: certificates and keys of two CAs."""
    folder = tmp_path_factory.mktemp("pem")
    for name in ("own", "other"):
        made = Security.temporary().get_tls_config_for_role("client")
        (folder / f"{name}.pem").write_text(made["cert"] + made["key"])
    return folder


def test_tls_takes_certificates_that_can_be_used(pem: Path) -> None:
    own = pem / "own.pem"
    address = "tls://10.0.0.5:8786"
    assert RemoteScheduler(address, own, own).warning is None
    assert RemoteScheduler(address, own, own, own).security().require_encryption
    for given in ((), (own,), (None, own)):
        with pytest.raises(InputError, match="--tls-ca"):
            RemoteScheduler(address, *given)
    (pem / "empty.pem").write_text("")
    for ca, cert in ((own, pem / "none.pem"), (pem / "empty.pem", own), (own, pem / "empty.pem")):
        with pytest.raises(InputError, match="cannot be used"):
            RemoteScheduler(address, ca, cert)
    with pytest.raises(InputError, match="did you mean tls://"):
        RemoteScheduler("tcp://127.0.0.1:8786", own, own)


@pytest.fixture
def guarded(pem: Path, free_port: int) -> Iterator[str]:
    """A scheduler and a worker with TLS, started by Dask's own commands."""
    address = f"tls://127.0.0.1:{free_port}"
    own = str(pem / "own.pem")
    files = ["--tls-ca-file", own, "--tls-cert", own, "--tls-key", own]
    here = ["--host", "127.0.0.1"]
    page = ["--dashboard-address", "127.0.0.1:0"]
    commands = [
        [DASK, "scheduler", *here, *page, "--port", str(free_port), "--protocol", "tls", *files],
        [DASK, "worker", address, *here, *page, "--nthreads", "1", *files],
    ]
    started = [subprocess.Popen(command, stderr=subprocess.DEVNULL) for command in commands]
    yield address
    for process in reversed(started):
        process.terminate()
        process.wait(30)


@pytest.mark.slow
def test_a_guarded_scheduler_flies_for_those_of_its_ca_and_no_others(
    guarded: str, pem: Path, store: RunStore
) -> None:
    own, other = (
        RemoteScheduler(guarded, pem / f"{n}.pem", pem / f"{n}.pem") for n in ("own", "other")
    )
    engine = None
    while engine is None:
        try:
            engine = Engine(store, own, no_worker_s=120.0)
        except WorkerError:
            continue
    try:
        assert engine.wait(engine.submit(SHORT_PLAN, CRACK), timeout=240).status == "done"
        with pytest.raises(WorkerError, match="of one CA"):
            Engine(store, other)
        with pytest.raises(WorkerError, match="no Dask scheduler answers"):
            Engine(store, RemoteScheduler(guarded.replace("tls", "tcp")))
    finally:
        engine.close()

"""Dask on this machine answers its own server and workers, and nobody else."""

import os
import stat
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from distributed import LocalCluster

from core.jobs.engine import Engine
from core.workers.pool import LocalPool, _scratch_folder

INTRUDER = Path(__file__).with_name("intruder.py")
NOBODY = 65534


def ports_of(family: list[psutil.Process]) -> set[int]:
    """What these processes listen on."""
    return {
        connection.laddr.port
        for process in family
        for connection in process.net_connections("inet")
        if connection.status == psutil.CONN_LISTEN
    }


def break_in(ports: set[int], uid: int) -> list[str]:
    """What the intruder got out of them, and last what it tried."""
    command = [sys.executable, str(INTRUDER), str(uid), *map(str, sorted(ports))]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout.splitlines()


@pytest.fixture(params=["self", "nobody"])
def uid(request: pytest.FixtureRequest) -> int:
    """Of the intruder: ours, who has no certificate, or that of another user."""
    if request.param == "nobody" and os.getuid() != 0:
        pytest.skip("only root can try as another user")
    return os.getuid() if request.param == "self" else NOBODY


def test_nobody_runs_anything_in_scheduler_nannies_and_workers(engine: Engine, uid: int) -> None:
    ports = ports_of([psutil.Process(), *psutil.Process().children(recursive=True)])
    assert len(ports) >= 5  # the scheduler, two nannies and two workers
    answers = break_in(ports, uid)
    assert len(answers) == 1, answers
    assert answers[0] == f"{7 * len(ports)} tries at {len(ports)} ports as user {uid}"


@pytest.mark.slow
def test_the_intruder_gets_into_a_dask_without_tls(uid: int) -> None:
    before = ports_of([psutil.Process(), *psutil.Process().children(recursive=True)])
    with LocalCluster(n_workers=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"):
        family = [psutil.Process(), *psutil.Process().children(recursive=True)]
        answers = break_in(ports_of(family) - before, uid)
    in_processes = {line.split()[1] for line in answers if str(os.getpid()) in line}
    assert in_processes, answers  # scheduler and nanny are in this very process
    assert any(line.startswith("PAGE") for line in answers), answers


def test_no_secret_stands_where_others_can_read_it(engine: Engine) -> None:
    security = engine._cluster._local.security
    secret = security.tls_client_key.splitlines()[1]
    for process in psutil.Process().children(recursive=True):
        assert secret not in " ".join(process.cmdline())
        assert secret not in str(process.environ())


@pytest.fixture
def planted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A temporary folder in which somebody has already made those that we might use."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    for name in ("dask-scratch-space", f"mirrortwin-{os.getuid()}"):
        (tmp_path / name).mkdir()
        (tmp_path / name).chmod(0o777)
    yield tmp_path
    monkeypatch.undo()


def search_path() -> list[str]:
    return list(sys.path)


def test_no_module_comes_from_a_folder_that_others_can_write_to(planted: Path) -> None:
    before = set(sys.path)
    with LocalPool(1) as pool, pool.client() as client:
        client.wait_for_workers(1)
        places = {*client.submit(search_path).result(), *sys.path} - before
    assert places
    for place in places:
        first = planted / Path(place).relative_to(planted).parts[0]
        # The pool has removed what was its own; what is left there must be shut to others.
        assert not first.exists() or stat.S_IMODE(first.stat().st_mode) == 0o700, place


def test_the_scratch_folder_is_the_same_each_time_if_it_is_ours(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    first = _scratch_folder()
    assert _scratch_folder() == first
    assert stat.S_IMODE(Path(first).stat().st_mode) == 0o700
    Path(first).rmdir()
    Path(first).symlink_to(tmp_path)
    assert _scratch_folder() != first

"""Real parts for the job tests: flights of JSBSim, stores on disks of our own, a Dask cluster."""

import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from jobs_support import CRACK, SHORT_PLAN

from core.jobs.engine import Engine
from core.jobs.store import RunStore
from core.twin.flight import fly_pair
from core.twin.trajectory import Pair


@pytest.fixture(scope="session")
def short_pair() -> Pair:
    """What `SHORT_PLAN` with `CRACK` looks like, flown in this process."""
    return fly_pair(SHORT_PLAN, CRACK)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[RunStore]:
    """An empty store."""
    opened = RunStore(tmp_path / "store")
    yield opened
    opened.close()


@pytest.fixture(scope="session")
def engine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Engine]:
    """An engine with two worker processes, for all tests that leave it alive."""
    started = Engine(RunStore(tmp_path_factory.mktemp("engine")), n_workers=2)
    started.wait_warm(timeout=240)
    yield started
    started.close()


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """``disk("size=1m")``: a small disk of its own, mounted with those options; again: remounted.

    Skips where the system does not let this user mount.
    """
    where = tmp_path / "disk"
    where.mkdir()

    def mount(options: str) -> Path:
        if os.path.ismount(where):
            options = f"remount,{options}"
        command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(where)]
        try:
            subprocess.run(command, check=True, capture_output=True)
        except (OSError, subprocess.CalledProcessError):
            pytest.skip("this user may not mount a disk")
        return where

    yield mount
    if os.path.ismount(where):
        subprocess.run(["umount", "--lazy", str(where)], check=True)

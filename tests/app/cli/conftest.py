"""The command as a user runs it: its own process, in a folder of its own."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="session")
def command() -> str:
    """Where the installed command lies."""
    return str(Path(sys.executable).with_name("mirrortwin"))


@pytest.fixture
def mirrortwin(command: str, tmp_path: Path) -> Run:
    """``mirrortwin("faults", "--json")``: run it in ``tmp_path``, OUT standing for a new folder."""

    def run(*arguments: str) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            [command, *(word.replace("OUT", str(tmp_path / "out")) for word in arguments)],
            cwd=tmp_path, capture_output=True, text=True, timeout=580, check=False,
        )  # fmt: skip

    return run

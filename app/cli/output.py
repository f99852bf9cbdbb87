"""Output of the command line: JSON for programs, tables and progress for people."""

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console

from core.errors import InputError

_SILENT_S = 2.0
_PLAIN_WIDTH = 120


def print_json(value: Any) -> None:
    """Print ``value`` to stdout as JSON that every reader accepts (no NaN)."""
    print(json.dumps(value, indent=2, allow_nan=False))


def stdout() -> Console:
    """A console on stdout: colours and width of the terminal; plain wide lines elsewhere."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else _PLAIN_WIDTH)


def note(message: str) -> None:
    """Print one line that is not the result, on stderr."""
    print(message, file=sys.stderr, flush=True)


@contextmanager
def progress(label: str) -> Iterator[Callable[[float], None]]:
    """Show the progress of long work, on stderr; yields a function that takes 0-1.

    A bar with the time left on a terminal; elsewhere a plain line at every tenth once the work has
    lasted a while, so that a log stays readable.
    """
    if not sys.stderr.isatty():
        yield _tenths(label)
        return
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(),
        TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(label, total=1.0)
        yield lambda fraction: bar.update(task, completed=fraction)


def _tenths(label: str) -> Callable[[float], None]:
    shown, began = 0, time.monotonic()

    def show(fraction: float) -> None:
        nonlocal shown
        tenth = int(fraction * 10 + 1e-9)
        if tenth > shown and time.monotonic() - began > _SILENT_S:
            shown = tenth
            note(f"{label}: {tenth * 10} %")

    return show


def writable_folder(path: Path) -> Path:
    """``path`` as a writable folder, created where it is missing.

    Raises `InputError` naming ``--out`` otherwise: before the work, not after it.
    """
    probe = path / ".mirrortwin-write-test"
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise InputError("out", f"cannot write to {path}: {error.strerror}") from None
    return path

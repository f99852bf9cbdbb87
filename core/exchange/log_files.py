"""Files of flight logs in whatever format: the list of formats, and reading a file or a folder."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from core.errors import InputError
from core.exchange.g1000_reader import read_g1000
from core.exchange.log import Log
from core.paths import ROOT

LOGS = ROOT.parent / "shared" / "logs"
"""The default folder of logs."""

MOST_BYTES = 200 << 20
"""Some fifty times the log of a long day; whatever else lies in the folder is not taken in."""


class Format(NamedTuple):
    """A format of log files: whether the bytes of a file are one, and how they are read.

    ``read`` gets the file's name and its bytes, and raises `InputError`.
    """

    name: str
    recognises: Callable[[bytes], bool]
    read: Callable[[str, bytes], Log]


FORMATS: tuple[Format, ...] = (Format("G1000", lambda data: True, read_g1000),)
"""The formats in the order of trying; the last takes any file, and says what it lacks."""


def read_log(path: Path) -> Log:
    """Read one log; raises `InputError` naming the file, and the column where one is to blame."""
    try:
        if path.exists() and not path.is_file():
            raise InputError("logs", f"{path.name}: is not a file")
        if path.stat().st_size > MOST_BYTES:
            raise InputError("logs", f"{path.name}: is larger than {MOST_BYTES >> 20} MB")
        data = path.read_bytes()
    except OSError as error:
        raise InputError("logs", f"cannot read {path}: {error.strerror}") from None
    try:
        return next(form for form in FORMATS if form.recognises(data)).read(path.name, data)
    except InputError as error:
        raise InputError("logs", f"{path.name}: {error.problem}") from None


def read_logs(folder: Path) -> tuple[list[Log], dict[str, str]]:
    """Every log in the folder by name, and why each of its other files is none.

    What a file is called does not matter. Raises `InputError` where there is no such folder or
    nothing in it can be used.
    """
    if not folder.is_dir():
        what = f"{folder} is a file, not a folder" if folder.exists() else f"no folder {folder}"
        raise InputError("logs", f"{what}; give the folder of G1000 CSV files with --logs")
    logs: list[Log] = []
    refused: dict[str, str] = {}
    for path in sorted(folder.iterdir()):
        if path.is_dir():
            refused[path.name] = f"{path.name}: is a folder; what lies in it is not read"
            continue
        try:
            logs.append(read_log(path))
        except InputError as error:
            refused[path.name] = error.problem
    if not logs:
        why = "; ".join(refused.values()) or "it holds no files"
        raise InputError("logs", f"nothing to read in {folder}: {why}")
    return logs, refused

"""Real flight logs: CSV files of the Garmin G1000 and exports of them, as channels once a second.

A G1000 log opens with ``#airframe_info`` and a line of units before its line of padded names; an
NGAFID export has one line of names, in an order of its own. What is common to both is a line that
names the channels, so that line is looked for and everything above it is left alone.
"""

from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from core.channels import CHANNEL_INDEX, CHANNEL_NAMES
from core.errors import InputError
from core.paths import ROOT

Array = NDArray[np.float64]

LOGS = ROOT.parent / "shared" / "logs"
"""Where logs are looked for unless told otherwise."""

REQUIRED: tuple[str, ...] = ("IAS", "VSpd", "E1 RPM")
"""Without these nobody can tell cruise from anything else; any other channel may be missing."""

_HEADER_LINES = 20
_LEAST_NAMES = 5
_DATE, _TIME = "lcl date", "lcl time"
_CLOCK_SET_S = 60.0


@dataclass(frozen=True, slots=True, eq=False)
class Log:
    """A flight as a log keeps it, about once a second; ours are kept in the same way.

    ``time_s``: (n,) seconds from its first row, rising. ``channels``: (n, 23) in
    `core.channels.CHANNELS` order and units, NaN where the log says nothing.
    """

    name: str
    time_s: Array
    channels: Array

    def __len__(self) -> int:
        """Number of rows, about one a second."""
        return len(self.time_s)

    def channel(self, name: str) -> Array:
        """One channel by its Garmin name, (n,)."""
        column: Array = self.channels[:, CHANNEL_INDEX[name]]
        return column

    @property
    def missing(self) -> tuple[str, ...]:
        """Channels that this log has no value of."""
        return tuple(name for name in CHANNEL_NAMES if np.isnan(self.channel(name)).all())


def read_log(path: Path) -> Log:
    """Read one log; raises `InputError` naming the file, and the column where one is to blame."""
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise InputError("logs", f"cannot read {path}: {error.strerror}") from None
    lines = text.splitlines()
    header = _header(lines)
    if header is None:
        raise InputError("logs", f"{path.name} has no line with the names of G1000 columns")
    table = _table(lines, header)
    channels = np.column_stack([_numbers(table, name) for name in CHANNEL_NAMES])
    for name in REQUIRED:
        if _plain(name) not in table:
            raise InputError("logs", f"{path.name} has no column {name!r}")
        if np.isnan(channels[:, CHANNEL_INDEX[name]]).all():
            raise InputError("logs", f"{path.name}: column {name!r} holds no numbers")
    time_s, kept = _seconds(table)
    return Log(path.name, time_s, channels[kept])


def read_logs(folder: Path) -> tuple[list[Log], dict[str, str]]:
    """Every log in the folder by name, and why each CSV file that is none was left out.

    Raises `InputError` where there is no such folder or nothing in it can be used.
    """
    if not folder.is_dir():
        raise InputError(
            "logs", f"no folder {folder}; give the folder of G1000 CSV files with --logs"
        )
    logs: list[Log] = []
    refused: dict[str, str] = {}
    for path in sorted(path for path in folder.iterdir() if path.suffix.lower() == ".csv"):
        try:
            logs.append(read_log(path))
        except InputError as error:
            refused[path.name] = error.problem
    if not logs:
        why = "; ".join(refused.values()) or "it holds no CSV file"
        raise InputError("logs", f"nothing to read in {folder}: {why}")
    return logs, refused


def _plain(name: str) -> str:
    """A column's name without what differs between exports: padding, case, a comment mark.

    >>> _plain("# E1  CHT1 ")
    'e1 cht1'
    """
    return " ".join(name.strip().lstrip("#").split()).lower()


_WANTED = {_plain(name) for name in CHANNEL_NAMES}


def _names(line: str) -> list[str]:
    return [_plain(name) for name in line.split(",")]


def _header(lines: list[str]) -> int | None:
    """The last of the first lines that names channels: an export repeats them in a comment."""
    naming = [
        number
        for number, line in enumerate(lines[:_HEADER_LINES])
        if len(_WANTED & set(_names(line))) >= _LEAST_NAMES
    ]
    return naming[-1] if naming else None


def _table(lines: list[str], header: int) -> pd.DataFrame:
    """The rows below the header, all text; a last row cut short by the power going is dropped."""
    names = _names(lines[header])
    unique = [name if name not in names[:at] else f"{name} ({at})" for at, name in enumerate(names)]
    return pd.read_csv(
        StringIO("\n".join(lines[header + 1 :])),
        names=unique, index_col=False, dtype=str, skipinitialspace=True, on_bad_lines="skip",
        skip_blank_lines=True, quoting=3,
    )  # fmt: skip


def _numbers(table: pd.DataFrame, name: str) -> Array:
    """One column as numbers, NaN where a cell is blank or no number."""
    if _plain(name) not in table:
        return np.full(len(table), np.nan)
    values = pd.to_numeric(table[_plain(name)], errors="coerce").to_numpy(dtype=np.float64)
    return np.where(np.isfinite(values), values, np.nan)


def _seconds(table: pd.DataFrame) -> tuple[Array, NDArray[np.intp]]:
    """Times (n,) and the rows they belong to: the first of each second, backward steps left out.

    A log without a clock is taken to have a row a second.
    """
    if not {_DATE, _TIME} <= set(table.columns):
        return np.arange(len(table), dtype=np.float64), np.arange(len(table))
    clock = pd.to_datetime(
        table[_DATE].str.strip() + " " + table[_TIME].str.strip(), errors="coerce", format="ISO8601"
    )
    steps = clock.diff().dt.total_seconds().to_numpy(dtype=np.float64)
    # No clock before the first fix, and one that steps back when it is set: a second, and a gap.
    steps = np.where(np.isnan(steps), 1.0, np.where(steps < 0.0, _CLOCK_SET_S, steps))
    kept = np.flatnonzero(steps > 0.0)
    time_s: Array = np.cumsum(steps, dtype=np.float64)[kept] - 1.0
    return time_s, kept

"""Real flight logs: CSV files of the Garmin G1000 and exports of them, as channels once a second.

A G1000 log opens with ``#airframe_info`` and a line of units before its line of padded names; an
NGAFID export has one line of names, in an order of its own. What is common to both is a line that
names the channels, so that line is looked for. Nothing is guessed: a unit or a date that may mean
two things is refused, and what was converted, left out or doubted is kept beside the data
(`Reading`).
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from core.arrays import Array
from core.channels import CHANNEL_INDEX, CHANNEL_NAMES, CHANNELS, Channel
from core.errors import InputError
from core.exchange.g1000_writer import SIMULATED_MODE, UNIT_PART
from core.exchange.log_clock import clock_s, place, read_days, read_offsets, read_times
from core.exchange.log_table import (
    DATE,
    TIME,
    UTC_OFFSET,
    Dropped,
    Table,
    is_blank,
    is_number,
    plain,
    split_table,
)
from core.exchange.log_units import Scale, scale_of, understood
from core.paths import ROOT

LOGS = ROOT.parent / "shared" / "logs"
"""The default folder of logs."""

REQUIRED: tuple[str, ...] = ("IAS", "VSpd", "E1 RPM")
"""Without these nobody can tell cruise from anything else; any other channel may be missing."""

MOST_BYTES = 200 << 20
"""Some fifty times the log of a long day; whatever else lies in the folder is not taken in."""

_CESSNA_172 = re.compile(r"(?<![\w])(cessna\s*|c-?)?172(?!rg)[a-z]{0,2}(?!\w)", re.IGNORECASE)
_OTHER_ENGINE = re.compile(r"e2 .+|e1 (map|[ce][hg]t[5-9]|torq|ng|np|itt|tit\d?|coolt|geart)")
_G_LEVEL_WITHIN = 0.3
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")


@dataclass(frozen=True, slots=True)
class Conversion:
    """A column that was converted."""

    column: str
    from_unit: str
    to_unit: str


@dataclass(frozen=True, slots=True)
class Reading:
    """What was read of a log, beside its data.

    ``aircraft`` and ``device`` as its head names them. ``simulated``: a flight that our export or
    another simulator wrote. ``not_a_172``: what shows that the aircraft is none, where something
    does. ``doubts`` are sentences without their subject, the file.
    """

    rows: int = 0
    aircraft: str | None = None
    device: str | None = None
    simulated: bool = False
    not_a_172: str | None = None
    converted: tuple[Conversion, ...] = ()
    dropped: tuple[Dropped, ...] = ()
    doubts: tuple[str, ...] = ()

    def sentences(self) -> list[str]:
        """All of it for a person, a line each."""
        what = self.aircraft or (f"an aircraft with a {self.device}" if self.device else "unnamed")
        lines = [f"{self.rows} rows, aircraft: {what}"]
        lines += [f"{each.column} converted from {each.from_unit}" for each in self.converted]
        lines += [
            f"{each.rows} row{'s' * (each.rows > 1)} dropped ({each.reason})"
            for each in self.dropped
        ]
        return lines + list(self.doubts)


@dataclass(frozen=True, slots=True, eq=False)
class Log:
    """A flight as a log keeps it, about once a second; ours are kept in the same way.

    ``time_s``: (n,) seconds from its first row, rising. ``channels``: (n, 23) in
    `core.channels.CHANNELS` order and units, NaN where the log says nothing.
    """

    name: str
    time_s: Array
    channels: Array
    reading: Reading = field(default_factory=Reading)

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
        if path.exists() and not path.is_file():
            raise InputError("logs", f"{path.name}: is no file")
        if path.stat().st_size > MOST_BYTES:
            raise InputError("logs", f"{path.name}: is larger than {MOST_BYTES >> 20} MB")
        data = path.read_bytes()
    except OSError as error:
        raise InputError("logs", f"cannot read {path}: {error.strerror}") from None
    try:
        return _log(path.name, split_table(data))
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


def _log(name: str, table: Table) -> Log:
    """The table in our channels and units; raises `InputError`."""
    _refuse_doubles(table)
    notes = _Notes()
    decimal_comma = _has_decimal_commas(table)
    channels = np.column_stack(
        [_channel(table, channel, decimal_comma, notes) for channel in CHANNELS]
    )
    for required in REQUIRED:
        if plain(required) not in table.names:
            raise InputError("logs", f"has no column {required!r}")
        if np.isnan(channels[:, CHANNEL_INDEX[required]]).all():
            raise InputError("logs", f"column {required!r} holds no numbers")
    if not table.has_units:
        notes.doubts.append("it states no units: read as those of the G1000 (degF, psi, gph, kt)")
    _level_g(channels, notes)
    time_s = _time_s(table, notes)
    facts = table.facts
    aircraft = facts.get("airframe_name") or None
    device = facts.get("product") or None
    if aircraft is None:
        of_device = f" (of a {device})" if device else ""
        notes.doubts.append(f"its head{of_device} names no aircraft")
    mode = facts.get("mode", "NORMAL")
    simulated = mode == SIMULATED_MODE or facts.get("unit_software_part_number") == UNIT_PART
    if mode not in ("NORMAL", SIMULATED_MODE):
        notes.doubts.append(f"its mode is {mode!r}, not NORMAL")
    reading = Reading(
        rows=len(channels),
        aircraft=aircraft,
        device=device,
        simulated=simulated,
        not_a_172=_not_a_172(aircraft, table, channels),
        converted=tuple(notes.converted),
        dropped=table.dropped,
        doubts=tuple(notes.doubts),
    )
    return Log(name, time_s, channels, reading)


@dataclass(slots=True)
class _Notes:
    """What there is to say, as it comes up."""

    converted: list[Conversion] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)


def _refuse_doubles(table: Table) -> None:
    wanted = {plain(name): name for name in CHANNEL_NAMES} | {DATE: DATE, TIME: TIME}
    for name, shown in wanted.items():
        if table.names.count(name) > 1:
            raise InputError("logs", f"has two columns named {shown!r}")


def _has_decimal_commas(table: Table) -> bool:
    """Whether numbers have a decimal comma; raises `InputError` where that cannot be known."""
    if table.separator == ",":
        return False  # a comma in a quoted number is then no number, and is said so
    columns = [table.column(plain(name)) for name in CHANNEL_NAMES if plain(name) in table.names]
    numbers = {cell for column in columns for cell in column if is_number(cell.replace(",", ""))}
    commas = sorted(cell for cell in numbers if "," in cell)
    points = sorted(cell for cell in numbers if "." in cell)
    if commas and points:
        raise InputError(
            "logs", f"has decimal commas and decimal points ({commas[0]!r}, {points[0]!r})"
        )
    if commas and all(_THOUSANDS.fullmatch(cell) for cell in commas):
        raise InputError(
            "logs", f"has numbers like {commas[0]!r}: decimals or thousands? write a decimal point"
        )
    return bool(commas)


def _channel(table: Table, channel: Channel, decimal_comma: bool, notes: _Notes) -> Array:
    """One column in our unit, NaN where a cell is blank or no number; raises `InputError`."""
    if plain(channel.name) not in table.names:
        return np.full(len(table.rows), np.nan)
    scale = _scale(table, channel, notes)
    cells = table.column(plain(channel.name))
    if decimal_comma:
        cells = [cell.replace(",", ".") for cell in cells]
    numbers = pd.to_numeric(np.array(cells, dtype=object), errors="coerce").astype(np.float64)
    values: Array = np.where(np.isfinite(numbers), numbers, np.nan)
    words = [cells[row] for row in np.flatnonzero(np.isnan(values)) if not is_blank(cells[row])]
    if words:
        what = "cell that is no number" if len(words) == 1 else "cells that are no numbers"
        notes.doubts.append(
            f"column {channel.name!r} holds {len(words)} {what} ({words[0][:20]!r}): left blank"
        )
    return values if scale.is_ours else values * scale.factor + scale.offset


def _scale(table: Table, channel: Channel, notes: _Notes) -> Scale:
    """The one scale that the file states for a channel; ours where it states none."""
    stated = table.units.get(plain(channel.name), ())
    scales: dict[str, Scale] = {}
    for unit in stated:
        scale = scale_of(unit, channel.unit)
        if scale is None:
            raise InputError(
                "logs",
                f"column {channel.name!r} is in {unit!r}; understood: {understood(channel.unit)}",
            )
        scales[unit] = scale
    if len(set(scales.values())) > 1:
        raise InputError(
            "logs", f"column {channel.name!r} is in " + " and in ".join(map(repr, scales))
        )
    if not scales:
        if table.has_units:
            notes.doubts.append(f"column {channel.name!r} states no unit: read as {channel.unit}")
        return Scale(channel.unit)
    scale = next(iter(scales.values()))
    if not scale.is_ours:
        notes.converted.append(Conversion(channel.name, scale.unit, channel.unit))
    return scale


def _level_g(channels: Array, notes: _Notes) -> None:
    """Bring the normal acceleration to 0 in level flight: some devices count the weight itself.

    Judged by its median, which is that of standing and of level flight.
    """
    lift = channels[:, CHANNEL_INDEX["NormAc"]]
    if np.isnan(lift).all():
        return
    median = float(np.nanmedian(lift))
    if abs(median) <= _G_LEVEL_WITHIN:
        return
    if abs(median - 1.0) <= _G_LEVEL_WITHIN:
        lift -= 1.0
        notes.converted.append(Conversion("NormAc", "g, 1 in level flight", "g, 0 in level flight"))
        return
    lift[:] = np.nan
    notes.doubts.append(
        f"column 'NormAc' has a median of {median:.2f} g, neither 0 nor 1: left blank"
    )


def _time_s(table: Table, notes: _Notes) -> Array:
    """Each row's seconds from the first; a log without a clock is taken to have a row a second."""
    n = len(table.rows)
    if not {DATE, TIME} <= set(table.names):
        notes.doubts.append("it has no clock: taken as a row a second")
        return np.arange(n, dtype=np.float64)
    cells = {
        name: pd.Series(table.column(name), dtype=str)
        for name in (DATE, TIME, UTC_OFFSET)
        if name in table.names
    }
    days = read_days(cells[DATE], "Lcl Date", " ".join(table.units.get(DATE, ())))
    clock = clock_s(days, read_times(cells[TIME], "Lcl Time"))
    if np.isnan(clock).all():
        notes.doubts.append("its clock is blank: taken as a row a second")
    offset = read_offsets(cells[UTC_OFFSET]) if UTC_OFFSET in cells else np.zeros(n)
    time_s, doubts = place(clock, offset)
    notes.doubts += doubts
    return time_s


def _not_a_172(aircraft: str | None, table: Table, channels: Array) -> str | None:
    """What shows that the aircraft is no Cessna 172, None where nothing does."""
    if aircraft is not None and not _CESSNA_172.search(aircraft):
        return f"the aircraft is {aircraft!r}, not a Cessna 172"
    strange = [
        written
        for name, written in zip(table.names, table.written, strict=True)
        if _OTHER_ENGINE.fullmatch(name) and not all(map(is_blank, table.column(name)))
    ]
    if strange:
        return f"it logs {_listed(strange)}, which a Cessna 172S does not have"
    if aircraft is None:
        silent = [name for k, name in enumerate(CHANNEL_NAMES) if np.isnan(channels[:, k]).all()]
        if silent:
            return f"it names no aircraft and lacks {_listed(silent)}, which a Cessna 172S logs"
    return None


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return ", ".join(names[:3]) + more

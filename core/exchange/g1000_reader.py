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

import numpy as np
import pandas as pd

from core.arrays import Array
from core.channels import CHANNEL_INDEX, CHANNEL_NAMES, CHANNELS, Channel
from core.errors import InputError
from core.exchange.g1000_writer import SIMULATED_MODE, UNIT_PART
from core.exchange.log import Conversion, Log, Reading
from core.exchange.log_clock import clock_s, place, read_days, read_offsets, read_times
from core.exchange.log_table import (
    DATE,
    TIME,
    UTC_OFFSET,
    Table,
    is_blank,
    is_number,
    plain,
    split_table,
)
from core.exchange.log_units import Scale, scale_of, understood

REQUIRED: tuple[str, ...] = ("IAS", "VSpd", "E1 RPM")
"""Without these nobody can tell cruise from anything else; any other channel may be missing."""

_CESSNA_172 = re.compile(r"(?<![\w])(cessna\s*|c-?)?172(?!rg)[a-z]{0,2}(?!\w)", re.IGNORECASE)
_OTHER_ENGINE = re.compile(r"e2 .+|e1 (map|[ce][hg]t[5-9]|torq|ng|np|itt|tit\d?|coolt|geart)")
_G_LEVEL_WITHIN = 0.3
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")


def read_g1000(name: str, data: bytes) -> Log:
    """The log in the bytes of a file; raises `InputError`."""
    return _log(name, split_table(data))


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
    """What shows that the aircraft is not a Cessna 172, None where nothing does."""
    if aircraft is not None and not _CESSNA_172.search(aircraft):
        return f"the aircraft is {aircraft!r}, not a Cessna 172"
    ours = set(map(plain, CHANNEL_NAMES))
    strange = [
        written
        for name, written in zip(table.names, table.written, strict=True)
        if name not in ours
        and _OTHER_ENGINE.fullmatch(name)
        and not all(map(is_blank, table.column(name)))
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

"""The text of a log as a table: its names, units and rows, whatever separates them.

Nothing is converted here. What cannot be told apart is refused, and what is left out is counted.
"""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from core.channels import CHANNEL_NAMES
from core.errors import InputError
from core.exchange.log_units import is_unit

DATE, TIME, UTC_OFFSET = "lcl date", "lcl time", "utcofst"
COPY = "a copy of the row before"
CUT = "cut off: no end of line after it"

_HEADER_LINES = 20
_LEAST_NAMES = 5
_SEPARATORS = (",", ";", "\t")
_NAME_AND_UNIT = re.compile(r"(.*?)\s*[(\[]([^()\[\]]*)[)\]]")
_NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?")
_FACT = re.compile(r"(\w+)\s*=\s*\"*([^\",;\t]*)")
_HEAD = re.compile(r"airframe_info|\brpm\b|/min\b|\bpsi\b", re.IGNORECASE)
"""What some line of a head has, and hardly a row: only those lines are looked at more closely."""

_BLANK = re.compile(r"[-–*_.#?/ ]*|nan|na|n/a|null|none", re.IGNORECASE)


def plain(name: str) -> str:
    """A column's name without what differs between exports: padding, case, a comment mark.

    >>> plain("# E1  CHT1 ")
    'e1 cht1'
    """
    return " ".join(name.strip().lstrip("#").split()).lower()


_CHANNELS = {plain(name): name for name in CHANNEL_NAMES}
_WANTED = frozenset((*_CHANNELS, DATE, TIME, UTC_OFFSET))


@dataclass(frozen=True, slots=True)
class Dropped:
    """Rows that were left out, and why."""

    rows: int
    reason: str


@dataclass(frozen=True, slots=True)
class Table:
    """A log's text in parts.

    ``names`` as in `plain`, without a unit, and ``written`` as the file has them; ``units`` has
    what is stated of each wanted column, several where it is stated twice. ``rows`` have a cell for
    each name. ``facts`` is what the head says of the airframe.
    """

    names: tuple[str, ...]
    written: tuple[str, ...]
    units: dict[str, tuple[str, ...]]
    has_units: bool
    rows: tuple[tuple[str, ...], ...]
    facts: dict[str, str]
    separator: str
    dropped: tuple[Dropped, ...]

    def column(self, name: str) -> list[str]:
        """The cells of a column, stripped."""
        place = self.names.index(name)
        return [row[place].strip() for row in self.rows]


def is_blank(cell: str) -> bool:
    """Whether a cell says that nothing is known.

    >>> is_blank(" "), is_blank("-"), is_blank("NaN"), is_blank("0")
    (True, True, True, False)
    """
    return _BLANK.fullmatch(cell.strip()) is not None


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a decimal point or comma."""
    return _NUMBER.fullmatch(cell) is not None


def split_table(data: bytes) -> Table:
    """The parts of a log; raises `InputError` that says what it is instead, or what is wrong."""
    lines, is_whole = _lines(data)
    at, separator = _header(lines)
    written = _cells(lines[at], separator)
    names, in_names = _names(written)
    above = [_cells(line, separator) for line in lines[:at]]
    body = lines[at + 1 :]
    stated = [*([in_names] if any(in_names) else []), *_units_above(above, names)]
    while body and _is_units_below(_cells(body[0], separator), names):
        stated.append(_cells(body[0], separator))
        at, body = at + 1, body[1:]
    rows, dropped = _rows(body, separator, names, first_line=at + 2, is_whole=is_whole)
    return Table(
        names=names,
        written=tuple(written),
        units=_stated(stated, names),
        has_units=bool(stated),
        rows=rows,
        facts=_facts(lines[: at + 1]),
        separator=separator,
        dropped=dropped,
    )


def _lines(data: bytes) -> tuple[list[str], bool]:
    """The lines, and whether the last has an end."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = data.decode("utf-16", errors="replace")
    elif b"\0" in data[:1024]:
        raise InputError("logs", "is not text")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252", errors="replace")
    text = text.rstrip("\0").replace("\r\n", "\n").replace("\r", "\n")  # NULs: the power went
    if not text.strip():
        raise InputError("logs", "is empty")
    lines = text.split("\n")
    is_whole = not lines[-1].strip()
    return lines[: -1 if is_whole else None], is_whole


def _cells(line: str, separator: str) -> list[str]:
    return [cell.strip() for cell in _split(line, separator)]


def _split(line: str, separator: str) -> list[str]:
    if '"' not in line:
        return line.split(separator)
    # Line by line: a quotation mark without its other half must not swallow the lines below.
    reader = csv.reader([line.replace("\0", " ")], delimiter=separator, skipinitialspace=True)
    try:
        return next(reader)
    except csv.Error:  # a cell beyond all bounds
        return line.split(separator)


def _header(lines: Sequence[str]) -> tuple[int, str]:
    """The last of the first lines that names channels: an export repeats them in a comment."""
    for separator in _SEPARATORS:
        for at in range(min(len(lines), _HEADER_LINES) - 1, -1, -1):
            if _is_header(_cells(lines[at], separator)):
                return at, separator
    raise InputError("logs", _foreign(lines))


def _is_header(cells: Sequence[str]) -> bool:
    return len(_CHANNELS.keys() & set(_names(cells)[0])) >= _LEAST_NAMES


def _foreign(lines: Sequence[str]) -> str:
    """What a file without G1000 names is, as far as can be seen."""
    only = "; only logs of the Garmin G1000 family are read"
    for line in lines[:_HEADER_LINES]:
        cells = {cell.lower() for separator in ",;" for cell in _cells(line, separator)}
        if {"index", "date", "time", "e1", "c1"} <= cells:
            cylinders = sum(f"e{number}" in cells for number in range(1, 10))
            return f"is the log of a JPI engine monitor with {cylinders} cylinders{only}"
        if line.startswith("$U"):
            return f"is the raw data of a JPI engine monitor{only}"
        if {"byte # in record", "guid"} & cells:
            return f"is the raw data of a Dynon{only}"
        if {"session time", "system time"} <= cells:
            return f"is the log of a Dynon SkyView{only}"
    first = " ".join(lines[0].split())
    return f"has no line with the names of G1000 columns (it begins {first[:40]!r})"


def _names(cells: Sequence[str]) -> tuple[tuple[str, ...], list[str]]:
    """Names without units, and the units that some exports put behind them in brackets."""
    names, units = [], []
    for cell in cells:
        found = _NAME_AND_UNIT.fullmatch(cell)
        bare = plain(found[1]) if found else ""
        is_wanted = bare in _CHANNELS
        names.append(bare if is_wanted else plain(cell))
        units.append(found[2].strip() if found and is_wanted else "")
    return tuple(names), units


def _units_above(lines: Sequence[Sequence[str]], names: Sequence[str]) -> list[list[str]]:
    """The lines above the names that state units; raises `InputError` if they fit no names."""
    found = []
    for cells in lines:
        units = [_unit_in(cell) for cell in cells]
        if _is_header(cells) or "airframe_info" in cells[0]:
            continue
        is_comment = cells[0].startswith("#") and len(cells) == len(names)
        if sum(map(is_unit, units)) < _LEAST_NAMES and not is_comment:
            continue
        if len(units) != len(names) and _width(units) != _width(names):
            raise InputError("logs", f"has {_width(units)} units for {_width(names)} names")
        worded = any(_NAME_AND_UNIT.fullmatch(cell) for cell in cells)
        # Among names with units in brackets, a name without any states none.
        found.append(
            [
                unit if not worded or is_unit(unit) or unit != cell else ""
                for unit, cell in zip(units, cells, strict=False)
            ]
        )
    return found


def _width(cells: Sequence[str]) -> int:
    """The number of cells up to the last that is not empty."""
    return max((place for place, cell in enumerate(cells, start=1) if cell), default=0)


def _unit_in(cell: str) -> str:
    """The unit of a cell: in brackets behind a name, or all there is."""
    found = _NAME_AND_UNIT.fullmatch(cell)
    return found[2].strip() if found else cell.strip()


def _is_units_below(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a line below the names states units: words where numbers should be."""
    named = zip(cells, names, strict=False)
    wanted = [cell for cell, name in named if name in _CHANNELS and not is_blank(cell)]
    return sum(not is_number(cell) for cell in wanted) > len(wanted) / 2


def _is_head(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a line among the rows is one of another head."""
    stripped = [cell.strip() for cell in cells]
    return "airframe_info" in cells[0] or _is_header(stripped) or _is_units_below(stripped, names)


def _stated(lines: Sequence[Sequence[str]], names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    return {
        name: tuple(dict.fromkeys(line[k] for line in lines if k < len(line) and line[k]))
        for k, name in enumerate(names)
        if name in _WANTED
    }


def _facts(lines: Sequence[str]) -> dict[str, str]:
    """What ``#airframe_info`` says, by its own words."""
    line = next((line for line in lines if "airframe_info" in line), "")
    return {name: value.strip() for name, value in _FACT.findall(line)}


def _rows(
    lines: Sequence[str],
    separator: str,
    names: Sequence[str],
    *,
    first_line: int,
    is_whole: bool,
) -> tuple[tuple[tuple[str, ...], ...], tuple[Dropped, ...]]:
    """The rows that can be trusted, and those that were left out."""
    width, least, has_clock = len(names), _width(names), {DATE, TIME} <= set(names)
    rows: list[tuple[str, ...]] = []
    left_out: Counter[str] = Counter()
    for number, line in enumerate(lines, start=first_line):
        if number == first_line + len(lines) - 1 and not is_whole:
            left_out[CUT] += 1
            break
        if not line.strip():
            continue
        cells = _split(line, separator)
        if _HEAD.search(line) and _is_head(cells, names):
            raise InputError("logs", f"has a second head at line {number}: split it")
        if any(map(str.strip, cells[width:])) or len(cells) < least:
            left_out[f"{len(cells)} fields, not {width}"] += 1
            continue
        row = tuple(cells[:width])
        # A row that was written twice; without a clock in it, it may be a moment like the last.
        if has_clock and rows and row == rows[-1] and row[names.index(TIME)].strip():
            left_out[COPY] += 1
            continue
        rows.append(row)
    misfits = left_out.total() - left_out[COPY] - left_out[CUT]
    if misfits > len(rows):
        reason = left_out.most_common(1)[0][0].partition(",")[0]
        raise InputError("logs", f"has {width} names, but most of its rows have {reason}")
    if not rows:
        raise InputError("logs", "has no rows")
    return tuple(rows), tuple(Dropped(n, reason) for reason, n in left_out.items() if n)

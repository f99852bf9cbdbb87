"""The clock of a log: dates and times as they are written, and each row's place in time.

What a date means is never guessed: where day and month may be either, and nothing in the file
decides, it is refused.
"""

import re
from datetime import date

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from core.arrays import Array
from core.errors import InputError
from core.exchange.log_table import is_blank

Rows = NDArray[np.intp]

WOBBLE_S = 5.0
"""A clock that steps back by less than this is corrected while it runs; no time is lost."""
CLOCK_SET_S = 60.0
"""The gap left where the clock is set back by more: how long that took is not known."""
GAP_SAID_S = 60.0
_MOST_SAID = 3

_DAY_S = 86_400.0
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_YEAR_FIRST = re.compile(r"(\d{4})([-/.]?)(\d{1,2})\2(\d{1,2})")
_MONTH_NAMED = re.compile(r"(\d{1,2})[-/. ]([a-z]{3,9})[-/. ](\d{4})")
_YEAR_LAST = re.compile(r"(\d{1,2})([-/.])(\d{1,2})\2(\d{4})")
_SHORT_YEAR = re.compile(r"\d{1,2}([-/.])\d{1,2}\1\d{2}")
_TIME = r"^(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)\s*([AaPp])?[Mm]?$"
_OFFSET = r"^([+-]?)(\d{1,2}):?(\d{2})$"


def read_days(cells: "pd.Series[str]", column: str, stated: str) -> Array:
    """Days (n,) since year 1, NaN where a cell is blank or no date.

    ``stated`` is what the units line says of the column. Raises `InputError` where no date can be
    read, or where it may mean two.
    """
    texts = sorted({text for text in cells.unique() if not is_blank(text)})
    parts = {text: found for text in texts if (found := _YEAR_LAST.fullmatch(text))}
    month_first = _month_first(parts, column, stated) if parts else False
    days = {text: _day(text, month_first) for text in texts}
    if texts and not any(days.values()):
        if _SHORT_YEAR.fullmatch(texts[0]):
            raise InputError(
                "logs", f"column {column!r}: {texts[0]!r} has two digits for the year; write four"
            )
        raise InputError("logs", f"column {column!r}: {texts[0]!r} is no date (like 2014-10-29)")
    return _floats(cells.map(days))


def _month_first(parts: dict[str, re.Match[str]], column: str, stated: str) -> bool:
    """Whether 05/06/2014 is the sixth of May in this file; raises `InputError` where unclear."""
    days_first = [text for text, part in parts.items() if int(part[1]) > 12]
    months_first = [text for text, part in parts.items() if int(part[3]) > 12]
    points = [text for text, part in parts.items() if part[2] == "."]
    if months_first and (days_first or points):
        raise InputError(
            "logs",
            f"column {column!r}: {(days_first or points)[0]!r} has the day first, "
            f"{months_first[0]!r} the month",
        )
    if months_first:
        return True
    if days_first or points:
        return False
    if form := re.match(r"(d{1,2}|m{1,2})[-/.](d{1,2}|m{1,2})[-/.]y", stated.strip(" #").lower()):
        return form[1].startswith("m")
    unclear = [text for text, part in parts.items() if int(part[1]) != int(part[3])]
    if unclear:
        raise InputError(
            "logs",
            f"column {column!r}: {unclear[0]!r} may be day or month first, and no date in the "
            "file decides; write dates as YYYY-MM-DD",
        )
    return False


def _day(text: str, month_first: bool) -> int | None:
    """The day since year 1 that a cell names, None where it names none."""
    if found := _YEAR_FIRST.fullmatch(text):
        if not found[2] and len(text) != len("20141029"):
            return None
        year, month, day = int(found[1]), int(found[3]), int(found[4])
    elif found := _YEAR_LAST.fullmatch(text):
        first, second, year = int(found[1]), int(found[3]), int(found[4])
        month, day = (first, second) if month_first else (second, first)
    elif (found := _MONTH_NAMED.fullmatch(text.lower())) and found[2][:3] in _MONTHS:
        year, month, day = int(found[3]), _MONTHS.index(found[2][:3]) + 1, int(found[1])
    else:
        return None
    try:
        return date(year, month, day).toordinal()
    except ValueError:
        return None


def read_times(cells: "pd.Series[str]", column: str) -> Array:
    """Seconds of the day (n,), NaN where a cell is blank or no time.

    Raises `InputError` where no cell can be read.
    """
    found = cells.str.extract(_TIME)
    hour, minute = found[0].astype(float), found[1].astype(float)
    second = found[2].str.replace(",", ".", regex=False).astype(float)
    half = found[3].str.lower()
    fits = (minute < 60) & (second < 60) & np.where(half.isna(), hour < 24, hour.between(1, 12))
    hour = hour.where(half.isna(), hour % 12 + np.where(half == "p", 12.0, 0.0))
    seconds = _floats((hour * 3600.0 + minute * 60.0 + second).where(fits))
    if np.isnan(seconds).all():
        wrong = [text for text in cells.unique() if not is_blank(text)]
        if wrong:
            raise InputError(
                "logs", f"column {column!r}: {wrong[0]!r} is no time with seconds (like 10:00:01)"
            )
    return seconds


def read_offsets(cells: "pd.Series[str]") -> Array:
    """Local time less UTC in seconds (n,), that of the row before where a cell says nothing."""
    found = cells.str.extract(_OFFSET)
    size = found[1].astype(float) * 3600.0 + found[2].astype(float) * 60.0
    offsets = size.where(found[0] != "-", -size).ffill().bfill()
    return _floats(offsets.fillna(0.0))


def _floats(values: "pd.Series[float]") -> Array:
    return np.asarray(values, dtype=np.float64)


def clock_s(days: Array, times: Array) -> Array:
    """Local time in seconds from the first midnight (n,), NaN where day or time is not known."""
    known = days[np.isfinite(days)]  # seconds since year 1 have no room for milliseconds
    seconds: Array = (days - (known.min() if len(known) else 0.0)) * _DAY_S + times
    return seconds


def place(clock: Array, offset: Array) -> tuple[Array, tuple[str, ...]]:
    """Each row's time in seconds from the first (n,), rising, and what there is to say about it.

    Rows keep their order, and each lies in the second that its clock reads:

    - rows of one second are spread evenly over it: the device's period and its clock's beat against
      each other, so that some seconds have two rows and some none;
    - rows whose clock has stepped back by less than `WOBBLE_S` count as of the latest second;
    - a clock that is set back further leaves a gap of `CLOCK_SET_S`;
    - at a change of the offset from UTC, whichever of local time and UTC runs on is believed;
    - rows without a clock lie between their neighbours.

    Raises `InputError` where the clock runs backwards so often that rows cannot be in order.
    """
    readable = np.flatnonzero(np.isfinite(clock))
    if not len(readable):
        return np.arange(len(clock), dtype=np.float64), ()
    known, period_s, span_s = _moving(readable, clock)
    elapsed, doubts = _unwrapped(clock[known], offset[known], known, period_s)
    if len(known) < len(readable):
        doubts.append(
            f"its clock stands still over {_rows(len(readable) - len(known))}: taken as a row "
            f"every {period_s:g} s"
        )
    if blank := len(clock) - len(readable):
        has = "has" if blank == 1 else "have"
        doubts.append(f"{_rows(blank)} {has} no clock that can be read: placed by their neighbours")
    times, n_shared = _spread(elapsed, span_s)
    if n_shared:
        shares = "shares its" if n_shared == 1 else "share their"
        doubts.append(
            f"{_rows(n_shared)} {shares} second with the row before: kept, and spread evenly over "
            "that second"
        )
    rows = np.arange(len(clock), dtype=np.float64)
    placed = np.interp(rows, known, times)
    placed += np.minimum(rows - known[0], 0.0) * period_s + np.maximum(rows - known[-1], 0.0) * (
        period_s
    )
    return placed - placed[0], tuple(doubts)


def _rows(number: int) -> str:
    return "1 row" if number == 1 else f"{number} rows"


def _moving(readable: Rows, clock: Array) -> tuple[Rows, float, float]:
    """Rows whose clock can be believed, the usual seconds a row, and what a reading spans.

    Of rows over which the clock stands still, the first.
    """
    seconds = clock[readable]
    first = np.flatnonzero(np.diff(seconds, prepend=np.nan) != 0.0)  # of each run of one reading
    lengths = np.diff(first, append=len(seconds))
    steps = np.diff(seconds[first])
    step_s = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 1.0
    usual = float(np.median(lengths)) if len(first) > 1 else 1.0
    still = np.repeat(lengths > max(4.0, 3.0 * usual), lengths)
    still[first] = False
    whole = bool((seconds % 1.0 == 0.0).all())
    return readable[~still], step_s / usual, 1.0 if whole else step_s


def _unwrapped(clock: Array, offset: Array, rows: Rows, period_s: float) -> tuple[Array, list[str]]:
    """Seconds elapsed (n,), never falling, by a clock that was set or wobbles; and what it did."""
    steps, apart = np.diff(clock), np.diff(rows)
    utc = steps - np.diff(offset)
    zoned = np.flatnonzero(utc != steps)
    runs_on = np.abs(utc - period_s) < np.abs(steps - period_s)
    steps = np.where(runs_on, utc, steps)
    backward = np.flatnonzero(steps < 0.0)
    if len(backward) > max(3, len(clock) // 100):
        raise InputError(
            "logs",
            f"its clock runs backwards {len(backward)} times: rows are not in the order of time",
        )
    elapsed = np.zeros(len(clock))
    here = latest = 0.0
    set_back, gaps = [], []
    for k, step_s in enumerate(steps.tolist()):
        here += step_s
        expected_s = float(apart[k]) * period_s
        if here < latest - WOBBLE_S:
            set_back.append(k)
            here = latest = latest + CLOCK_SET_S
        elif apart[k] > 1 and here - latest < 0.5 * expected_s:
            here = latest = latest + expected_s
        else:
            if here - latest > expected_s + GAP_SAID_S:
                gaps.append(k)
            latest = max(here, latest)
        elapsed[k + 1] = latest
    doubts = []
    if len(zoned):
        doubts.append(f"its UTC offset changes {_times(len(zoned))}: time runs on across that")
    for k in set_back[:_MOST_SAID]:
        doubts.append(
            f"its clock is set back by {-steps[k]:g} s after row {rows[k] + 1}: taken as a gap of "
            f"{CLOCK_SET_S:g} s"
        )
    for k in gaps[:_MOST_SAID]:
        doubts.append(
            f"it has no rows for {steps[k]:g} s after row {rows[k] + 1}, or its clock was set then"
        )
    if unsaid := max(0, len(set_back) - _MOST_SAID) + max(0, len(gaps) - _MOST_SAID):
        doubts.append(f"its clock jumps {_times(unsaid)} more")
    if wobbles := [k for k in backward if k not in set_back]:
        doubts.append(
            f"its clock steps back by up to {-steps[wobbles].min():g} s {_times(len(wobbles))}: "
            "those rows keep their order"
        )
    return elapsed, doubts


def _times(number: int) -> str:
    return "once" if number == 1 else f"{number} times"


def _spread(elapsed: Array, span_s: float) -> tuple[Array, int]:
    """Rows of one reading evenly over what a reading spans, and how many follow another."""
    first = np.flatnonzero(np.diff(elapsed, prepend=-1.0) != 0.0)
    lengths = np.diff(first, append=len(elapsed))
    room = np.minimum(np.diff(elapsed[first], append=np.inf), span_s)
    place = np.arange(len(elapsed)) - np.repeat(first, lengths)
    usual = float(np.median(lengths))
    shared = int((lengths - 1)[lengths > usual].sum())
    return elapsed + place * np.repeat(room / lengths, lengths), shared

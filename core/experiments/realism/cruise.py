"""Cruise in a log and what it looks like: one set of rules for real flights and for ours.

The rules and estimators are those by which the real figures of ``assets/facts/fmea.md``
section 5 were measured.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import median_abs_deviation

from core.arrays import Array
from core.channels import CHANNEL_NAMES, N_CHANNELS, cht_name, egt_name
from core.cylinders import CYLINDERS
from core.exchange.log import Log

Rows = NDArray[np.bool_]

LEVEL_FPM, FAST_KT, CRUISING_RPM = 100.0, 90.0, 1900.0
STEADY_RPM, STEADY_OVER_S, STEADY_LEAST_S = 30.0, 11, 15
GAP_S = 3.0
"""Rows further apart are not consecutive; the G1000 skips a second now and then."""
HIGH_PASS_S = 31

CORRELATIONS: tuple[tuple[str, str], ...] = (
    ("E1 RPM", "IAS"),
    ("E1 RPM", "E1 OilP"),
    *((cht_name(a), cht_name(b)) for a in CYLINDERS for b in CYLINDERS if a < b),
    *((egt_name(cylinder), "E1 FFlow") for cylinder in CYLINDERS),
)
"""The pairs of channels that are strongly tied in real cruise."""


def cruising(log: Log) -> Rows:
    """Rows (n,) of level flight at cruise speed and power."""
    return _level_and_fast(log) & (log.channel("E1 RPM") > CRUISING_RPM)


def steady_stretches(log: Log) -> list[slice]:
    """Stretches of at least 15 s, level and fast, the engine within 30 rpm over any 11 s."""
    rpm = pd.Series(log.channel("E1 RPM")).rolling(STEADY_OVER_S, center=True)
    settled = ((rpm.max() - rpm.min()) < STEADY_RPM).to_numpy(dtype=bool)
    apart = np.diff(log.time_s, prepend=log.time_s[:1]) > GAP_S
    return [
        rows
        for rows in _runs(_level_and_fast(log) & settled, apart)
        if rows.stop - rows.start >= STEADY_LEAST_S
    ]


def _level_and_fast(log: Log) -> Rows:
    level: Rows = np.abs(log.channel("VSpd")) < LEVEL_FPM
    return level & (log.channel("IAS") > FAST_KT)


def _runs(wanted: Rows, apart: Rows) -> list[slice]:
    """Runs of consecutive wanted rows, cut where the row is ``apart`` from the one before."""
    begins = wanted & ~np.concatenate([[False], wanted[:-1] & ~apart[1:]])
    ends = wanted & ~np.concatenate([wanted[1:] & ~apart[1:], [False]])
    return [
        slice(int(start), int(end) + 1)
        for start, end in zip(np.flatnonzero(begins), np.flatnonzero(ends), strict=True)
    ]


@dataclass(frozen=True, slots=True, eq=False)
class Cruise:
    """What a set of flights looks like in cruise.

    ``mean``, ``low``, ``high``: (23,) over all cruise rows. ``white_sd``: (23,) white noise in
    steady cruise. ``slow`` and ``fast``: correlation of each of `CORRELATIONS`, (14,), of the
    departures from the flight's own mean in cruise, and from the mean over 31 s in steady cruise.
    NaN where there is nothing to measure.
    """

    seconds: int
    steady_seconds: int
    mean: Array
    low: Array
    high: Array
    white_sd: Array
    slow: Array
    fast: Array


def describe(logs: Iterable[Log]) -> Cruise:
    """The figures of all these flights together."""
    cruise: list[Array] = []
    second: list[Array] = []
    slow: list[Array] = []
    fast: list[Array] = []
    steady_seconds = 0
    for log in logs:
        rows = log.channels[cruising(log)]
        if len(rows):
            cruise.append(rows)
            slow.append(rows - _each(rows, np.mean))
        quick = high_passed(log.channels)
        for stretch in steady_stretches(log):
            second.append(np.diff(log.channels[stretch], 2, axis=0))
            fast.append(quick[stretch])
            steady_seconds += stretch.stop - stretch.start
    rows = _stacked(cruise)
    return Cruise(
        seconds=len(rows),
        steady_seconds=steady_seconds,
        mean=_each(rows, np.mean),
        low=_each(rows, np.min),
        high=_each(rows, np.max),
        white_sd=_each(_stacked(second), white_sd),
        slow=_correlations(_stacked(slow)),
        fast=_correlations(_stacked(fast)),
    )


def high_passed(channels: Array) -> Array:
    """Channels (n, 23) less their running mean over 31 s."""
    means = pd.DataFrame(channels).rolling(HIGH_PASS_S, center=True, min_periods=1).mean()
    quick: Array = channels - means.to_numpy(dtype=np.float64)
    return quick


def white_sd(second: Array) -> float:
    """White noise from second differences (n,): their MAD over sqrt 6, their sd if that is 0."""
    robust = float(median_abs_deviation(second, scale="normal"))
    return (robust or float(np.std(second))) / math.sqrt(6.0)


def _stacked(parts: list[Array]) -> Array:
    return np.concatenate(parts) if parts else np.empty((0, N_CHANNELS))


def _each(rows: Array, measure: Callable[[Array], float]) -> Array:
    """A figure of each channel's known values, (23,), NaN for a channel without any."""
    known = [column[~np.isnan(column)] for column in rows.T]
    return np.array([float(measure(values)) if len(values) else np.nan for values in known])


def _correlations(rows: Array) -> Array:
    """Correlation of each of `CORRELATIONS`, NaN where too little is known or nothing moves."""
    table = pd.DataFrame(rows, columns=list(CHANNEL_NAMES))
    return np.array([table[a].corr(table[b], min_periods=30) for a, b in CORRELATIONS])

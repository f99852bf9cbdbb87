"""From residuals to statements: which channels left their mirror, when, how far, which way.

Evidence reaches from a channel's departure to the end of the flight, or until somebody repaired
the engine; its value is what the channel settles at. What counts as having moved depends on what
is compared: an exact mirror (lab) leaves nothing but the fault, the surrogate errs by itself, and
healthy field flights stray, the farther the longer they last (`core.residual.healthy`).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.arrays import Array, Array32
from core.channels import CHANNELS, N_CHANNELS, Channel
from core.clock import DT_S
from core.diagnosis.diagnosis import Evidence
from core.residual.departure import Departure
from core.residual.healthy import (
    SENSOR_SD,
    STEP_S,
    HealthyResidual,
    Kind,
    change_sd,
    steps,
)
from core.residual.paired import first_departure
from core.residual.surrogate import Surrogate
from core.twin.trajectory import Pair

MIN_OUTSIDE_STEPS = round(1.0 / DT_S)
"""A channel has moved once it has spent this long outside its band: one second."""

USUAL_TIMES = 2.0

FOLLOWS = {"FQtyL": "E1 FFlow", "FQtyR": "E1 FFlow", "OAT": "AltMSL"}
"""Channels that add up, or go with, the shift of another: tanks empty as fuel flows, and the air
is colder higher up. Where that one is listed they are no evidence of their own."""

TAIL_S = 30.0
"""A value is the mean over the last 30 s: one window."""

SETTLED_SHARE = 0.05
"""A channel has settled once it stays this close to its last value, for a fifth of the time since
it departed and a minute at least."""

SETTLED_FRACTION = 0.2
SETTLED_MIN_S = 60.0

FIELD_BAND = 4.0
"""In field a channel has moved once its means over 30 s lie this many standard deviations outside
what healthy flights do, for another 30 s."""

FIELD_MEAN_STEPS = round(30.0 / STEP_S)


@dataclass(frozen=True, slots=True, eq=False)
class _Course:
    """One channel from the departure on: ``values`` (n,) at ``time_s`` (n,), ``step_s`` apart.

    ``band`` (n,) is what it must leave, ``sd`` (n,) what its values are counted in.
    """

    values: NDArray[np.floating[Any]]
    time_s: Array
    step_s: float
    band: Array
    sd: Array


def find_evidence(
    pair: Pair, until_s: float | None = None
) -> tuple[tuple[Evidence, ...], float | None]:
    """Every channel that left an exact mirror, strongest first, and the onset in seconds.

    A channel is listed if it spends a second or more outside one sensor standard deviation and
    what it comes to lies outside too; one that only swings about its mirror is not. Nothing from
    ``until_s`` on counts. The onset is None, and the evidence empty, where the two flights never
    part.
    """
    residual, time_s = pair.residual, pair.faulted.time_s
    first = first_departure(residual)
    if first is None:
        return (), None
    return _listed(residual, time_s, SENSOR_SD, first, until_s), float(time_s[first])


def find_surrogate_evidence(
    residual: Array32, time_s: Array, surrogate: Surrogate, until_s: float | None = None
) -> tuple[tuple[Evidence, ...], float | None]:
    """The same from the surrogate's finished residual, (n, 23) in divisors.

    The band is twice what healthy flights keep to, and one sensor standard deviation at least; the
    onset is the beginning of the first whole second that any channel spends outside it. Unlike a
    mirror, a network that is taken off what it knows errs in healthy channels too.
    """
    bands = np.maximum(USUAL_TIMES * surrogate.usual * surrogate.divisor, SENSOR_SD)
    departed = residual * surrogate.divisor
    first = _first_second_outside(departed, bands)
    if first is None:
        return (), None
    return _listed(departed, time_s, bands, first, until_s), float(time_s[first])


def find_field_evidence(
    residual: Array32,
    departure: Departure | None,
    healthy: HealthyResidual,
    air: tuple[Kind, float],
    until_s: float | None = None,
) -> tuple[tuple[Evidence, ...], float | None]:
    """The same where the mirror is only roughly this aircraft in this air.

    The residual (n, 23) is taken from its mean over the 30 s before the ``departure``; a channel
    is listed if its means over 30 s stay outside what healthy flights do in that ``air`` (kind of
    flight and gustiness) after as long a time.
    """
    if departure is None:
        return (), None
    means = steps(residual)
    if until_s is not None:
        means = means[: int(until_s / STEP_S)]
    onset = round(departure.onset_s / STEP_S)
    if len(means) - onset < FIELD_MEAN_STEPS:
        return (), departure.onset_s
    shifts = means - means[onset - FIELD_MEAN_STEPS : onset].mean(axis=0)
    smooth = _trailing_means(shifts[onset - FIELD_MEAN_STEPS + 1 :])
    spread = change_sd(healthy.process(*air), FIELD_MEAN_STEPS, len(smooth))
    time_s: Array = departure.onset_s + STEP_S * np.arange(len(smooth), dtype=np.float64)
    found = [
        _channel_evidence(
            channel,
            _Course(
                smooth[:, index], time_s, STEP_S,
                FIELD_BAND * spread[:, index], spread[:, index],
            ),
            FIELD_MEAN_STEPS,
        )
        for index, channel in enumerate(CHANNELS)
    ]  # fmt: skip
    return _ranked(found), departure.onset_s


def _trailing_means(values: Array) -> Array:
    """Means over the last `FIELD_MEAN_STEPS` rows, (n + 5, k) -> (n, k)."""
    total = np.cumsum(np.concatenate([np.zeros((1, values.shape[1])), values]), axis=0)
    means: Array = (total[FIELD_MEAN_STEPS:] - total[:-FIELD_MEAN_STEPS]) / FIELD_MEAN_STEPS
    return means


def _first_second_outside(residual: Array32, bands: Array) -> int | None:
    outside = np.cumsum(np.abs(residual) > bands, axis=0)
    whole: NDArray[np.bool_] = (
        outside[MIN_OUTSIDE_STEPS:] - outside[:-MIN_OUTSIDE_STEPS]
    ) == MIN_OUTSIDE_STEPS
    rows = np.flatnonzero(whole.any(axis=1))
    return int(rows[0]) + 1 if len(rows) else None


def _listed(
    residual: Array32, time_s: Array, bands: Array, first: int, until_s: float | None
) -> tuple[Evidence, ...]:
    stop = len(time_s) if until_s is None else int(np.searchsorted(time_s, until_s - DT_S / 2))
    rows = slice(first, stop)
    n = max(stop - first, 0)
    return _ranked(
        [
            _channel_evidence(
                CHANNELS[index],
                _Course(
                    residual[rows, index], time_s[rows], DT_S,
                    np.full(n, bands[index]), np.full(n, SENSOR_SD[index]),
                ),
                MIN_OUTSIDE_STEPS,
            )
            for index in range(N_CHANNELS)
        ]
    )  # fmt: skip


def _ranked(found: list[Evidence | None]) -> tuple[Evidence, ...]:
    """Strongest first, without what only follows from another channel that is listed."""
    listed = [item for item in found if item is not None]
    moved = {item.channel for item in listed}
    own = [item for item in listed if FOLLOWS.get(item.channel) not in moved]
    return tuple(sorted(own, key=lambda evidence: -abs(evidence.sigma)))


def _channel_evidence(channel: Channel, course: _Course, min_outside: int) -> Evidence | None:
    """The evidence in one channel's course, or None if it kept within its band."""
    outside = np.flatnonzero(np.abs(course.values) > course.band)
    if len(outside) < min_outside:
        return None
    start, stop = int(outside[0]), int(outside[-1])
    band, sd = float(course.band[stop]), float(course.sd[stop])
    value, settled_s = _settled(course, start, stop)
    lasting = float(np.mean(course.values[(start + stop) // 2 : stop + 1], dtype=np.float64))
    if abs(value) < band or abs(lasting) < band or (value > 0.0) != (lasting > 0.0):
        return None
    return Evidence(
        channel=channel.name,
        start_s=float(course.time_s[start]),
        end_s=float(course.time_s[stop]),
        value=value,
        unit=channel.unit,
        direction="+" if value > 0 else "-",
        sigma=value / sd,
        onset_s=float(course.time_s[start]),
        settled_s=settled_s,
    )


def _settled(course: _Course, start: int, stop: int) -> tuple[float, float | None]:
    """What the channel comes to, and since when it has stayed there (None if it still moves).

    A channel that is back in its band before the end has come to nothing: its mean over the time
    outside is what is left to say.
    """
    step = max(1, round(STEP_S / course.step_s))
    if len(course.values) - 1 - stop > step:
        return float(np.mean(course.values[start : stop + 1], dtype=np.float64)), None
    tail = round(TAIL_S / course.step_s)
    value = float(np.mean(course.values[max(start, stop + 1 - tail) : stop + 1], dtype=np.float64))
    n = (stop + 1 - start) // step
    means = course.values[stop + 1 - n * step : stop + 1].reshape(n, step).mean(axis=1)
    away = np.flatnonzero(np.abs(means - value) > max(SETTLED_SHARE * abs(value), course.sd[stop]))
    since = int(away[-1]) + 1 if len(away) else 0
    kept_s = (n - since) * STEP_S
    if kept_s < max(SETTLED_MIN_S, SETTLED_FRACTION * n * STEP_S):
        return value, None
    return value, float(course.time_s[stop + 1 - (n - since) * step])

"""From residuals to statements: which channels left their mirror, when, how far, which way."""

import math

import numpy as np
from numpy.typing import NDArray

from core.channels import CHANNELS, Channel
from core.diagnosis.diagnosis import Evidence
from core.residual.paired import first_departure
from core.residual.window import EFFECTIVE_STEPS
from core.surrogate.surrogate import Surrogate
from core.twin.plan import DT_S
from core.twin.trajectory import Array, Array32, Pair

MIN_OUTSIDE_STEPS = round(1.0 / DT_S)
"""A channel has moved once it has spent this long outside its band: one second."""

USUAL_TIMES = 2.0


def sensor_sd(channel: Channel) -> float:
    """Standard deviation of one healthy reading: white noise and slow wander together."""
    return math.hypot(channel.noise_sd, channel.wander_sd)


def find_evidence(pair: Pair) -> tuple[tuple[Evidence, ...], float | None]:
    """Every channel that really moved, strongest first, and the estimated onset in seconds.

    Only the effective window counts: 120 s from the first departure (paper section 4.1). A channel
    is listed if it spends a second or more outside one sensor standard deviation and its mean over
    that stretch lies outside too; one that only swings about its mirror is not. The onset is None,
    and the evidence empty, where the two flights never part.
    """
    residual = pair.residual
    first = first_departure(residual)
    bands = np.array([sensor_sd(channel) for channel in CHANNELS])
    return _found(residual, pair.faulted.time_s, bands, first)


def find_surrogate_evidence(
    residual: Array32, time_s: Array, surrogate: Surrogate
) -> tuple[tuple[Evidence, ...], float | None]:
    """The same from the surrogate's finished residual, (n, 23) in divisors.

    The band is twice what healthy flights keep to, and one sensor standard deviation at least; the
    onset is the beginning of the first whole second that any channel spends outside it. Unlike a
    mirror, a network that is taken off what it knows errs in healthy channels too.
    """
    bands = np.maximum(
        USUAL_TIMES * surrogate.usual * surrogate.divisor,
        [sensor_sd(channel) for channel in CHANNELS],
    )
    departed = residual * surrogate.divisor
    return _found(departed, time_s, bands, _first_second_outside(departed, bands))


def _first_second_outside(residual: Array32, bands: Array) -> int | None:
    outside = np.cumsum(np.abs(residual) > bands, axis=0)
    whole: NDArray[np.bool_] = (
        outside[MIN_OUTSIDE_STEPS:] - outside[:-MIN_OUTSIDE_STEPS]
    ) == MIN_OUTSIDE_STEPS
    rows = np.flatnonzero(whole.any(axis=1))
    return int(rows[0]) + 1 if len(rows) else None


def _found(
    residual: Array32, time_s: Array, bands: Array, first: int | None
) -> tuple[tuple[Evidence, ...], float | None]:
    if first is None:
        return (), None
    rows = slice(first, first + EFFECTIVE_STEPS)
    found = [
        evidence
        for index, channel in enumerate(CHANNELS)
        if (
            evidence := _channel_evidence(
                channel, residual[rows, index], time_s[rows], float(bands[index])
            )
        )
    ]
    found.sort(key=lambda evidence: -abs(evidence.sigma))
    return tuple(found), float(time_s[first])


def _channel_evidence(
    channel: Channel, residual: Array32, time_s: Array, band: float
) -> Evidence | None:
    """The evidence in one channel's residual (n,), or None if it stayed within ``band``."""
    outside = np.flatnonzero(np.abs(residual) > band)
    if len(outside) < MIN_OUTSIDE_STEPS:
        return None
    start, stop = int(outside[0]), int(outside[-1])
    value = float(np.mean(residual[start : stop + 1], dtype=np.float64))
    if abs(value) < band:
        return None
    return Evidence(
        channel=channel.name,
        start_s=float(time_s[start]),
        end_s=float(time_s[stop]),
        value=value,
        unit=channel.unit,
        direction="+" if value > 0 else "-",
        sigma=value / sensor_sd(channel),
        onset_s=float(time_s[start]),
    )

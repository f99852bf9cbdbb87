"""When a field flight leaves what healthy ones do: a sequential test on whitened residuals.

For each channel, onset and shape of growth, the statistic is that of the generalised likelihood
ratio (Willsky and Jones 1976): how many standard deviations of healthy noise the residual so far
contains of a disturbance that begins there and grows like that. The aircraft's constant offset is
unknown and projected out. The first time that the statistic of any channel passes `THRESHOLD`, and
stays there, a departure is found; the onset is then the most likely one for all channels that take
part. At that moment the disturbance is still small, so its exact shape matters little.

Flight parameters (speed, altitude, air) are not tested: gusts and the pilot move them most, and no
fault without moving the engine too.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import cholesky, solve_triangular, toeplitz

from core.arrays import Array
from core.channels import CHANNELS, N_CHANNELS
from core.residual.healthy import (
    STEP_S,
    HealthyResidual,
    Kind,
    covariance,
    flown_kind,
    gustiness,
    rotated,
)

BLOCK_STEPS = 120
"""A test looks back over at most 10 minutes; blocks overlap by half, so that every onset lies well
within one."""

HEALTHY_STEPS = 6
"""A flight is taken to be healthy for its first 30 s, from which its offset is first known."""

THRESHOLD = 7.5
"""Standard deviations. Healthy flights of the training seeds stay below 7; see the card."""

CONFIRM_STEPS = 3
"""The statistic has to stay above for another 15 s."""

AWAY = 2.0
"""Over the last 20 s the channel still lies this many standard deviations from where it was before
the onset: what came back, as after a gust, has not left, and is not looked at again."""

SUSTAINED_STEPS = 4
"""To be found, a departure has lasted 20 s."""

TAKES_PART = 4.0
"""A channel takes part in dating the onset from this many standard deviations on."""

SHAPES_S: tuple[tuple[int, float], ...] = (
    (1, 1.0), (1, 30.0), (1, 120.0), (1, 400.0), (2, 60.0), (2, 240.0),
)  # fmt: skip
"""Order and time constant of the growths looked for: steps, heat lags, and what begins slowly."""

TESTED = tuple(
    index
    for index, channel in enumerate(CHANNELS)
    if channel.subsystem != "flight" and not channel.name.startswith("FQty")
)
"""Columns of the channels that are tested. Fuel quantities slosh and tell of no fault."""

_ROUGHNESS_RATIO = 1.5
"""Air that is rougher by this factor is tested as air of another kind."""

_OFFSET_VARIANCES = 1e4
"""Prior variance of a flight's offset, in variances of its noise: as good as unknown."""


@dataclass(frozen=True, slots=True)
class Departure:
    """A departure from what healthy flights do.

    ``onset_s``: its most likely beginning, in [``low_s``, ``high_s``] with about three standard
    deviations' confidence. ``found_s``: the end of the data that it took.
    """

    onset_s: float
    low_s: float
    high_s: float
    found_s: float


def _growths(n: int) -> Array:
    """Disturbances over n steps, (n, shapes, n): by shape, and the step at which each begins."""
    since = np.arange(n)[:, None] - np.arange(n)[None, :]
    time_s = np.maximum(since + 0.5, 0.0) * STEP_S
    grown = []
    for order, tau_s in SHAPES_S:
        decay = np.exp(-time_s / tau_s)
        curve = 1.0 - decay if order == 1 else 1.0 - (1.0 + time_s / tau_s) * decay
        grown.append(np.where(since >= 0, curve, 0.0))
    return np.stack(grown, axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _Whitening:
    """What turns step means into independent numbers of unit variance, by tested channel.

    ``inverse``: (channels, block, block) lower triangular. ``growths``: (channels, block,
    shapes, block) whitened disturbances; ``energy`` their squares summed over time up to each step;
    ``sd`` (channels,) of the noise itself.
    """

    inverse: Array
    growths: Array
    energy: Array
    sd: Array


@lru_cache(maxsize=4)  # 13 MB each
def _whitening(healthy: HealthyResidual, kind: Kind, level: int) -> _Whitening:
    process = healthy.process(kind, _ROUGHNESS_RATIO**level)
    shapes = _growths(BLOCK_STEPS).reshape(BLOCK_STEPS, -1).astype(np.float32)
    inverses, growths, spread = [], [], []
    for column in TESTED:
        noise = covariance(process[column], BLOCK_STEPS)
        whole = toeplitz(noise) + _OFFSET_VARIANCES * noise[0]
        factor = cholesky(whole, lower=True)
        inverse = solve_triangular(factor, np.eye(BLOCK_STEPS), lower=True)
        inverses.append(inverse)
        spread.append(np.sqrt(noise[0]))
        whitened = inverse.astype(np.float32) @ shapes
        growths.append(whitened.reshape(BLOCK_STEPS, len(SHAPES_S), BLOCK_STEPS))
    stacked = np.array(growths)
    energy = np.cumsum(np.square(stacked), axis=1)
    return _Whitening(np.array(inverses), stacked, np.maximum(energy, 1e-9), np.array(spread))


class _Block:
    """The test over one stretch of a flight, step by step."""

    def __init__(self, start: int) -> None:
        self.start = start
        self._length = 0
        self._readings = np.zeros((len(TESTED), BLOCK_STEPS))
        self._overlap = np.zeros((len(TESTED), len(SHAPES_S), BLOCK_STEPS), dtype=np.float32)

    @property
    def is_full(self) -> bool:
        return self._length == BLOCK_STEPS

    def push(self, reading: Array, whitening: _Whitening) -> Array:
        """Take the next step means, (channels,).

        Returns the statistic by channel and onset, (channels, block), the largest of all shapes.
        """
        row = self._length
        if row == 0:
            self._reference = reading
        self._readings[:, row] = reading - self._reference
        self._length += 1
        white = np.einsum(
            "ct,ct->c", whitening.inverse[:, row, : row + 1], self._readings[:, : row + 1]
        )
        self._overlap += white.astype(np.float32)[:, None, None] * whitening.growths[:, row]
        largest: Array = np.abs(self._overlap / np.sqrt(whitening.energy[:, row])).max(axis=1)
        largest[:, row + 1 :] = 0.0  # has not begun yet
        return largest


class DepartureTest:
    """The test as a flight goes on; however it is cut, the same steps give the same answer."""

    def __init__(self, healthy: HealthyResidual) -> None:
        """Before the first step."""
        self._healthy = healthy
        self._steps: list[Array] = []
        self._mirror_range = np.array([[np.inf], [-np.inf]]).repeat(N_CHANNELS, axis=1)
        self._air_so_far: tuple[Kind, int] | None = None
        self._blocks: list[_Block] = []
        self._returned: set[tuple[int, int]] = set()
        self._next_look = HEALTHY_STEPS
        self._above = 0
        self._last: Array | None = None
        self.found: Departure | None = None
        self.largest = 0.0

    def push(self, residual: Array, mirror: Array) -> Departure | None:
        """Take the means of the next 5 s, (23,) each; returns the departure found.

        ``residual`` is not `rotated`. Once found, a departure stays.
        """
        self._steps.append(residual)
        least, most = self._mirror_range
        self._mirror_range = np.array([np.minimum(least, mirror), np.maximum(most, mirror)])
        if self.found is not None or len(self._steps) < HEALTHY_STEPS:
            return self.found
        statistic = self._advanced()
        earlier = len(self._steps) - SUSTAINED_STEPS
        statistic[:, :HEALTHY_STEPS] = 0.0
        for channel, onset in self._returned:
            statistic[channel, onset] = 0.0
        sustained = float(statistic[:, : earlier + 1].max(initial=0.0))
        self.largest = max(self.largest, sustained)
        is_away = sustained > THRESHOLD and self._is_away(statistic[:, : earlier + 1])
        self._above = self._above + 1 if is_away else 0
        self._last = statistic
        if self._above > CONFIRM_STEPS:
            self.found = self._dated(statistic)
        return self.found

    @property
    def n_steps(self) -> int:
        """How many steps were taken."""
        return len(self._steps)

    @property
    def air(self) -> tuple[Kind, float]:
        """The kind of the flight so far, and its gustiness."""
        return flown_kind(self._mirror_range), gustiness(np.array(self._steps))

    def finish(self) -> Departure | None:
        """The departure found, or one that the end of the flight left no time to confirm."""
        if self.found is None and self._above and self._last is not None:
            self.found = self._dated(self._last)
        return self.found

    def _advanced(self) -> Array:
        """The statistic by channel and onset after the last step, (channels, steps)."""
        air = self._air()
        if air != self._air_so_far:
            self._air_so_far, self._blocks = air, []
            first = 0
        else:
            first = len(self._steps) - 1
        whitening = _whitening(self._healthy, *air)
        for number in range(first, len(self._steps) - 1):
            self._pushed(number, whitening)
        return self._pushed(len(self._steps) - 1, whitening)

    def _pushed(self, number: int, whitening: _Whitening) -> Array:
        if number % (BLOCK_STEPS // 2) == 0:
            self._blocks.append(_Block(number))
        self._blocks = [block for block in self._blocks if not block.is_full]
        reading = rotated(self._steps[number][None])[0, list(TESTED)]
        statistic = np.zeros((len(TESTED), number + 1))
        for block in self._blocks:
            found = block.push(reading, whitening)[:, : number + 1 - block.start]
            healthy = HEALTHY_STEPS  # no onset before the block's own offset is known
            part = statistic[:, block.start + healthy :]
            np.maximum(part, found[:, healthy:], out=part)
        return statistic

    def _is_away(self, statistic: Array) -> bool:
        """Whether the most telling channel has not come back since its onset."""
        channel, onset = np.unravel_index(int(statistic.argmax()), statistic.shape)
        mixed = rotated(np.array(self._steps))[:, TESTED[int(channel)]]
        before = np.median(mixed[int(onset) - HEALTHY_STEPS : int(onset)])
        recent = float(np.median(mixed[-SUSTAINED_STEPS:]) - before)
        assert self._air_so_far is not None
        sd = _whitening(self._healthy, *self._air_so_far).sd[int(channel)]
        if abs(recent) > AWAY * sd:
            return True
        self._returned.add((int(channel), int(onset)))
        return False

    def _air(self) -> tuple[Kind, int]:
        """The kind of flight so far, and how rough the air is, seen again each time data double."""
        n = len(self._steps)
        level = self._air_so_far[1] if self._air_so_far else 0
        if n >= self._next_look:
            self._next_look = 2 * n
            roughness = max(gustiness(np.array(self._steps)), 1e-6)
            level = round(np.log(roughness) / np.log(_ROUGHNESS_RATIO))
        return flown_kind(self._mirror_range), level

    def _dated(self, statistic: Array) -> Departure:
        """The onset most likely for all channels that take part, and those nearly as likely."""
        part = statistic.max(axis=1) > TAKES_PART
        likelihood = np.square(statistic[part]).sum(axis=0)
        likelihood[:HEALTHY_STEPS] = 0.0
        best = int(likelihood.argmax())
        likely = np.flatnonzero(likelihood > likelihood[best] - 9.0)
        return Departure(
            onset_s=best * STEP_S,
            low_s=float(likely[0]) * STEP_S,
            high_s=float(likely[-1] + 1) * STEP_S,
            found_s=len(self._steps) * STEP_S,
        )

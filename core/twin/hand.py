"""What nobody commands in the field: the pilot's hand on the controls, and the fuel metering.

Real cruise is flown by hand: the aircraft wanders about its altitude and trades height for speed,
in smooth air as in rough (``assets/facts/real_noise.csv``: 40 ft/min and 3 ft within half a
minute, also in the log whose airspeed is steady to 0.05 kt).
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from core.arrays import Array
from core.clock import TICK_S

CLIMB_WANDER_FPS, CLIMB_WANDER_TAU_S = 4.5, 2.0
"""Pitch corrections, as the climb rate the pilot aims at."""
ALTITUDE_WANDER_FT, ALTITUDE_WANDER_TAU_S = 20.0, 20.0
"""How closely the altitude is watched."""
MIXTURE_WANDER_SD, MIXTURE_WANDER_TAU_S = 0.004, 25.0
"""Metering is never quite steady, and moves all EGT and the fuel flow together."""

_TICKS_A_DRAW = 600
_SETTLING_DRAWS = 3


class Drift(NamedTuple):
    """How far off the hand and the metering are now; ``mixture`` is relative."""

    altitude_ft: float
    climb_fps: float
    mixture: float


STILL = Drift(0.0, 0.0, 0.0)


class Hand:
    """Three slow random walks, tick by tick (0.1 s); the same for a seed however it is cut."""

    def __init__(self, stream: tuple[int, int]) -> None:
        """Walks of that seed, already under way."""
        self._rng = np.random.default_rng(stream)
        self._walks = (
            Wander(ALTITUDE_WANDER_FT, ALTITUDE_WANDER_TAU_S, TICK_S),
            Wander(CLIMB_WANDER_FPS, CLIMB_WANDER_TAU_S, TICK_S),
            Wander(MIXTURE_WANDER_SD, MIXTURE_WANDER_TAU_S, TICK_S),
        )
        for _ in range(_SETTLING_DRAWS):
            self._ahead = self._drawn()

    def next(self) -> Drift:
        """Where the walks are at the next tick."""
        if not self._ahead:
            self._ahead = self._drawn()
        return self._ahead.pop()

    def _drawn(self) -> list[Drift]:
        """The next minute, last tick first."""
        draws = self._rng.standard_normal((3, _TICKS_A_DRAW, 1))
        walked = [walk(draw)[:, 0] for walk, draw in zip(self._walks, draws, strict=True)]
        return [Drift(*row) for row in np.column_stack(walked).tolist()][::-1]


class Wander:
    """A critically damped second-order random walk: white noise through two equal lags.

    ``sd`` may differ from column to column, (k,).
    """

    def __init__(self, sd: float | Array, tau_s: float, step_s: float) -> None:
        """At rest; it has forgotten that after some six ``tau_s``."""
        keep = math.exp(-step_s / tau_s)
        self._kick = np.atleast_1d(sd) * math.sqrt((1.0 - keep**2) ** 3 / (1.0 + keep**2))
        self._feedback = [1.0, -2.0 * keep, keep**2]
        self._state = np.zeros((2, len(self._kick)))

    def __call__(self, draws: Array) -> Array:
        """The walk along standard normal draws, (n, k) -> (n, k)."""
        walked, self._state = lfilter(
            [1.0], self._feedback, draws * self._kick, axis=0, zi=self._state
        )
        wander: Array = walked
        return wander

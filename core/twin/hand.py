"""What nobody commands in the field: the pilot's hand on the controls, and the fuel metering.

Real cruise is flown by hand: the aircraft wanders about its altitude and trades height for speed,
in smooth air as in rough (``../shared/facts/real_noise.csv``: 40 ft/min and 3 ft within half a
minute, also in the log whose airspeed is steady to 0.05 kt).
"""

import math
from dataclasses import dataclass

import numpy as np

from core.fmea.laws import TICK_S
from core.twin.conditions import MIXTURE_WANDER_SD, MIXTURE_WANDER_TAU_S

CLIMB_WANDER_FPS, CLIMB_WANDER_TAU_S = 4.5, 2.0
"""Pitch corrections, as the climb rate the pilot aims at."""
ALTITUDE_WANDER_FT, ALTITUDE_WANDER_TAU_S = 20.0, 20.0
"""How closely the altitude is watched."""

_TICKS_A_DRAW = 1024


@dataclass(frozen=True, slots=True)
class Drift:
    """How far off the hand and the metering are now; ``mixture`` is relative."""

    altitude_ft: float
    climb_fps: float
    mixture: float


STILL = Drift(0.0, 0.0, 0.0)


class Hand:
    """Three slow random walks, tick by tick (0.1 s); the same for a seed however it is cut.

    Altitude and climb are critically damped second-order processes, the mixture a first-order one.
    """

    def __init__(self, stream: tuple[int, int]) -> None:
        """Walks of that seed, each beginning anywhere in its range."""
        self._rng = np.random.default_rng(stream)
        self._altitude = _Smooth(ALTITUDE_WANDER_FT, ALTITUDE_WANDER_TAU_S)
        self._climb = _Smooth(CLIMB_WANDER_FPS, CLIMB_WANDER_TAU_S)
        self._keep = math.exp(-TICK_S / MIXTURE_WANDER_TAU_S)
        self._kick = MIXTURE_WANDER_SD * math.sqrt(1.0 - self._keep**2)
        self._mixture = float(self._rng.normal(0.0, MIXTURE_WANDER_SD))
        self._draws: list[list[float]] = []
        settling_ticks = round(6.0 * ALTITUDE_WANDER_TAU_S / TICK_S)
        for draw in self._rng.standard_normal((settling_ticks, 2)).tolist():
            self._altitude.step(draw[0])
            self._climb.step(draw[1])

    def next(self) -> Drift:
        """Where the walks are at the next tick."""
        if not self._draws:
            self._draws = self._rng.standard_normal((_TICKS_A_DRAW, 3)).tolist()[::-1]
        altitude, climb, mixture = self._draws.pop()
        self._mixture = self._keep * self._mixture + self._kick * mixture
        return Drift(self._altitude.step(altitude), self._climb.step(climb), self._mixture)


class _Smooth:
    """White noise through two equal first-order stages, scaled to a standard deviation."""

    def __init__(self, sd: float, tau_s: float) -> None:
        self._keep = math.exp(-TICK_S / tau_s)
        self._kick = sd * wander_kick(self._keep)
        self._inner = self._outer = 0.0

    def step(self, draw: float) -> float:
        self._inner = self._keep * self._inner + self._kick * draw
        self._outer = self._keep * self._outer + self._inner
        return self._outer


def wander_kick(keep: float) -> float:
    """The white sd that gives two equal stages y' = keep y + u, one after the other, unit sd."""
    return math.sqrt((1.0 - keep**2) ** 3 / (1.0 + keep**2))

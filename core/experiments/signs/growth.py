"""How a failure mode shows and how it grows: its residuals at three severities in one flight.

Paper section 4.1, equation of the paired residual, for the catalogue's pages: lab conditions, so
that what is left between the flights is the fault alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from core.arrays import Array, Array32
from core.fmea.fault import Fault
from core.twin.flight import fly
from core.twin.plan import Plan

GROWTH_SEVERITIES: tuple[float, ...] = (0.3, 0.6, 1.0)
GROWTH_ONSET_S = 60.0
GROWTH_PLAN = Plan(altitude_ft=5000.0, speed_kt=100.0, duration_s=300.0, seed=1)


@dataclass(frozen=True, slots=True, eq=False)
class Growth:
    """One mode on its usual cylinder at each of `GROWTH_SEVERITIES`.

    ``time_s`` is (n,) at 50 Hz; ``residuals`` holds by severity the (n, 23) paired residual in
    channel units.
    """

    mode: str
    time_s: Array
    residuals: Mapping[float, Array32]

    @property
    def severest(self) -> Array32:
        """The residual at the highest severity, (n, 23)."""
        return self.residuals[max(self.residuals)]

    def moved(self, noise_sd: Array, k: int) -> list[int]:
        """At most ``k`` channels that the fault moves, farthest first.

        Distance is the largest departure in units of ``noise_sd`` (23,), at the highest severity;
        what stays within 3 of those does not count as moved.
        """
        peak = np.abs(self.severest).max(axis=0) / noise_sd
        order = np.argsort(-peak, kind="stable")[:k]
        return [int(index) for index in order if peak[index] > 3.0]


def fly_growth(mode: str) -> Growth:
    """Fly `GROWTH_PLAN` healthy, and at each severity; raises `InputError` or `FlightError`.

    In lab conditions one mirror serves all: it shares every pair's sensor noise.
    """
    mirror = fly(GROWTH_PLAN)
    residuals: dict[float, Array32] = {
        severity: fly(GROWTH_PLAN, Fault(mode, severity, GROWTH_ONSET_S)).channels - mirror.channels
        for severity in GROWTH_SEVERITIES
    }
    return Growth(mode, mirror.time_s, residuals)

"""The residual of a flight while it goes on: a reader for each way of forming it."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from core.arrays import Array32
from core.channels import N_CHANNELS
from core.clock import DT_S
from core.residual.controls import controls
from core.residual.departure import Departure, DepartureTest
from core.residual.healthy import STEP_S, STEP_SAMPLES, HealthyResidual, Kind, steps
from core.residual.surrogate import Surrogate, debiased
from core.residual.window import WINDOW_STEPS
from core.twin.plan import Plan
from core.twin.trajectory import Pair

BASELINE_STEPS = WINDOW_STEPS // STEP_SAMPLES
BASELINE_LEAD_STEPS = round(60.0 / STEP_S)
"""How long before a window the baseline of a flight ends that has not departed from anything."""

Formed = Callable[[Pair], Array32]
"""The residual (n, 23) of a block of a pair, as a feature mode forms it."""


class ResidualReader(Protocol):
    """How a diagnosis gets at residuals while a flight goes on."""

    def push(self, block: Pair) -> None:
        """Take the next samples."""

    def window(self, start_row: int, window: Pair) -> Array32:
        """Residuals (1500, 23) of a window that begins at ``start_row`` of what was pushed."""


class MirrorReader:
    """Residuals of an exact mirror, for which a window is enough."""

    def __init__(self, formed: Formed) -> None:
        """Residuals as ``formed``."""
        self.formed = formed

    def push(self, block: Pair) -> None:
        """Nothing to remember."""

    def window(self, start_row: int, window: Pair) -> Array32:
        """Residuals (1500, 23) of the window."""
        return self.formed(window)


class FieldReader:
    """Residuals of a mirror that is only roughly this aircraft in this air.

    They are taken from their mean over 30 s that are held to be healthy: those before the
    departure from what healthy flights do, once one is found. Until then those that ended a
    minute before the window begins: models have seen windows that far from their baseline, and
    healthy flights drift.
    """

    def __init__(self, formed: Formed, healthy: HealthyResidual) -> None:
        """Residuals as ``formed``, held against what ``healthy`` flights do."""
        self.formed = formed
        self.healthy = healthy
        self._test = DepartureTest(healthy)
        self._waiting = np.zeros((0, 2 * N_CHANNELS), dtype=np.float32)
        self._steps = np.zeros((0, 2 * N_CHANNELS))

    def push(self, block: Pair) -> None:
        """Take the next samples."""
        rows = np.concatenate([self.formed(block), block.mirror.channels], axis=1)
        self._waiting = np.concatenate([self._waiting, rows])
        means = steps(self._waiting)
        self._waiting = self._waiting[len(means) * STEP_SAMPLES :]
        self._steps = np.concatenate([self._steps, means])

    def window(self, start_row: int, window: Pair) -> Array32:
        """Residuals (1500, 23) of the window, from their baseline."""
        start = start_row // STEP_SAMPLES
        self._test_until(start + WINDOW_STEPS // STEP_SAMPLES)
        departure = self._test.found
        end = start - BASELINE_LEAD_STEPS
        if departure is not None and start + BASELINE_STEPS >= departure.onset_s / STEP_S:
            end = round(departure.onset_s / STEP_S)
        end = max(end, BASELINE_STEPS)
        usual = self._steps[end - BASELINE_STEPS : end, :N_CHANNELS].mean(axis=0)
        residual: Array32 = self.formed(window) - usual.astype(np.float32)
        return residual

    def departure(self) -> Departure | None:
        """The departure of all that was pushed from what healthy flights do."""
        self._test_until(len(self._steps))
        return self._test.finish()

    @property
    def air(self) -> tuple[Kind, float]:
        """The air of the flight as the test of departure took it."""
        return self._test.air

    def _test_until(self, step: int) -> None:
        """Test up to there and no further, however much has been pushed."""
        for number in range(self._test.n_steps, min(step, len(self._steps))):
            residual, mirror = np.split(self._steps[number], 2)
            self._test.push(residual, mirror)


class KnownReader:
    """Residuals of the surrogate that were computed before."""

    def __init__(self, residual: Array32) -> None:
        """``residual``: (n, 23) of the whole flight."""
        self._residual = residual

    def push(self, block: Pair) -> None:
        """Nothing to compute."""

    def window(self, start_row: int, window: Pair) -> Array32:
        """Residuals (1500, 23) of the window."""
        return self._residual[start_row : start_row + WINDOW_STEPS]

    def whole(self) -> Array32:
        """Residuals (n, 23) of the flight."""
        return self._residual


class SurrogateReader:
    """Residuals of the surrogate, which follows the flight; the mirror is never looked at."""

    def __init__(self, surrogate: Surrogate, plan: Plan) -> None:
        """Residuals of a flight of which ``plan`` is what was commanded."""
        self._plan = plan
        self._stream = surrogate.stream()
        self._smoothed: list[Array32] = []

    def push(self, block: Pair) -> None:
        """Take the next samples."""
        flight = block.faulted
        if not len(flight):
            return
        commanded = controls(self._plan, round(float(flight.time_s[0]) / DT_S), len(flight))
        self._smoothed.append(self._stream.push(flight.channels, commanded))

    def window(self, start_row: int, window: Pair) -> Array32:
        """Residuals (1500, 23) of the window."""
        return self.whole()[start_row : start_row + WINDOW_STEPS]

    def whole(self) -> Array32:
        """Residuals (n, 23) of what was pushed."""
        self._smoothed = [np.concatenate(self._smoothed)]
        return debiased(self._smoothed[0])

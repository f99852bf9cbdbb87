"""An aircraft that flies straight on, without trim, air or autopilot, and notes what is asked."""

from collections.abc import Callable

import numpy as np

from core.arrays import Array
from core.clock import DT_S, STEPS_PER_TICK
from core.fmea.laws import Drivers
from core.fmea.powerplant import HEALTHY, EngineFactors
from core.twin.aircraft import drivers_at
from core.twin.conditions import Setting
from core.twin.plan import Leg, Plan
from core.twin.trajectory import GROUND_FT, STATE_INDEX, STATE_NAMES

CRUISE = {
    "qbar_psf": 30.0, "rpm": 2400.0, "map_inhg": 22.0, "oat_degc": 5.0, "norm_ac_g": 1.0,
    "fuel_flow_gph": 8.0, "fuel_left_gal": 20.0, "fuel_right_gal": 20.0, "air_fuel_ratio": 13.8,
}  # fmt: skip


class FakeAircraft:
    """Holds its plan's altitude and speed, or sinks; only its engine speed feels a correction.

    ``asked``: what was asked of it, as (what, tick) in order.
    """

    sink_fps = 0.0

    def __init__(self, plan: Plan, setting: Setting) -> None:
        """Level at the plan's altitude."""
        self.asked: list[tuple[str, int]] = []
        self._flown = 0
        self._factors = HEALTHY
        self._cruise = np.zeros(len(STATE_NAMES))
        start = {"altitude_ft": plan.altitude_ft, "ias_kt": plan.speed_kt, **CRUISE}
        for name, value in start.items():
            self._cruise[STATE_INDEX[name]] = value

    def fly(self, n_steps: int, on_tick: Callable[[Drivers], EngineFactors] | None = None) -> Array:
        """Fly straight on."""
        states = np.tile(self._cruise, (n_steps, 1))
        flown_s = (self._flown + np.arange(n_steps)) * DT_S
        states[:, STATE_INDEX["altitude_ft"]] -= self.sink_fps * flown_s
        on_ground = states[:, STATE_INDEX["altitude_ft"]] <= GROUND_FT
        if on_ground.any():
            states = states[: on_ground.argmax() + 1]
        for row in range(0, len(states), STEPS_PER_TICK):
            if on_tick is not None:
                self._factors = on_tick(drivers_at(states[row]))
            states[row : row + STEPS_PER_TICK, STATE_INDEX["rpm"]] *= self._factors.work
        self._flown += len(states)
        return states

    def correct(self, factors: EngineFactors) -> None:
        """Run with these corrections."""
        self._factors = factors

    def set_targets(self, leg: Leg, tick: int) -> None:
        """Note it."""
        self.asked.append(("targets", tick))

    def guard(self, tick: int) -> None:
        """Note it."""
        self.asked.append(("guard", tick))

    def recover(self, tick: int) -> None:
        """Note it."""
        self.asked.append(("recover", tick))


class Sinking(FakeAircraft):
    """One that sinks 100 ft in a second."""

    sink_fps = 100.0

"""The contract of an aircraft: what the twin owes those who fly one, without a simulator.

`core.twin.jsbsim_aircraft` flies a Cessna 172P in JSBSim. Tests that are not about flight use one
that flies straight on (``tests/support/fake_aircraft.py``).
"""

from collections.abc import Callable, Sequence
from typing import Protocol

from core.arrays import Array
from core.clock import STEPS_PER_TICK
from core.fmea.laws import Drivers
from core.fmea.powerplant import EngineFactors
from core.twin.conditions import Setting
from core.twin.plan import Leg, Plan
from core.twin.trajectory import STATE_INDEX


class Aircraft(Protocol):
    """One aircraft in flight, under autopilot on the targets of its plan.

    Time is counted in steps of `core.clock.DT_S`, and in ticks of `STEPS_PER_TICK` of them for what
    changes the flight; ``tick`` is always the one that is flown next. However a flight is cut into
    calls of `fly`, it is the same flight, bit for bit.
    """

    def fly(self, n_steps: int, on_tick: Callable[[Drivers], EngineFactors] | None = None) -> Array:
        """Fly ``n_steps``, whole ticks, and return the states before each step, (n, states).

        States are those of `core.twin.trajectory.STATE_NAMES`. There are fewer than ``n_steps`` if
        the aircraft comes down to the ground: the last is where it meets it. ``on_tick`` is called
        at every tick with what drives faults, and returns how the engine runs until the next.
        """

    def correct(self, factors: EngineFactors) -> None:
        """Have the engine run with these corrections until the next call or tick."""

    def set_targets(self, leg: Leg, tick: int) -> None:
        """Take up new targets at ``tick``, after those that the plan has there."""

    def guard(self, tick: int) -> None:
        """Keep the autopilot's loops from winding up from ``tick`` on: somebody acts."""

    def recover(self, tick: int) -> None:
        """Fly on with a repaired engine from ``tick`` on; implies `guard`."""


NewAircraft = Callable[[Plan, Setting], Aircraft]
"""Gives an aircraft trimmed level for a plan in a setting; raises `FlightError` if that fails."""

_RPM, _QBAR, _IAS = (STATE_INDEX[name] for name in ("rpm", "qbar_psf", "ias_kt"))


def drivers_at(row: Sequence[float]) -> Drivers:
    """What drives faults at one sample, given its states."""
    return Drivers(row[_RPM], row[_QBAR], row[_IAS])


def drivers_along(states: Array) -> list[Drivers]:
    """What drove faults at each tick of a flight already flown, states (n, states)."""
    return [drivers_at(row) for row in states[::STEPS_PER_TICK].tolist()]

"""Flying a plan: one trajectory, or the faulted flight beside its mirror (paper section 3.3)."""

import numpy as np
from numpy.typing import NDArray

from core.fmea.catalogue import catalogue
from core.fmea.defects import N_DEFECTS
from core.fmea.effects import Effects, effects_of, healthy
from core.fmea.fault import Fault
from core.fmea.injection import FaultState
from core.fmea.laws import TICK_S, Drivers
from core.fmea.powerplant import EngineFactors, engine_factors
from core.twin.aircraft import STEPS_PER_TICK, Aircraft, drivers_along
from core.twin.noise import SensorNoise
from core.twin.plan import DT_S, Plan
from core.twin.sensors import SensorSynthesiser
from core.twin.trajectory import Pair, Trajectory

Array = NDArray[np.float64]

_NOMINAL = Fault("nominal")


class PairFlight:
    """A pair in flight, advanced block by block; blocks of any size give the same bytes.

    The faulted aircraft is flown only where the fault reaches the engine. Otherwise its path is
    the mirror's, and only the fault's effects and the sensors are computed for it.
    """

    def __init__(self, plan: Plan, fault: Fault) -> None:
        """Trim both aircraft; raises `InputError` (onset) or `FlightError` (no trim)."""
        fault.check_against(plan)
        self.plan, self.fault = plan, fault
        self._done = 0
        self._noise = SensorNoise(plan.seed)
        self._mirror = Aircraft(plan)
        self._mirror_sensors = SensorSynthesiser(plan)
        self._is_faulted = fault.mode != "nominal" and fault.severity > 0.0
        if self._is_faulted:
            flies_apart = catalogue()[fault.mode].moves_engine
            self._faulted = Aircraft(plan) if flies_apart else None
            self._faulted_sensors = SensorSynthesiser(plan)
            self._state = FaultState(fault, plan.seed)

    @property
    def progress(self) -> float:
        """Share of the flight flown, 0-1."""
        return self._done / self.plan.n_steps

    def advance(self, seconds: float) -> Pair | None:
        """Fly on for ``seconds`` (in whole ticks of 0.1 s); None once the plan has been flown."""
        left = self.plan.n_steps - self._done
        n = min(max(round(seconds / TICK_S), 1) * STEPS_PER_TICK, left)
        if n <= 0:
            return None
        time_s = (self._done + np.arange(n)) * DT_S
        noise = self._noise.next(n)
        states = self._mirror.fly(n)
        channels = self._mirror_sensors.read(states, healthy(n), noise)
        mirror = Trajectory(time_s, states, channels.astype(np.float32))
        self._done += n
        if not self._is_faulted:
            return Pair(mirror, mirror)
        faulted_states, effects = self._fly_faulted(n, states)
        channels = self._faulted_sensors.read(faulted_states, effects, noise)
        return Pair(Trajectory(time_s, faulted_states, channels.astype(np.float32)), mirror)

    def _fly_faulted(self, n: int, mirror_states: Array) -> tuple[Array, Effects]:
        defects: list[Array] = []

        def on_tick(drivers: Drivers) -> EngineFactors:
            defects.append(self._state.step(drivers))
            return engine_factors(defects[-1])

        if self._faulted is not None:
            states = self._faulted.fly(n, on_tick)
        else:
            states = mirror_states
            defects.extend(self._state.step(drivers) for drivers in drivers_along(states))
        if not self._state.is_active:
            return states, healthy(n)
        held = np.repeat(np.array(defects).reshape(-1, N_DEFECTS), STEPS_PER_TICK, axis=0)[:n]
        return states, effects_of(held)


def fly_pair(plan: Plan, fault: Fault) -> Pair:
    """The whole pair; raises `InputError` or `FlightError`."""
    flight = PairFlight(plan, fault)
    pair = flight.advance(plan.duration_s)
    assert pair is not None  # a plan lasts at least 30 s
    return pair


def fly(plan: Plan, fault: Fault = _NOMINAL) -> Trajectory:
    """One trajectory, faulted if ``fault`` is; raises `InputError` or `FlightError`."""
    return fly_pair(plan, fault).faulted

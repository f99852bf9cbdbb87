"""Flying a plan: one trajectory, or the faulted flight beside its mirror (paper section 3.3)."""

from array import array

import numpy as np
from numpy.typing import NDArray

from core.fmea.catalogue import catalogue
from core.fmea.defects import N_DEFECTS
from core.fmea.effects import Effects, effects_of, healthy
from core.fmea.fault import Fault
from core.fmea.injection import FaultState
from core.fmea.laws import TICK_S, Drivers
from core.fmea.powerplant import HEALTHY, EngineFactors, engine_factors
from core.twin.aircraft import STEPS_PER_TICK, Aircraft, drivers_along
from core.twin.avionics import Avionics
from core.twin.conditions import Setting, flown, mirrored
from core.twin.noise import SensorNoise
from core.twin.plan import DT_S, Plan
from core.twin.sensors import SensorSynthesiser
from core.twin.trajectory import Pair, Trajectory

Array = NDArray[np.float64]

NOMINAL = Fault("nominal")


class _Flight:
    """One aircraft, its fault and its sensors; blocks of any size give the same bytes."""

    def __init__(
        self, plan: Plan, fault: Fault, setting: Setting, *, in_formation: bool = False
    ) -> None:
        """Trim for the plan; ``in_formation`` takes its path from another flight instead."""
        self._aircraft = None if in_formation else Aircraft(plan, setting)
        self._sensors = SensorSynthesiser(setting)
        self._avionics = Avionics(setting)
        is_faulted = fault.mode != "nominal" and fault.severity > 0.0
        self._fault = FaultState(fault, plan.seed) if is_faulted else None

    def advance(self, time_s: Array, noise: Array, path: Array | None = None) -> Trajectory:
        """Fly the samples at ``time_s`` (n,) under ``noise`` (n, 23), along ``path`` if given."""
        n = len(time_s)
        if self._fault is None:
            states, effects = self._own().fly(n) if path is None else path, healthy(n)
        else:
            states, effects = self._fly_faulted(n, self._fault, path)
        channels = self._avionics.log(self._sensors.read(states, effects, noise))
        return Trajectory(time_s, states, channels.astype(np.float32))

    def _own(self) -> Aircraft:
        assert self._aircraft is not None  # a flight in formation is always given its path
        return self._aircraft

    def _fly_faulted(self, n: int, fault: FaultState, path: Array | None) -> tuple[Array, Effects]:
        raw = array("d")

        def on_tick(drivers: Drivers) -> EngineFactors:
            defects = fault.step(drivers)
            raw.fromlist(defects)
            return engine_factors(defects) if fault.is_active else HEALTHY

        if path is None and fault.reaches_engine:
            states = self._own().fly(n, on_tick)
        else:
            states = self._own().fly(n) if path is None else path
            for drivers in drivers_along(states):
                raw.fromlist(fault.step(drivers))
        if not fault.is_active:
            return states, healthy(n)
        defects = np.frombuffer(raw).reshape(-1, N_DEFECTS)
        return states, effects_of(defects).held(STEPS_PER_TICK, n)


class _Clock:
    """Cuts a plan into blocks of whole ticks."""

    def __init__(self, plan: Plan) -> None:
        self._n_steps, self._done = plan.n_steps, 0

    @property
    def progress(self) -> float:
        return self._done / self._n_steps

    def next(self, seconds: float) -> Array | None:
        """Times (n,) of the next block; None at the end of the plan."""
        n = min(max(round(seconds / TICK_S), 1) * STEPS_PER_TICK, self._n_steps - self._done)
        if n <= 0:
            return None
        time_s: Array = (self._done + np.arange(n, dtype=np.float64)) * DT_S
        self._done += n
        return time_s


class PairFlight:
    """A pair in flight, advanced block by block; blocks of any size give the same bytes.

    In lab the faulted aircraft is flown only where the fault reaches the engine. Otherwise its
    path is the mirror's, and only the fault's effects and the sensors are computed for it.
    """

    def __init__(self, plan: Plan, fault: Fault) -> None:
        """Trim both aircraft; raises `InputError` (onset) or `FlightError` (no trim)."""
        fault.check_against(plan)
        self.plan, self.fault = plan, fault
        self._clock = _Clock(plan)
        setting, mirror_setting = flown(plan), mirrored(plan)
        is_field = setting.is_field
        reaches_engine = catalogue()[fault.mode].moves_engine and fault.severity > 0.0
        self._flies_apart = reaches_engine or is_field
        self._noise = SensorNoise(setting)
        self._mirror_noise = SensorNoise(mirror_setting) if is_field else None
        self._mirror = _Flight(plan, NOMINAL, mirror_setting)
        self._faulted = _Flight(plan, fault, setting, in_formation=not self._flies_apart)

    @property
    def progress(self) -> float:
        """Share of the flight flown, 0-1."""
        return self._clock.progress

    def advance(self, seconds: float) -> Pair | None:
        """Fly on for ``seconds`` (in whole ticks of 0.1 s); None once the plan has been flown."""
        time_s = self._clock.next(seconds)
        if time_s is None:
            return None
        noise = self._noise.next(len(time_s))
        mirror_noise = self._mirror_noise.next(len(time_s)) if self._mirror_noise else noise
        mirror = self._mirror.advance(time_s, mirror_noise)
        path = None if self._flies_apart else mirror.states
        return Pair(self._faulted.advance(time_s, noise, path), mirror)


BLOCK_S = 300.0
"""Whole flights are computed in blocks of this length, to keep memory flat on long ones."""


def fly_pair(plan: Plan, fault: Fault) -> Pair:
    """The whole pair; raises `InputError` or `FlightError`."""
    flight = PairFlight(plan, fault)
    blocks: list[Pair] = []
    while (block := flight.advance(BLOCK_S)) is not None:
        blocks.append(block)
    return Pair(
        Trajectory.joined([block.faulted for block in blocks]),
        Trajectory.joined([block.mirror for block in blocks]),
    )


def fly(plan: Plan, fault: Fault = NOMINAL) -> Trajectory:
    """One trajectory without its mirror; raises `InputError` or `FlightError`."""
    fault.check_against(plan)
    setting, clock = flown(plan), _Clock(plan)
    flight, noise = _Flight(plan, fault, setting), SensorNoise(setting)
    blocks: list[Trajectory] = []
    while (time_s := clock.next(BLOCK_S)) is not None:
        blocks.append(flight.advance(time_s, noise.next(len(time_s))))
    return Trajectory.joined(blocks)

"""Flying a plan: one trajectory, or the faulted flight beside its mirror (paper section 3.3)."""

from array import array
from collections.abc import Iterable

import numpy as np

from core.arrays import Array
from core.clock import DT_S, STEPS_PER_TICK, TICK_S
from core.errors import InputError
from core.fmea.catalogue import catalogue
from core.fmea.defects import N_DEFECTS
from core.fmea.effects import Effects, effects_of, healthy
from core.fmea.fault import Fault
from core.fmea.injection import FaultState
from core.fmea.laws import Drivers
from core.fmea.powerplant import HEALTHY, EngineFactors, engine_factors
from core.twin.actions import Action, Repair, SetFault, SetTarget, at_tick, in_order, tick_of
from core.twin.aircraft import Aircraft, NewAircraft, drivers_along
from core.twin.avionics import Avionics
from core.twin.conditions import Setting, flown, mirrored
from core.twin.jsbsim_aircraft import JsbsimAircraft
from core.twin.noise import SensorNoise
from core.twin.plan import Leg, Plan
from core.twin.sensors import SensorSynthesiser
from core.twin.trajectory import Pair, Trajectory

NOMINAL = Fault("nominal")


class _Flight:
    """One aircraft, its fault and its sensors; blocks of any size give the same bytes."""

    def __init__(
        self,
        plan: Plan,
        fault: Fault,
        setting: Setting,
        new_aircraft: NewAircraft = JsbsimAircraft,
        *,
        in_formation: bool = False,
    ) -> None:
        """Trim for the plan; ``in_formation`` takes its path from another flight instead."""
        self._aircraft: Aircraft | None = None if in_formation else new_aircraft(plan, setting)
        self._sensors = SensorSynthesiser(setting)
        self._avionics = Avionics(setting)
        self._seed = plan.seed
        self._fault = self._state_of(fault, 0)

    def _state_of(self, fault: Fault, tick: int) -> FaultState | None:
        is_faulted = fault.mode != "nominal" and fault.severity > 0.0
        return FaultState(fault, self._seed, tick) if is_faulted else None

    def set_targets(self, leg: Leg, tick: int) -> None:
        """Take up new targets at ``tick``, flown next; in formation the path brings them."""
        if self._aircraft is not None:
            self._aircraft.set_targets(leg, tick)

    def change(self, fault: Fault, tick: int) -> None:
        """Have that fault and no other from ``tick`` on, which is flown next."""
        had = self._fault
        was_broken = had is not None and had.is_active and had.reaches_engine
        if had is not None and had.is_active and fault.severity > 0.0 and _same(had.fault, fault):
            had.regrade(fault.severity)
            if self._aircraft is not None and was_broken:
                self._aircraft.guard(tick)
            return
        self._fault = self._state_of(fault, tick)
        if self._aircraft is not None:
            self._aircraft.correct(HEALTHY)
            if was_broken:
                self._aircraft.recover(tick)

    def advance(self, time_s: Array, noise: Array, path: Array | None = None) -> Trajectory:
        """Fly the samples at ``time_s`` (n,) under ``noise`` (n, 23), along ``path`` if given.

        Fewer come back from a flight that meets the ground: the last is where it does.
        """
        if self._fault is None:
            states = self._own().fly(len(time_s)) if path is None else path
            effects = healthy(len(states))
        else:
            states, effects = self._fly_faulted(len(time_s), self._fault, path)
        n = len(states)
        channels = self._avionics.log(self._sensors.read(states, effects, noise[:n]))
        return Trajectory(time_s[:n], states, channels.astype(np.float32))

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
            return states, healthy(len(states))
        defects = np.frombuffer(raw).reshape(-1, N_DEFECTS)
        return states, effects_of(defects).held(STEPS_PER_TICK, len(states))


def _same(one: Fault, other: Fault) -> bool:
    """Whether two faults break the same thing."""
    return (one.mode, one.target_cylinder) == (other.mode, other.target_cylinder)


class _Clock:
    """Cuts a plan into blocks of whole ticks; stops where the flight meets the ground."""

    def __init__(self, plan: Plan) -> None:
        self._n_steps, self._done = plan.n_steps, 0
        self.ground_s: float | None = None

    @property
    def progress(self) -> float:
        return 1.0 if self.ground_s is not None else self._done / self._n_steps

    def fell(self, short_by: int, ground_s: float | None) -> None:
        """The last block ended ``short_by`` samples early, for it met the ground."""
        self._done -= short_by
        self.ground_s = ground_s

    @property
    def tick(self) -> int:
        """The tick that comes next."""
        return self._done // STEPS_PER_TICK

    def next(self, ticks: int) -> Array | None:
        """Times (n,) of the next block; None at the end of the flight."""
        if self.ground_s is not None:
            return None
        n = min(ticks * STEPS_PER_TICK, self._n_steps - self._done)
        if n <= 0:
            return None
        time_s: Array = (self._done + np.arange(n, dtype=np.float64)) * DT_S
        self._done += n
        return time_s


def _ticks(seconds: float) -> int:
    return max(round(seconds / TICK_S), 1)


class PairFlight:
    """A pair in flight, advanced block by block; blocks of any size give the same bytes.

    In lab the faulted aircraft is flown only where a fault reaches the engine. Otherwise its
    path is the mirror's, and only the fault's effects and the sensors are computed for it.
    """

    def __init__(
        self,
        plan: Plan,
        fault: Fault,
        actions: Iterable[Action] = (),
        *,
        live: bool = False,
        new_aircraft: NewAircraft = JsbsimAircraft,
    ) -> None:
        """Trim both aircraft; raises `InputError` (onset, action) or `FlightError` (no trim).

        ``live``: more may come by `act`, which costs a second flight whatever the fault.
        """
        fault.check_within(plan.duration_s)
        self.plan, self.fault = plan, fault
        self._to_come = list(in_order(actions, plan))
        self._clock = _Clock(plan)
        setting, mirror_setting = flown(plan), mirrored(plan)
        is_field = setting.is_field
        faults = [fault, *(each.fault for each in self._to_come if isinstance(each, SetFault))]
        self._flies_apart = live or is_field or any(map(_reaches_engine, faults))
        self._is_live = live
        self._noise = SensorNoise(setting)
        self._mirror_noise = SensorNoise(mirror_setting) if is_field else None
        self._mirror = _Flight(plan, NOMINAL, mirror_setting, new_aircraft)
        self._faulted = _Flight(
            plan, fault, setting, new_aircraft, in_formation=not self._flies_apart
        )

    @property
    def progress(self) -> float:
        """Share of the flight flown, 0-1; 1 also where it has met the ground."""
        return self._clock.progress

    @property
    def ground_s(self) -> float | None:
        """When one of the two met the ground, which ended the flight; None if neither did."""
        return self._clock.ground_s

    @property
    def flown_s(self) -> float:
        """Seconds flown; what is done now takes effect there."""
        return round(self._clock.tick * TICK_S, 1)

    def act(self, action: Action) -> Action:
        """Do something at its time, or now if that has passed; returns it at the time it happens.

        Raises `InputError` if the flight is over by then.
        """
        if not self._is_live:
            raise ValueError("this flight is not live")
        if self.ground_s is not None:
            raise InputError("time_s", f"the flight met the ground at {self.ground_s:.1f} s")
        happens = at_tick(action, max(tick_of(action), self._clock.tick))
        self._to_come = list(in_order([*self._to_come, happens], self.plan))
        return happens

    def advance(self, seconds: float) -> Pair | None:
        """Fly on for ``seconds`` (in whole ticks of 0.1 s); None once the flight is over.

        It is over when the plan has been flown, or where one of the two meets the ground.
        """
        until = self._clock.tick + _ticks(seconds)
        blocks: list[Pair] = []
        while (now := self._clock.tick) < until:
            while self._to_come and tick_of(self._to_come[0]) <= now:
                self._do(self._to_come.pop(0), now)
            pause = min(until, tick_of(self._to_come[0])) if self._to_come else until
            time_s = self._clock.next(pause - now)
            if time_s is None:
                break
            blocks.append(self._fly(time_s))
        return Pair.joined(blocks) if blocks else None

    def _do(self, action: Action, tick: int) -> None:
        """Set the same targets for both pilots; only the faulted engine is ever touched."""
        match action:
            case SetTarget():
                self._mirror.set_targets(action.leg, tick)
                self._faulted.set_targets(action.leg, tick)
            case SetFault():
                self._faulted.change(action.fault, tick)
            case Repair():
                self._faulted.change(NOMINAL, tick)

    def _fly(self, time_s: Array) -> Pair:
        noise = self._noise.next(len(time_s))
        mirror_noise = self._mirror_noise.next(len(time_s)) if self._mirror_noise else noise
        mirror = self._mirror.advance(time_s, mirror_noise)
        path = None if self._flies_apart else mirror.states
        faulted = self._faulted.advance(time_s, noise, path)
        both = Pair(faulted, mirror)[: min(len(faulted), len(mirror))]
        self._clock.fell(len(time_s) - len(both.mirror), both.ground_s)
        return both


def _reaches_engine(fault: Fault) -> bool:
    return catalogue()[fault.mode].moves_engine and fault.severity > 0.0


BLOCK_S = 300.0
"""Whole flights are computed in blocks of this length, to keep memory flat on long ones."""


def fly_pair(plan: Plan, fault: Fault, actions: Iterable[Action] = ()) -> Pair:
    """The whole pair, up to the ground if one meets it; raises `InputError` or `FlightError`."""
    flight = PairFlight(plan, fault, actions)
    blocks: list[Pair] = []
    while (block := flight.advance(BLOCK_S)) is not None:
        blocks.append(block)
    return Pair.joined(blocks)


def fly(plan: Plan, fault: Fault = NOMINAL) -> Trajectory:
    """One trajectory without its mirror, up to the ground; raises `InputError` or `FlightError`."""
    fault.check_within(plan.duration_s)
    setting, clock = flown(plan), _Clock(plan)
    flight, noise = _Flight(plan, fault, setting), SensorNoise(setting)
    blocks: list[Trajectory] = []
    while (time_s := clock.next(_ticks(BLOCK_S))) is not None:
        blocks.append(flight.advance(time_s, noise.next(len(time_s))))
        clock.fell(len(time_s) - len(blocks[-1]), blocks[-1].ground_s)
    return Trajectory.joined(blocks)

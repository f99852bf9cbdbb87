"""Layer 1: how a defect grows with time (paper section 3.2, the four degradation models).

A law turns elapsed time and what the engine does (`Drivers`) into a level, 0 at onset and about 1
when fully grown. Laws are stepped at `TICK_S`; each is a small state machine with its equation in
the docstring. ``n`` is engine speed, 2450 rpm its reference; ``q`` dynamic pressure, 33.9 psf
(100 KCAS) its reference.
"""

import math
from dataclasses import dataclass, fields
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from core.clock import TICK_S
from core.errors import InputError

REFERENCE_RPM = 2450.0
REFERENCE_QBAR_PSF = 33.9


class Drivers(NamedTuple):
    """What the engine and the air do at a tick, as far as a defect can feel it."""

    rpm: float
    qbar_psf: float
    ias_kt: float


class Law(Protocol):
    """The state of one growing defect."""

    def step(self, drivers: Drivers) -> float:
        """Advance by `TICK_S` and return the level."""
        ...


class LawSpec(Protocol):
    """The parameters of a law, as read from the catalogue."""

    def start(self, rng: np.random.Generator) -> Law:
        """A fresh state at onset; ``rng`` feeds the laws that are random."""
        ...


def _lag(tau_s: float) -> float:
    """Share of the way that a first-order lag goes in one tick."""
    return -math.expm1(-TICK_S / tau_s)


@dataclass(frozen=True, slots=True)
class ExponentialApproach:
    """Fast at first, then settling: dx/dt = (n/2450)^k (1 - x) / tau.

    With ``accumulates_over_s`` = T the level is the running integral of x over T: a rate that
    settles and a loss that keeps adding up.
    """

    kind: ClassVar[str] = "exponential"
    tau_s: float
    rpm_exponent: float = 0.0
    accumulates_over_s: float = 0.0

    def start(self, rng: np.random.Generator) -> "_Exponential":
        """A fresh state."""
        return _Exponential(self)


class _Exponential:
    def __init__(self, spec: ExponentialApproach) -> None:
        self.spec, self.level, self.total = spec, 0.0, 0.0
        self.share = _lag(spec.tau_s)

    def step(self, drivers: Drivers) -> float:
        spec = self.spec
        self.level += self.share * (1.0 - self.level)
        if not spec.accumulates_over_s:
            return self.level
        rate = self.level * (drivers.rpm / REFERENCE_RPM) ** spec.rpm_exponent
        self.total += rate * TICK_S / spec.accumulates_over_s
        return self.total


@dataclass(frozen=True, slots=True)
class LinearAccumulation:
    """Uniform wear or leakage: x = min(t / T, 1), hunting as x (1 + h sin 2 pi f t)."""

    kind: ClassVar[str] = "linear"
    duration_s: float
    hunt_hz: float = 0.0
    hunt_share: float = 0.0

    def start(self, rng: np.random.Generator) -> "_Linear":
        """A fresh state."""
        return _Linear(self)


class _Linear:
    def __init__(self, spec: LinearAccumulation) -> None:
        self.spec, self.ticks = spec, 0

    def step(self, drivers: Drivers) -> float:
        self.ticks += 1
        elapsed_s, spec = self.ticks * TICK_S, self.spec
        level = min(elapsed_s / spec.duration_s, 1.0)
        if spec.hunt_share:
            level *= 1.0 + spec.hunt_share * math.sin(2.0 * math.pi * spec.hunt_hz * elapsed_s)
        return level


@dataclass(frozen=True, slots=True)
class FatigueAccumulation:
    """Damage that speeds itself up: da/dt = C (n/2450)^3 (1 + 3a), a = 1 after T at 2450 rpm.

    The level is a times (q/q0)^``pressure_exponent`` (pressure springs a crack open). With
    ``releases`` it is a staircase: the share of those damages already passed (rivets letting go).
    With ``breakthrough`` b it stays at 15 % of a until a = b, then approaches 1 with
    ``breakthrough_tau_s``. With ``burst_share`` s random bursts lift it by s.
    """

    kind: ClassVar[str] = "fatigue"
    duration_s: float
    pressure_exponent: float = 0.0
    releases: tuple[float, ...] = ()
    breakthrough: float = 0.0
    breakthrough_tau_s: float = 15.0
    burst_share: float = 0.0
    burst_s: float = 4.0
    quiet_s: float = 6.0

    def start(self, rng: np.random.Generator) -> "_Fatigue":
        """A fresh state."""
        return _Fatigue(self, rng)


class _Fatigue:
    def __init__(self, spec: FatigueAccumulation, rng: np.random.Generator) -> None:
        self.spec, self.rng = spec, rng
        self.damage, self.broken = 0.0, 0.0
        self.rate = math.log(4.0) / 3.0 / spec.duration_s * TICK_S
        self.bursting, self.switch_in_s = False, spec.quiet_s

    def step(self, drivers: Drivers) -> float:
        spec = self.spec
        speed = (drivers.rpm / REFERENCE_RPM) ** 3
        self.damage = min(self.damage + self.rate * speed * (1.0 + 3.0 * self.damage), 1.0)
        level = self.damage
        if spec.releases:
            level = sum(level >= release for release in spec.releases) / len(spec.releases)
        if spec.breakthrough:
            level = self._broken_through()
        if spec.pressure_exponent:
            level *= (drivers.qbar_psf / REFERENCE_QBAR_PSF) ** spec.pressure_exponent
        if spec.burst_share and self._burst():
            level *= 1.0 + spec.burst_share
        return level

    def _broken_through(self) -> float:
        if self.damage >= self.spec.breakthrough:
            self.broken += _lag(self.spec.breakthrough_tau_s) * (1.0 - self.broken)
        return max(self.broken, 0.15 * self.damage)

    def _burst(self) -> bool:
        self.switch_in_s -= TICK_S
        if self.switch_in_s <= 0.0:
            self.bursting = not self.bursting
            mean_s = self.spec.burst_s if self.bursting else self.spec.quiet_s
            self.switch_in_s = mean_s * float(self.rng.uniform(0.5, 1.5))
        return self.bursting


@dataclass(frozen=True, slots=True)
class StepTrigger:
    """Threshold-triggered: lets go at onset, x = 1 - exp(-t / sag), at once where sag is 0."""

    kind: ClassVar[str] = "step"
    sag_tau_s: float = 0.0

    def start(self, rng: np.random.Generator) -> "_Step":
        """A fresh state."""
        return _Step(self)


class _Step:
    def __init__(self, spec: StepTrigger) -> None:
        self.level = 0.0
        self.share = _lag(spec.sag_tau_s) if spec.sag_tau_s else 1.0

    def step(self, drivers: Drivers) -> float:
        self.level += self.share * (1.0 - self.level)
        return self.level


@dataclass(frozen=True, slots=True)
class FlapTrigger:
    """Threshold-triggered with hysteresis: a loosening flap blown open by the plenum pressure.

    Loosening l = 1 - exp(-t / tau). The flap opens above ``opens_at_kias`` - 8 l and re-seats
    ``reseats_lower_kt`` below that; it takes 4 s to move. Level l (seep + (1 - seep) open).
    """

    kind: ClassVar[str] = "flap"
    loosening_tau_s: float
    opens_at_kias: float
    reseats_lower_kt: float
    seeping_share: float

    def start(self, rng: np.random.Generator) -> "_Flap":
        """A fresh state."""
        return _Flap(self)


class _Flap:
    LOOSENED_KT = 8.0
    MOVING_TAU_S = 4.0

    def __init__(self, spec: FlapTrigger) -> None:
        self.spec, self.loose, self.open, self.blown = spec, 0.0, 0.0, False
        self.share = _lag(spec.loosening_tau_s)

    def step(self, drivers: Drivers) -> float:
        spec = self.spec
        self.loose += self.share * (1.0 - self.loose)
        opens_at_kt = spec.opens_at_kias - self.LOOSENED_KT * self.loose
        threshold_kt = opens_at_kt - spec.reseats_lower_kt if self.blown else opens_at_kt
        self.blown = drivers.ias_kt > threshold_kt
        self.open += _lag(self.MOVING_TAU_S) * (float(self.blown) - self.open)
        return self.loose * (spec.seeping_share + (1.0 - spec.seeping_share) * self.open)


@dataclass(frozen=True, slots=True)
class GateTrigger:
    """Threshold-triggered, intermittent: a random gate, open a growing share d(t) of the time.

    Open for ``on_s`` on average, closed for on_s (1 - d) / d, dwells uniform within 50 % of that;
    d grows from ``start_duty`` to ``end_duty`` over ``ramp_s``. Closed, the level is
    ``quiet_share``. With ``band_rpm`` the level peaks near that engine speed.
    """

    kind: ClassVar[str] = "gate"
    on_s: float
    start_duty: float
    end_duty: float
    ramp_s: float
    quiet_share: float = 0.0
    band_rpm: float = 0.0
    band_width_rpm: float = 1.0

    def start(self, rng: np.random.Generator) -> "_Gate":
        """A fresh state."""
        return _Gate(self, rng)


class _Gate:
    FIRST_OPENING_S = 5.0

    def __init__(self, spec: GateTrigger, rng: np.random.Generator) -> None:
        self.spec, self.rng, self.ticks = spec, rng, 0
        self.open, self.switch_in_s = False, float(rng.uniform(1.0, self.FIRST_OPENING_S))

    def step(self, drivers: Drivers) -> float:
        spec = self.spec
        self.ticks += 1
        self.switch_in_s -= TICK_S
        if self.switch_in_s <= 0.0:
            self.open = not self.open
            grown = min(self.ticks * TICK_S / spec.ramp_s, 1.0)
            duty = spec.start_duty + (spec.end_duty - spec.start_duty) * grown
            mean_s = spec.on_s if self.open else spec.on_s * (1.0 - duty) / duty
            self.switch_in_s = mean_s * float(self.rng.uniform(0.5, 1.5))
        level = 1.0 if self.open else spec.quiet_share
        if spec.band_rpm:
            off_band = (drivers.rpm - spec.band_rpm) / spec.band_width_rpm
            level *= 0.6 + 0.4 * math.exp(-(off_band**2))
        return level


@dataclass(frozen=True, slots=True)
class PulseTrigger:
    """Threshold-triggered, recovering: falls with one lag, holds, recovers, and may come back.

    Target 1 for ``hold_s``, then 0 for ``gap_s``, dwells uniform within 30 %; dx/dt = (target - x)
    / (fall or recover tau).
    """

    kind: ClassVar[str] = "pulse"
    fall_tau_s: float
    hold_s: float
    recover_tau_s: float
    gap_s: float

    def start(self, rng: np.random.Generator) -> "_Pulse":
        """A fresh state."""
        return _Pulse(self, rng)


class _Pulse:
    def __init__(self, spec: PulseTrigger, rng: np.random.Generator) -> None:
        self.spec, self.rng, self.level, self.on = spec, rng, 0.0, True
        self.switch_in_s = spec.hold_s * float(rng.uniform(0.7, 1.3))

    def step(self, drivers: Drivers) -> float:
        spec = self.spec
        self.switch_in_s -= TICK_S
        if self.switch_in_s <= 0.0:
            self.on = not self.on
            mean_s = spec.hold_s if self.on else spec.gap_s
            self.switch_in_s = mean_s * float(self.rng.uniform(0.7, 1.3))
        tau_s = spec.fall_tau_s if self.on else spec.recover_tau_s
        self.level += _lag(tau_s) * (float(self.on) - self.level)
        return self.level


_SPECS: dict[str, type[Any]] = {
    spec.kind: spec
    for spec in (
        ExponentialApproach, LinearAccumulation, FatigueAccumulation,
        StepTrigger, FlapTrigger, GateTrigger, PulseTrigger,
    )
}  # fmt: skip


def read_law(field: str, table: dict[str, Any]) -> LawSpec:
    """Read one law table of the catalogue; raises `InputError` naming ``field``."""
    parameters = dict(table)
    kind = parameters.pop("kind", None)
    if kind not in _SPECS:
        raise InputError(field, f"unknown law {kind!r}; one of {', '.join(_SPECS)}")
    known = {item.name for item in fields(_SPECS[kind])}
    for name in parameters:
        if name not in known:
            raise InputError(f"{field}.{name}", f"is not a parameter of {kind}")
    if "releases" in parameters:
        parameters["releases"] = tuple(float(level) for level in parameters["releases"])
    try:
        spec: LawSpec = _SPECS[kind](**parameters)
    except TypeError as error:
        raise InputError(field, str(error)) from None
    return spec

"""What is to be flown: the plan, its weather and its legs, validated at the edge."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np

from core.checks import checked_number
from core.clock import DT_S, LONGEST_S
from core.errors import InputError
from core.files import read_toml

Conditions = Literal["lab", "field"]
Power = Literal["fixed", "speed_hold"]

PLAN_RANGES: dict[str, tuple[float, float, str]] = {
    "altitude_ft": (2000.0, 9000.0, "ft"),
    "speed_kt": (80.0, 115.0, "kt"),
    "heading_deg": (0.0, 360.0, "deg"),
    "duration_s": (30.0, LONGEST_S, "s"),
    "isa_deviation_degc": (-20.0, 25.0, "degC"),
    "wind_kt": (0.0, 40.0, "kt"),
    "wind_from_deg": (0.0, 360.0, "deg"),
    "turbulence": (0.0, 4.0, ""),
    "start_s": (0.0, LONGEST_S, "s"),
    "mixture": (0.75, 1.0, ""),
}
"""Inclusive limits of every numeric field, with its unit: forms, errors and help read this."""


@dataclass(frozen=True, slots=True)
class Weather:
    """The air: ISA deviation, steady wind, and turbulence level.

    ``turbulence`` is the severity index of MIL-F-8785C: 0 calm, 1 as in smooth real cruise, 2
    light, 3 to 4 moderate; whole numbers only.
    """

    isa_deviation_degc: float = 0.0
    wind_kt: float = 0.0
    wind_from_deg: float = 0.0
    turbulence: float = 0.0


@dataclass(frozen=True, slots=True)
class Leg:
    """New targets from ``start_s`` on; None leaves one as it was.

    Altitude changes at 500 ft/min, headings are taken at up to 20 deg of bank. The speed loop is
    closed while a leg is being captured, whatever the plan's ``power``. ``mixture`` is the lever's
    position at 5,000 ft, 1 full rich, and follows the air pressure elsewhere; cruise begins at
    0.93. Moving it alone leaves the throttle alone.
    """

    start_s: float
    altitude_ft: float | None = None
    speed_kt: float | None = None
    heading_deg: float | None = None
    mixture: float | None = None

    @property
    def only_mixture(self) -> bool:
        """Whether nothing is flown differently on this leg."""
        others = (self.altitude_ft, self.speed_kt, self.heading_deg)
        return self.mixture is not None and all(target is None for target in others)

    def __post_init__(self) -> None:
        """Reject targets out of range; raises `InputError` naming the field."""
        for name in ("start_s", "altitude_ft", "speed_kt", "heading_deg", "mixture"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, checked_number(name, value, *PLAN_RANGES[name]))


@dataclass(frozen=True, slots=True)
class Plan:
    """One flight to be flown, faulted or not.

    ``power`` is the control mode: ``"fixed"`` sets the throttle for ``speed_kt`` and leaves it
    there, as in a 172, which has no autothrottle; ``"speed_hold"`` keeps closing the speed loop.
    Altitude is held by pitch and heading by roll in both.
    """

    altitude_ft: float = 5000.0
    speed_kt: float = 100.0
    heading_deg: float = 0.0
    duration_s: float = 300.0
    seed: int = 0
    power: Power = "fixed"
    conditions: Conditions = "lab"
    weather: Weather = Weather()
    legs: tuple[Leg, ...] = ()

    def __post_init__(self) -> None:
        """Reject what cannot be flown; raises `InputError` naming the field and its range."""
        for name in ("altitude_ft", "speed_kt", "heading_deg", "duration_s"):
            number = checked_number(name, getattr(self, name), *PLAN_RANGES[name])
            object.__setattr__(self, name, number)
        for field in fields(self.weather):
            value = getattr(self.weather, field.name)
            number = checked_number(field.name, value, *PLAN_RANGES[field.name])
            object.__setattr__(self.weather, field.name, number)
        if self.weather.turbulence != int(self.weather.turbulence):
            raise InputError(
                "turbulence", f"must be 0, 1, 2, 3 or 4, got {self.weather.turbulence}"
            )
        starts = [leg.start_s for leg in self.legs]
        if starts != sorted(set(starts)) or any(start >= self.duration_s for start in starts):
            raise InputError("legs", "must start one after the other, before the end of the flight")
        if isinstance(self.seed, bool) or not isinstance(self.seed, int):
            raise InputError("seed", f"must be a whole number, got {self.seed!r}")
        if not 0 <= self.seed < 2**31:
            raise InputError("seed", f"must lie in 0 to {2**31 - 1}, got {self.seed}")
        if self.power not in ("fixed", "speed_hold"):
            raise InputError("power", f"must be fixed or speed_hold, got {self.power!r}")
        if self.conditions not in ("lab", "field"):
            raise InputError("conditions", f"must be lab or field, got {self.conditions!r}")

    @property
    def n_steps(self) -> int:
        """Number of 50 Hz samples recorded: the first at t = 0."""
        return round(self.duration_s / DT_S)

    @classmethod
    def sampled(cls, seed: int, *, duration_s: float = 300.0) -> Self:
        """A plan drawn from the paper's cruise box (section 3.1) by ``seed``, on any heading."""
        rng = np.random.default_rng([seed, 0x91A7])
        return cls(
            altitude_ft=round(float(rng.uniform(4500.0, 5500.0)), 1),
            speed_kt=round(float(rng.uniform(90.0, 110.0)), 2),
            heading_deg=round(float(rng.uniform(0.0, 360.0)), 1),
            duration_s=duration_s,
            seed=seed,
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values; `from_dict` reads them back."""
        return asdict(self) | {"legs": [asdict(leg) for leg in self.legs]}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Read a mapping (JSON, TOML, form); raises `InputError` for an unknown or bad field."""
        known = {field.name for field in fields(cls)}
        for name in values:
            if name not in known:
                raise InputError(name, f"is not a plan field; those are {', '.join(sorted(known))}")
        rest = dict(values)
        weather = rest.pop("weather", {})
        if not isinstance(weather, Mapping):
            raise InputError("weather", "must be a table of weather fields")
        for name in weather:
            if name not in {field.name for field in fields(Weather)}:
                raise InputError(f"weather.{name}", "is not a weather field")
        legs = rest.pop("legs", ())
        try:
            rest["legs"] = tuple(leg if isinstance(leg, Leg) else Leg(**leg) for leg in legs)
        except TypeError:
            raise InputError("legs", "must be tables with start_s and new targets") from None
        return cls(**rest, weather=Weather(**weather))


def load_plan(path: Path) -> Plan:
    """Read a plan from a TOML file; raises `InputError` if it is not TOML or not a plan."""
    return Plan.from_dict(read_toml(path, "plan"))

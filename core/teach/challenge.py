"""What a mystery flight may hide, and the draw of what it does hide."""

import hmac
import json
import re
import secrets
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from core.checks import checked_number
from core.cylinders import N_CYLINDERS
from core.errors import InputError
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.twin.plan import Plan

ONSET_RANGE_S = (45.0, 135.0)
"""Late enough to have seen the engine healthy, early enough for slow faults to show."""

CHALLENGE_DURATION_S = 300.0

_CODE = re.compile(r"[A-Za-z0-9-]{1,20}")


@dataclass(frozen=True, slots=True)
class Level:
    """A difficulty: its name for people and the severities that faults are drawn from."""

    id: str
    name: str
    severity_low: float
    severity_high: float


LEVELS: tuple[Level, ...] = (
    Level("plain", "Plain", 0.75, 1.0),
    Level("usual", "Usual", 0.45, 0.75),
    Level("subtle", "Subtle", 0.2, 0.45),
)

ALL_MODES = "all"


def mode_sets() -> dict[str, tuple[str, ...]]:
    """The sets of modes to draw from, by name: all of them, and those of each subsystem.

    A healthy flight is in every set: that nothing is wrong must be a possible answer.
    """
    modes = catalogue()
    subsystems = dict.fromkeys(mode.subsystem for mode in modes.values() if mode.id != "nominal")
    sets = {
        name: ("nominal", *(mode.id for mode in modes.values() if mode.subsystem == name))
        for name in subsystems
    }
    return {ALL_MODES: tuple(modes), **sets}


@dataclass(frozen=True, slots=True)
class Challenge:
    """A teacher's choice of what is flown. ``code``: the same one gives the same flight."""

    severity_low: float = LEVELS[1].severity_low
    severity_high: float = LEVELS[1].severity_high
    modes: tuple[str, ...] = ()
    code: str | None = None

    def __post_init__(self) -> None:
        """Reject what cannot be drawn; raises `InputError` naming the field."""
        for name in ("severity_low", "severity_high"):
            object.__setattr__(self, name, checked_number(name, getattr(self, name), 0.05, 1.0))
        if self.severity_low > self.severity_high:
            raise InputError("severity_low", f"must not exceed {self.severity_high:g}")
        chosen = tuple(self.modes) or mode_sets()[ALL_MODES]
        for mode in chosen:
            if mode not in catalogue():
                raise InputError("modes", f"unknown mode {str(mode)[:40]!r}")
        object.__setattr__(self, "modes", chosen)
        if self.code is not None and not _CODE.fullmatch(self.code):
            raise InputError("code", "must be 1 to 20 letters, digits or hyphens")

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values; `from_dict` reads them back."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """Read what `to_dict` wrote; raises `InputError`."""
        return cls(**{**values, "modes": tuple(values["modes"])})


def draw(challenge: Challenge, secret: bytes) -> tuple[Plan, Fault]:
    """The flight behind a challenge: another one each time, or the one of its code.

    ``secret`` is the server's own, without which nobody can work out what a code hides.
    """
    if challenge.code is None:
        key = secrets.token_bytes(32)
    else:
        key = hmac.digest(secret, json.dumps(challenge.to_dict()).encode(), "sha256")
    rng = np.random.default_rng(list(key))
    mode = catalogue()[challenge.modes[int(rng.integers(len(challenge.modes)))]]
    fault = Fault(
        mode=mode.id,
        severity=round(float(rng.uniform(challenge.severity_low, challenge.severity_high)), 2),
        onset_s=float(round(rng.uniform(*ONSET_RANGE_S))),
        cylinder=None if mode.whole_engine else 1 + int(rng.choice(N_CYLINDERS, p=mode.prior)),
    )
    return Plan.sampled(int(rng.integers(2**31)), duration_s=CHALLENGE_DURATION_S), fault

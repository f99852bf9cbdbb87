"""The fault that a run injects: mode, severity, onset, cylinder."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Self

from core.checks import checked_number
from core.clock import LONGEST_S
from core.cylinders import CYLINDERS
from core.errors import InputError
from core.fmea.catalogue import catalogue


@dataclass(frozen=True, slots=True)
class Fault:
    """A failure mode of the FMEA catalogue, injected at ``onset_s`` with ``severity`` 0-1.

    ``cylinder`` is one of `CYLINDERS` or None for the mode's usual one. Severity 0 equals nominal
    exactly.
    """

    mode: str = "nominal"
    severity: float = 0.6
    onset_s: float = 60.0
    cylinder: int | None = None

    def __post_init__(self) -> None:
        """Reject unknown modes and values out of range; raises `InputError` naming the field."""
        modes = catalogue()
        if self.mode not in modes:
            raise InputError("fault", f"unknown mode {self.mode!r}; one of {', '.join(modes)}")
        object.__setattr__(self, "severity", checked_number("severity", self.severity, 0.0, 1.0))
        object.__setattr__(
            self, "onset_s", checked_number("onset_s", self.onset_s, 0.0, LONGEST_S, "s")
        )
        if self.cylinder is not None and self.cylinder not in CYLINDERS:
            *most, last = CYLINDERS
            known = f"{', '.join(map(str, most))} or {last}"
            raise InputError("cylinder", f"must be {known}, got {self.cylinder!r}")

    @property
    def target_cylinder(self) -> int:
        """The cylinder hit: the chosen one, else the mode's usual one."""
        return self.cylinder or catalogue()[self.mode].cylinder

    def check_within(self, duration_s: float) -> None:
        """Raise `InputError` if the onset lies outside a flight of that length."""
        if self.mode != "nominal" and self.onset_s >= duration_s:
            raise InputError(
                "onset_s",
                f"must lie in 0 to {duration_s:g} s, before the end of the flight, "
                f"got {self.onset_s:g}",
            )

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values; `from_dict` reads them back."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Read a mapping; raises `InputError` for an unknown or bad field."""
        known = {field.name for field in fields(cls)}
        for name in values:
            if name not in known:
                raise InputError(
                    name, f"is not a fault field; those are {', '.join(sorted(known))}"
                )
        return cls(**values)

"""What is done while a flight is flown: the engine broken or repaired, new targets for the pilot.

A flight is a pure function of its plan, its fault and its actions: flown in one go, or
live and in pieces, it is the same bytes. Actions take effect at a tick (0.1 s). The mirror's pilot
does what the faulted aircraft's does; a fault is never the mirror's.
"""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, ClassVar

from core.checks import checked_number
from core.clock import TICK_S
from core.errors import InputError
from core.files import read_toml
from core.fmea.fault import Fault
from core.twin.plan import PLAN_RANGES, Leg, Plan

MAX_ACTIONS = 500
"""A flight with more of them is no pilot's."""

_TIME_RANGE = (0.0, PLAN_RANGES["duration_s"][1], "s")


@dataclass(frozen=True, slots=True)
class SetFault:
    """From ``time_s`` on the engine has this fault and no other.

    One that has set in already goes on from where it has come to, at the new severity. Any other
    begins: the one that the plan still had in store is called off. ``cylinder``: see `Fault`.
    """

    kind: ClassVar[str] = "fault"
    time_s: float
    mode: str
    severity: float = 0.6
    cylinder: int | None = None

    def __post_init__(self) -> None:
        """Reject a mode that cannot be injected; raises `InputError` naming the field."""
        _check_time(self)
        if self.mode == "nominal":
            raise InputError("fault", "nominal cannot be injected: repair the engine instead")
        object.__setattr__(self, "severity", self.fault.severity)

    @property
    def fault(self) -> Fault:
        """The fault as it sets in."""
        return Fault(self.mode, self.severity, self.time_s, self.cylinder)


@dataclass(frozen=True, slots=True)
class Repair:
    """From ``time_s`` on nothing is broken any more; what the plan still had in store is off."""

    kind: ClassVar[str] = "repair"
    time_s: float

    def __post_init__(self) -> None:
        """Reject a time beyond any flight; raises `InputError`."""
        _check_time(self)


@dataclass(frozen=True, slots=True)
class SetTarget:
    """New targets for both pilots, as a leg of the plan has them (`core.twin.plan.Leg`)."""

    kind: ClassVar[str] = "target"
    time_s: float
    altitude_ft: float | None = None
    speed_kt: float | None = None
    heading_deg: float | None = None

    def __post_init__(self) -> None:
        """Reject targets out of range, or none; raises `InputError` naming the field."""
        _check_time(self)
        leg = self.leg
        if leg.altitude_ft is leg.speed_kt is leg.heading_deg is None:
            raise InputError("target", "needs an altitude, a speed or a heading")
        for name in ("altitude_ft", "speed_kt", "heading_deg"):
            object.__setattr__(self, name, getattr(leg, name))

    @property
    def leg(self) -> Leg:
        """The targets as a leg."""
        return Leg(self.time_s, self.altitude_ft, self.speed_kt, self.heading_deg)


Action = SetFault | Repair | SetTarget
_KINDS: dict[str, type[Action]] = {each.kind: each for each in (SetFault, Repair, SetTarget)}


def tick_of(action: Action) -> int:
    """The first tick at or after the action's time: where it takes effect."""
    return math.ceil(action.time_s / TICK_S - 1e-6)


def at_tick(action: Action, tick: int) -> Action:
    """The action as it takes effect there."""
    return replace(action, time_s=round(tick * TICK_S, 1))


def in_order(actions: Iterable[Action], plan: Plan) -> tuple[Action, ...]:
    """The actions as they follow each other; raises `InputError` if one comes after the end.

    Of those that take effect at one tick, the later in ``actions`` comes later.
    """
    ordered = tuple(sorted(actions, key=tick_of))
    if len(ordered) > MAX_ACTIONS:
        raise InputError("actions", f"must be {MAX_ACTIONS} at most, got {len(ordered)}")
    for action in ordered:
        if tick_of(action) * TICK_S >= plan.duration_s:
            raise InputError(
                "time_s",
                f"must lie in 0 to {plan.duration_s:g} s, before the end of the flight, "
                f"got {action.time_s:g}",
            )
    return ordered


def done_by(actions: Iterable[Action], end_s: float) -> tuple[Action, ...]:
    """Those that took effect in a flight whose last sample is at ``end_s``: the ground may end it.

    What was to come later is not part of the flight.
    """
    return tuple(action for action in actions if tick_of(action) * TICK_S <= end_s + 1e-6)


def first_fault(fault: Fault, actions: Iterable[Action]) -> Fault | None:
    """The first fault that sets in, with its onset; None in a flight where none does."""
    planned = fault if fault.mode != "nominal" else None
    for action in sorted(actions, key=tick_of):
        if planned is not None and planned.onset_s < action.time_s:
            break
        if isinstance(action, SetFault) and action.severity > 0.0:
            return action.fault
        if not isinstance(action, SetTarget):
            planned = None
    return planned


def commanded(plan: Plan, actions: Iterable[Action]) -> Plan:
    """The plan with the targets that were set on the way as legs of it."""
    legs = {leg.start_s: leg for leg in plan.legs}
    for action in sorted(actions, key=tick_of):
        if isinstance(action, SetTarget):
            new = at_tick(action, tick_of(action))
            targets = {name: value for name, value in asdict(new).items() if value is not None}
            legs[new.time_s] = replace(
                legs.get(new.time_s, Leg(new.time_s)), start_s=targets.pop("time_s"), **targets
            )
    return replace(plan, legs=tuple(legs[start_s] for start_s in sorted(legs)))


def action_to_dict(action: Action) -> dict[str, Any]:
    """Plain JSON-ready values; `read_action` reads them back."""
    values = {name: value for name, value in asdict(action).items() if value is not None}
    return {"kind": action.kind, **values}


def read_action(values: Any) -> Action:
    """Read a mapping (JSON, TOML); raises `InputError` for an unknown or bad field."""
    if not isinstance(values, Mapping):
        raise InputError("actions", f"must be tables, each with a kind, got {values!r:.60}")
    given = dict(values)
    name = given.pop("kind", None)
    if name not in _KINDS:
        raise InputError("kind", f"must be one of {', '.join(_KINDS)}, got {name!r:.60}")
    kind = _KINDS[name]
    known = [field.name for field in fields(kind)]
    for field in given:
        if field not in known:
            raise InputError(field, f"is not a field of a {name}; those are {', '.join(known)}")
    try:
        return kind(**given)
    except TypeError:
        missing = [field for field in ("time_s", "mode") if field in known and field not in given]
        raise InputError(", ".join(missing) or "actions", f"is missing in a {name}") from None


def load_actions(path: Path) -> tuple[Action, ...]:
    """Read a TOML or JSON file with a list of ``actions``; raises `InputError`."""
    values = _read_json(path) if path.suffix == ".json" else read_toml(path, "actions")
    listed = values.get("actions") if isinstance(values, dict) else values
    if not isinstance(listed, list):
        raise InputError("actions", f"{path} has no list of actions")
    return tuple(map(read_action, listed))


def _read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError("actions", f"cannot read {path}: {error.strerror}") from None
    except ValueError as error:
        raise InputError("actions", f"{path} is not JSON: {error}") from None


def _check_time(action: Action) -> None:
    object.__setattr__(action, "time_s", checked_number("time_s", action.time_s, *_TIME_RANGE))

"""What was injected into a flight beside what it was diagnosed as, and whether the two agree.

A simulated flight is the one place where both are known, so every page and file that shows a
verdict says so in the same words.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from core.clock import clock
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.twin.actions import Action, SetFault, SetTarget, tick_of

NOMINAL = "nominal"

_SPELLS_SHOWN = 2
_MODES_SHOWN = 4

MARKS: dict[bool | None, tuple[str, str]] = {
    True: ("✓", "right"),
    False: ("✗", "wrong"),
    None: ("–", "no verdict"),
}
"""The mark of an answer, and the word beside it: a colour or a sign alone is not read by all."""


@dataclass(frozen=True, slots=True)
class Injected:
    """One fault of a flight, from ``onset_s`` to ``end_s``, which is None if it lasted.

    ``end``: how it ended, or that it never began, since the flight was over by its onset.
    """

    mode: str
    onset_s: float
    end_s: float | None = None
    end: Literal["", "repaired", "replaced", "never began"] = ""

    @property
    def was_active(self) -> bool:
        """Whether anything was broken by it."""
        return self.end != "never began"

    @property
    def times(self) -> str:
        """``from 1:36``, ``1:36 to 5:52``."""
        if self.end_s is None:
            return f"from {clock(self.onset_s)}"
        return f"{clock(self.onset_s)} to {clock(self.end_s)}"


@dataclass(frozen=True, slots=True)
class Outcome:
    """What was injected, in the order of time, and the class diagnosed.

    ``diagnosed`` is only the nearest class where ``none_of_these`` says that the flight resembles
    nothing that the classifier has learnt.
    """

    injected: tuple[Injected, ...]
    diagnosed: str
    none_of_these: bool = False

    @property
    def active(self) -> tuple[Injected, ...]:
        """The faults that began before the flight ended."""
        return tuple(each for each in self.injected if each.was_active)

    @property
    def right(self) -> bool | None:
        """Whether the diagnosis names a fault that was active, or nominal where none was.

        None where it names nothing.
        """
        if self.none_of_these:
            return None
        return self.diagnosed in ({each.mode for each in self.active} or {NOMINAL})

    @property
    def injected_words(self) -> str:
        """``Engine failure (repaired at 5:52)``; of several each with its times."""
        if not self.injected:
            return _name(NOMINAL)
        by_mode: dict[str, list[Injected]] = {}
        for each in self.injected:
            by_mode.setdefault(each.mode, []).append(each)
        is_alone = len(self.injected) == 1
        said = [
            f"{_name(mode)}{_alone(spells[0]) if is_alone else f' ({_times(spells)})'}"
            for mode, spells in by_mode.items()
        ]
        if len(said) > _MODES_SHOWN:
            said[_MODES_SHOWN:] = [f"{len(said) - _MODES_SHOWN} more"]
        return ", ".join(said)

    @property
    def diagnosed_words(self) -> str:
        """The class diagnosed, or that it is none of those that are known."""
        name = _name(self.diagnosed)
        return f"none of the known faults (nearest: {name})" if self.none_of_these else name

    @property
    def mark(self) -> str:
        """A tick, a cross, or a dash where there is no verdict."""
        return MARKS[self.right][0]

    @property
    def mark_words(self) -> str:
        """``right``, ``wrong``; of several faults also when the one named was active."""
        word = MARKS[self.right][1]
        named = [each for each in self.active if each.mode == self.diagnosed]
        return f"{word}, {_times(named)}" if self.right and len(self.injected) > 1 else word

    @property
    def line(self) -> str:
        """``Injected: Engine failure. Diagnosed: Nominal. ✗ wrong``."""
        return (
            f"Injected: {self.injected_words}. Diagnosed: {self.diagnosed_words}. "
            f"{self.mark} {self.mark_words}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values, for programs."""
        return {
            "injected": [
                {"mode": each.mode, "onset_s": each.onset_s, "end_s": each.end_s, "end": each.end}
                for each in self.injected
            ],
            "diagnosed": self.diagnosed,
            "none_of_these": self.none_of_these,
            "right": self.right,
        }


def injected_faults(
    fault: Fault, actions: Iterable[Action] = (), flown_s: float = math.inf
) -> tuple[Injected, ...]:
    """The faults of a flight of ``flown_s`` seconds, planned or injected on the way.

    One of severity 0 breaks nothing, and one that is called off before its onset never was. A new
    severity of the same fault goes on with it, as in `core.twin.flight`.
    """
    found: list[Injected] = []
    now = _real(fault)
    for action in sorted(actions, key=tick_of):
        if isinstance(action, SetTarget) or action.time_s >= flown_s:
            continue
        new = _real(action.fault) if isinstance(action, SetFault) else None
        if now is not None and now.onset_s < action.time_s:
            if new is not None and _breaks_the_same(now, new):
                continue
            how: Literal["repaired", "replaced"] = "repaired" if new is None else "replaced"
            found.append(Injected(now.mode, now.onset_s, action.time_s, how))
        now = new
    if now is not None:
        found.append(Injected(now.mode, now.onset_s, end=_lasting(now, flown_s)))
    return tuple(found)


def _real(fault: Fault) -> Fault | None:
    return fault if fault.mode != NOMINAL and fault.severity > 0.0 else None


def _breaks_the_same(one: Fault, other: Fault) -> bool:
    return (one.mode, one.target_cylinder) == (other.mode, other.target_cylinder)


def _lasting(fault: Fault, flown_s: float) -> Literal["", "never began"]:
    return "" if fault.onset_s < flown_s else "never began"


def _name(mode: str) -> str:
    modes = catalogue()
    return modes[mode].name if mode in modes else mode


def _alone(injected: Injected) -> str:
    match injected.end, injected.end_s:
        case "repaired", float(end_s):
            return f" (repaired at {clock(end_s)})"
        case "never began", _:
            return f" (from {clock(injected.onset_s)}, after the end of the flight)"
    return ""


def _times(spells: Sequence[Injected]) -> str:
    if len(spells) > _SPELLS_SHOWN:
        return f"{len(spells)} times, first {spells[0].times}"
    return " and ".join(
        f"{each.times}{'' if each.was_active else ', after the end of the flight'}"
        for each in spells
    )

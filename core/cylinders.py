"""The engine's four cylinders: where each lies, and which lie beside each other.

A flat four seen from above, nose up (Lycoming O-320): 1 right front, 2 left front, 3 right rear,
4 left rear. Odd numbers make the right bank, even ones the left.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Place:
    """Where a cylinder lies, seen from above with the nose up."""

    side: Literal["right", "left"]
    row: Literal["front", "rear"]

    @property
    def name(self) -> str:
        """``right front``."""
        return f"{self.side} {self.row}"


LAYOUT: dict[int, Place] = {
    1: Place("right", "front"),
    2: Place("left", "front"),
    3: Place("right", "rear"),
    4: Place("left", "rear"),
}

CYLINDERS: tuple[int, ...] = tuple(LAYOUT)
N_CYLINDERS = len(CYLINDERS)


def _at(side: str, row: str) -> int:
    return next(c for c, place in LAYOUT.items() if (place.side, place.row) == (side, row))


def mate(cylinder: int) -> int:
    """The other cylinder of its bank.

    >>> mate(1), mate(4)
    (3, 2)
    """
    place = LAYOUT[cylinder]
    return _at(place.side, "rear" if place.row == "front" else "front")


def across(cylinder: int) -> int:
    """The cylinder on the other side of its row.

    >>> across(1), across(4)
    (2, 3)
    """
    place = LAYOUT[cylinder]
    return _at("left" if place.side == "right" else "right", place.row)


def bank(cylinder: int) -> tuple[int, ...]:
    """The cylinders on its side, in order.

    >>> bank(3)
    (1, 3)
    """
    return tuple(c for c in CYLINDERS if LAYOUT[c].side == LAYOUT[cylinder].side)


def row(name: str) -> tuple[int, ...]:
    """The cylinders of the ``front`` or the ``rear`` row, in order."""
    return tuple(c for c in CYLINDERS if LAYOUT[c].row == name)


GROUPS: dict[str, Callable[[int], set[int]]] = {
    "target": lambda c: {c},
    "mate": lambda c: {mate(c)},
    "across": lambda c: {across(c)},
    "diagonal": lambda c: {across(mate(c))},
    "bank": lambda c: set(bank(c)),
    "other bank": lambda c: set(bank(across(c))),
    "others": lambda c: set(CYLINDERS) - {c},
    "front": lambda c: set(row("front")),
    "rear": lambda c: set(row("rear")),
    "all": lambda c: set(CYLINDERS),
}
"""The cylinders that a group's name means, seen from cylinder ``c``: the one vocabulary of the
catalogue, the knowledge base and the reports."""

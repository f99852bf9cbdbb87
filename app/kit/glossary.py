"""The glossary and the tour, read from TOML and checked on load."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from core.errors import InputError
from core.files import read_toml
from core.paths import DATA


@dataclass(frozen=True, slots=True)
class Term:
    """A term, what it is short for, if anything, and its meaning here."""

    id: str
    group: str
    name: str
    text: str
    long: str = ""


@dataclass(frozen=True, slots=True)
class Stop:
    """A stop of the tour: its target, a CSS selector, and its text."""

    target: str
    title: str
    text: str


@cache
def glossary() -> Mapping[str, Term]:
    """All terms by id, in the order of the file; raises `InputError` for a bad file."""
    return read_glossary(DATA / "glossary.toml")


@cache
def tour_stops() -> tuple[Stop, ...]:
    """The stops of the tour, in order; raises `InputError` for a bad file."""
    path = DATA / "tour.toml"
    stops = read_toml(path, path.stem).get("stop", [])
    if not isinstance(stops, list) or not stops:
        raise InputError("stop", f"{path.name} has none")
    return tuple(_entry(Stop, f"stop {at}", table) for at, table in enumerate(stops, start=1))


def read_glossary(path: Path) -> Mapping[str, Term]:
    """Read and validate a glossary file; raises `InputError` naming the term."""
    return {
        term_id: _entry(Term, term_id, {"id": term_id, **table})
        for term_id, table in read_toml(path, path.stem).items()
    }


def _entry(kind: type, where: str, table: dict[str, Any]) -> Any:
    if not all(isinstance(value, str) and value for value in table.values()):
        raise InputError(where, "must hold texts only, none of them empty")
    try:
        return kind(**table)
    except TypeError as error:
        raise InputError(where, f"has fields too many or too few: {error}") from None

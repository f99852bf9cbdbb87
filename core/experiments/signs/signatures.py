"""The reference that the twin is held against: what each mode does to each channel in cruise.

The knowledge base says it, on the mode's usual cylinder; ``assets/data/fmea/signatures.toml`` holds
the entries in which the project's fact sheets differ from it, where in a flight a mode is judged,
and the entries that we dispute, each with our reason and our own range.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args

from core.channels import CHANNEL_INDEX
from core.cylinders import CYLINDERS
from core.errors import InputError
from core.files import read_toml
from core.fmea.catalogue import class_ids
from core.knowledge.knowledge import SIGNS, ModeKnowledge, Sign, knowledge
from core.paths import DATA

WindowKind = Literal["last minute", "second minute", "worst"]
"""Where in a flight a shift is read: its last minute, the second after onset, the worst 10 s."""


@dataclass(frozen=True, slots=True)
class Expected:
    """The sign at a clear fault, and the range (low, high) over severities 0.3-1.0, by unit."""

    sign: Sign
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Dispute:
    """Why we hold an entry to be wrong, and the range (low, high) that we hold to be right."""

    reason: str
    low: float
    high: float


FLAT = Expected("0", 0.0, 0.0)
"""What is expected of a channel that the knowledge base does not list for a mode."""


@dataclass(frozen=True, slots=True)
class Signatures:
    """``expected`` by mode and channel, for all classes and all ``channels`` judged.

    ``windows``: by mode, where it is judged if not in the last minute.
    """

    channels: tuple[str, ...]
    expected: Mapping[str, Mapping[str, Expected]]
    disputed: Mapping[tuple[str, str], Dispute]
    windows: Mapping[str, WindowKind]


@cache
def signatures() -> Signatures:
    """The reference; raises `InputError` on a bad file."""
    return read_signatures(DATA / "fmea" / "signatures.toml")


def read_signatures(path: Path) -> Signatures:
    """Read and validate a reference file; raises `InputError` naming mode and channel."""
    tables = read_toml(path, "signatures")
    for key in ("channels", "differs", "window", "disputed"):
        if key not in tables:
            raise InputError(f"signatures.{key}", "is missing")
    channels = tuple(tables["channels"])
    for name in channels:
        _check_known(name, CHANNEL_INDEX, "signatures.channels")
    for mode in (*tables["differs"], *tables["window"]):
        _check_known(mode, class_ids(), "signatures")
    for kind in tables["window"].values():
        _check_known(kind, get_args(WindowKind), "signatures.window")
    expected = {
        mode: _read_mode(known, tables["differs"].get(mode, {}), channels)
        for mode, known in knowledge().items()
    }
    disputed = {
        (mode, entry["channel"]): Dispute(entry["reason"], *_read_range(mode, limits))
        for entry in tables["disputed"]
        for mode, limits in entry["range"].items()
    }
    for mode, name in disputed:
        _check_known(mode, expected, "signatures.disputed")
        _check_known(name, channels, f"signatures.disputed.{mode}")
    return Signatures(channels, expected, disputed, tables["window"])


def _read_mode(
    known: ModeKnowledge, differs: Mapping[str, Any], channels: tuple[str, ...]
) -> Mapping[str, Expected]:
    for name in differs:
        _check_known(name, channels, f"signatures.{known.id}")
    shifts = known.signature(known.usual_cylinder or CYLINDERS[0])
    entries = {
        name: Expected(shift.sign, shift.low, shift.high) for name, shift in shifts.items()
    } | {name: _read_entry(f"{known.id}.{name}", entry) for name, entry in differs.items()}
    return {name: entries.get(name, FLAT) for name in channels}


def _read_entry(field: str, entry: Any) -> Expected:
    if not isinstance(entry, list) or len(entry) != 3 or entry[0] not in SIGNS:
        raise InputError(f"signatures.{field}", f"must be [sign, low, high], got {entry!r}")
    return Expected(entry[0], *_read_range(field, entry[1:]))


def _read_range(field: str, limits: Any) -> tuple[float, float]:
    try:
        low, high = (float(limit) for limit in limits)
    except (TypeError, ValueError):
        raise InputError(f"signatures.{field}", f"needs two numbers, got {limits!r}") from None
    if not low <= high:
        raise InputError(f"signatures.{field}", f"needs low <= high, got {low:g}, {high:g}")
    return low, high


def _check_known(name: Any, known: Any, field: str) -> None:
    if name not in known:
        raise InputError(field, f"unknown: {name!r}")

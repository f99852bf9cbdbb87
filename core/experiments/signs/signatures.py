"""The reference that the twin is held against: what each mode does to each channel in cruise.

Read from ``assets/fmea/signatures.toml``, which carries the figures over from the project's fact
sheets and, apart from them, the entries that we dispute, each with our reason and our own range.
"""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args

from core.channels import CHANNEL_INDEX, channel
from core.errors import InputError
from core.fmea.catalogue import class_ids
from core.paths import DATA

Sign = Literal["+", "-", "0", "~"]
"""Up, down, nothing above wander, or conditional (transient, oscillating: no claim)."""


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
"""What is expected of a channel that the file does not list for a mode."""


@dataclass(frozen=True, slots=True)
class Signatures:
    """``expected`` by mode and channel, for all classes and all ``channels`` judged."""

    channels: tuple[str, ...]
    expected: Mapping[str, Mapping[str, Expected]]
    disputed: Mapping[tuple[str, str], Dispute]


def wander(name: str) -> float:
    """What a channel of a real log does by itself, one sd of noise and wander, in its unit.

    The resolution of the comparison: a shift has to exceed it to count, and no shift is whatever
    stays below it.
    """
    logged = channel(name)
    return math.hypot(logged.noise_sd, logged.wander_sd)


@cache
def signatures() -> Signatures:
    """The reference; raises `InputError` on a bad file."""
    return read_signatures(DATA / "fmea" / "signatures.toml")


def read_signatures(path: Path) -> Signatures:
    """Read and validate a reference file; raises `InputError` naming mode and channel."""
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise InputError("signatures", f"{path}: {error}") from None
    for key in ("channels", "signature", "disputed"):
        if key not in tables:
            raise InputError(f"signatures.{key}", "is missing")
    channels = tuple(tables["channels"])
    for name in channels:
        _check_known(name, CHANNEL_INDEX, "signatures.channels")
    for mode in tables["signature"]:
        _check_known(mode, class_ids(), "signatures")
    expected = {
        mode: _read_mode(mode, tables["signature"].get(mode, {}), channels) for mode in class_ids()
    }
    disputed = {
        (mode, entry["channel"]): Dispute(entry["reason"], *_read_range(mode, limits))
        for entry in tables["disputed"]
        for mode, limits in entry["range"].items()
    }
    for mode, name in disputed:
        _check_known(mode, expected, "signatures.disputed")
        _check_known(name, channels, f"signatures.disputed.{mode}")
    return Signatures(channels, expected, disputed)


def _read_mode(
    mode: str, table: Mapping[str, Any], channels: tuple[str, ...]
) -> Mapping[str, Expected]:
    for name in table:
        _check_known(name, channels, f"signatures.{mode}")
    return {
        name: _read_entry(f"{mode}.{name}", table[name]) if name in table else FLAT
        for name in channels
    }


def _read_entry(field: str, entry: Any) -> Expected:
    if not isinstance(entry, list) or len(entry) != 3 or entry[0] not in get_args(Sign):
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

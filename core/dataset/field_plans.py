"""Field flights like those of the real logs, drawn by seed from ``assets/data/realism.toml``."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from core.errors import InputError
from core.files import read_toml
from core.paths import DATA
from core.twin.constants import CRUISE_MIXTURE
from core.twin.plan import Leg, Plan, Weather

DISTRIBUTION = DATA / "realism.toml"

_LAST_S = 90.0
"""Nothing new begins this close to the end."""

Table = Mapping[str, Any]


def load_distribution(path: Path = DISTRIBUTION) -> dict[str, Any]:
    """What flights are drawn from; raises `InputError` if the file cannot be read or flown."""
    distribution = read_toml(path, "realism")
    try:
        field_plan(0, distribution)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError("realism", f"{path}: {type(error).__name__} {error}") from None
    return distribution


def field_plan(seed: int, distribution: Table) -> Plan:
    """The plan of that seed; raises `InputError` where the distribution leaves the envelope."""
    rng = np.random.default_rng([seed, 0x4EA1])
    start, weather = distribution["start"], distribution["weather"]
    duration_s = float(distribution["duration_s"])
    altitude_ft, speed_kt, heading_deg = (
        _within(rng, start[name]) for name in ("altitude_ft", "speed_kt", "heading_deg")
    )
    isa = weather["isa_deviation_degc"]
    levels = weather["turbulence"]
    flown = Weather(
        isa_deviation_degc=float(np.clip(rng.normal(isa["mean"], isa["sd"]), *isa["within"])),
        wind_kt=_within(rng, weather["wind_kt"]),
        wind_from_deg=_within(rng, weather["wind_from_deg"]),
        turbulence=float(rng.choice([int(level) for level in levels], p=list(levels.values()))),
    )
    targets = _manoeuvres(rng, distribution["manoeuvres"], duration_s, altitude_ft, heading_deg)
    for start_s, mixture in _mixtures(rng, distribution["mixture"], duration_s):
        targets.setdefault(start_s, {})["mixture"] = mixture
    legs = tuple(Leg(start_s, **targets[start_s]) for start_s in sorted(targets))
    return Plan(
        altitude_ft, speed_kt, heading_deg, duration_s, seed,
        conditions="field", weather=flown, legs=legs,
    )  # fmt: skip


def _within(rng: np.random.Generator, span: tuple[float, float]) -> float:
    return round(float(rng.uniform(*span)), 1)


def _manoeuvres(
    rng: np.random.Generator,
    table: Table,
    duration_s: float,
    altitude_ft: float,
    heading_deg: float,
) -> dict[float, dict[str, float]]:
    """New targets by the time they begin at."""
    kinds = ("altitude", "speed", "heading")
    shares = [table[kind]["share"] for kind in kinds]
    targets: dict[float, dict[str, float]] = {}
    time_s = _within(rng, table["every_s"])
    while time_s < duration_s - _LAST_S:
        kind = rng.choice(kinds, p=shares)
        if kind == "altitude":
            low, high = table[kind]["within"]
            step_ft = rng.choice([-1.0, 1.0]) * _within(rng, table[kind]["change_ft"])
            if not low <= altitude_ft + step_ft <= high:
                step_ft = -step_ft
            altitude_ft = float(np.clip(altitude_ft + step_ft, low, high))
            targets[time_s] = {"altitude_ft": altitude_ft}
        elif kind == "speed":
            targets[time_s] = {"speed_kt": _within(rng, table[kind]["within"])}
        else:
            turn_deg = rng.choice([-1.0, 1.0]) * _within(rng, table[kind]["change_deg"])
            heading_deg = float((heading_deg + turn_deg) % 360.0)
            targets[time_s] = {"heading_deg": heading_deg}
        time_s = round(time_s + _within(rng, table["every_s"]), 1)
    return targets


def _mixtures(
    rng: np.random.Generator, table: Table, duration_s: float
) -> list[tuple[float, float]]:
    """Where the lever goes and when: to rich and to lean in turns, several moves each time."""
    moves: list[tuple[float, float]] = []
    lever, to_lean = CRUISE_MIXTURE, bool(rng.integers(2))
    time_s = _within(rng, (0.0, table["every_s"][0]))
    while time_s < duration_s - _LAST_S:
        goal = float(rng.uniform(*table["lean" if to_lean else "rich"]))
        turns = int(rng.integers(table["turns"][0], table["turns"][1] + 1))
        for turn in range(turns):
            lever += (goal - lever) / (turns - turn)
            moves.append((time_s, round(lever, 3)))
            time_s = round(time_s + _within(rng, table["turn_every_s"]), 1)
        to_lean = not to_lean
        time_s = round(time_s + _within(rng, table["every_s"]), 1)
    return [(at, mixture) for at, mixture in moves if at < duration_s - _LAST_S]

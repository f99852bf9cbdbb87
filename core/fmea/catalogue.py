"""The FMEA catalogue: the classes and the defects each one drives, read from TOML."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from core.cylinders import CYLINDERS, GROUPS, N_CYLINDERS
from core.errors import InputError
from core.files import read_toml
from core.fmea.defects import ENGINE, ENGINE_WIDE, MOVES_ENGINE, PER_CYLINDER
from core.fmea.laws import LawSpec, read_law
from core.fmea.powerplant import CARRIERS
from core.paths import DATA

MILD = 0.3
"""The severity at which a drive has its ``mild`` size."""


@dataclass(frozen=True, slots=True)
class Drive:
    """One defect that a mode moves, where, how far and by which law."""

    defect: str
    where: str
    mild: float
    severe: float
    law: LawSpec

    def size(self, severity: float) -> float:
        """The defect's full size: a power of severity with ``mild`` at 0.3, ``severe`` at 1."""
        exponent = math.log(self.mild / self.severe) / math.log(MILD)
        return self.severe * severity**exponent if severity > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class Mode:
    """A failure mode. ``cylinder`` is its usual one (1 for whole-engine modes: unused there).

    ``jsbsim`` names the JSBSim parameters that carry layer 2 (`core.fmea.powerplant.CARRIERS`),
    ``jsbsim_because`` says why those.
    """

    id: str
    name: str
    subsystem: str
    law: str
    cylinder: int
    whole_engine: bool
    prior: tuple[float, ...]
    severity_rating: int
    occurrence: int
    detection: int
    jsbsim: tuple[str, ...]
    jsbsim_because: str
    drives: tuple[Drive, ...]

    @property
    def rpn(self) -> int:
        """Risk priority number, the product of the three ratings."""
        return self.severity_rating * self.occurrence * self.detection

    @property
    def moves_engine(self) -> bool:
        """Whether the fault reaches JSBSim and so may bend the flight path."""
        return any(drive.defect in MOVES_ENGINE for drive in self.drives)


@cache
def catalogue() -> Mapping[str, Mode]:
    """All modes by id, in class order, ``nominal`` first; raises `InputError` on a bad file."""
    return read_catalogue(DATA / "fmea" / "catalogue.toml")


@cache
def class_ids() -> tuple[str, ...]:
    """The class ids in the order of every probability vector."""
    return tuple(catalogue())


def read_catalogue(path: Path) -> Mapping[str, Mode]:
    """Read and validate a catalogue file; raises `InputError` naming mode and field."""
    tables = read_toml(path, "catalogue")
    return {mode_id: _read_mode(mode_id, table) for mode_id, table in tables.items()}


def _read_mode(mode_id: str, table: dict[str, Any]) -> Mode:
    try:
        prior = tuple(float(p) for p in table["prior"])
        if len(prior) != N_CYLINDERS or not math.isclose(sum(prior), 1.0, abs_tol=1e-6):
            raise InputError(
                f"{mode_id}.prior", f"must be {N_CYLINDERS} shares that sum to 1, got {prior}"
            )
        cylinder = int(table["cylinder"])
        if cylinder not in (0, *CYLINDERS):
            raise InputError(f"{mode_id}.cylinder", f"must be 0 or a cylinder, got {cylinder}")
        ratings = [int(table[key]) for key in ("severity_rating", "occurrence", "detection")]
        if not all(1 <= rating <= 10 for rating in ratings):
            raise InputError(f"{mode_id}", f"ratings must be 1-10, got {ratings}")
        return Mode(
            id=mode_id,
            name=str(table["name"]),
            subsystem=str(table["subsystem"]),
            law=str(table["law"]),
            cylinder=cylinder or 1,
            whole_engine=cylinder == 0,
            prior=prior,
            severity_rating=ratings[0],
            occurrence=ratings[1],
            detection=ratings[2],
            jsbsim=_read_carriers(mode_id, table["jsbsim"]),
            jsbsim_because=str(table["jsbsim_because"]),
            drives=tuple(_read_drive(mode_id, drive) for drive in table["drive"]),
        )
    except KeyError as error:
        raise InputError(f"{mode_id}.{error.args[0]}", "is missing from the catalogue") from None


def _read_carriers(mode_id: str, names: list[str]) -> tuple[str, ...]:
    for name in names:
        if name not in CARRIERS:
            known = ", ".join(CARRIERS)
            raise InputError(f"{mode_id}.jsbsim", f"unknown parameter {name!r}; one of {known}")
    return tuple(names)


def _read_drive(mode_id: str, table: dict[str, Any]) -> Drive:
    where, defect = table["where"], table["defect"]
    if defect not in (*ENGINE_WIDE, *PER_CYLINDER):
        raise InputError(f"{mode_id}.drive.defect", f"unknown defect {defect!r}")
    places = (ENGINE,) if defect in ENGINE_WIDE else tuple(GROUPS)
    if where not in places:
        raise InputError(
            f"{mode_id}.drive.where",
            f"{defect} can be at {', '.join(places)}, got {where!r}",
        )
    mild, severe = float(table["mild"]), float(table["severe"])
    if not 0.0 < mild < severe:
        raise InputError(f"{mode_id}.drive", f"needs 0 < mild < severe, got {mild}, {severe}")
    return Drive(defect, where, mild, severe, read_law(f"{mode_id}.drive.law", table["law"]))

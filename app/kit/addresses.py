"""Addresses of the pages: building one for a link, and reading one."""

from collections.abc import Sequence
from dataclasses import dataclass

from app.kit.words import sentence
from core.errors import NoSuchRunError, StoreError
from core.fmea.catalogue import catalogue
from core.store.records import valid_run_id
from core.store.store import RunStore

RUN_PREFIX = "/run/"
PRESENT_PREFIX = "/present/"
FLY_PREFIX = "/fly/"
FAULT_PREFIX = "/faults/"
COMPARE_PREFIX = "/compare/"
RESULT_PREFIX = "/results/"
TEACH_PREFIX = "/teach/"

MISSING = "missing"
"""The kind of the page for an address that names nothing."""


@dataclass(frozen=True, slots=True)
class Address:
    """A page, by its ``kind``, and what it shows.

    ``item`` is the one thing that the page is about, ``about`` its name for people: a failure mode,
    an experiment, a set of runs, a mystery flight. ``run_id`` is the run that is followed,
    ``run_ids`` are runs to be compared. ``problem`` says to a person why nothing is there.
    """

    kind: str
    item: str | None = None
    run_id: str | None = None
    run_ids: tuple[str, ...] = ()
    about: str = ""
    problem: str = ""


def missing(problem: str) -> Address:
    """The address of nothing."""
    return Address(MISSING, problem=problem)


def parts(path: str) -> tuple[str, str]:
    """The first part of a path and the rest, which may have more slashes.

    >>> parts("/faults/baffle_seal"), parts("/runs")
    (('faults', 'baffle_seal'), ('runs', ''))
    """
    head, _, rest = path.removeprefix("/").partition("/")
    return head, rest


def run_path(run_id: str) -> str:
    """The address of a run."""
    return RUN_PREFIX + run_id


def fly_path(mode: str) -> str:
    """The address that opens Fly with a mode filled in."""
    return FLY_PREFIX + mode


def fault_path(mode: str) -> str:
    """The address of a mode's page."""
    return FAULT_PREFIX + mode


def compare_path(run_ids: Sequence[str]) -> str:
    """The address of a comparison of runs, or of a set of runs by its name."""
    return COMPARE_PREFIX + ",".join(run_ids) if run_ids else COMPARE_PREFIX.rstrip("/")


def result_path(name: str) -> str:
    """The address of the result of an experiment."""
    return RESULT_PREFIX + name


def teach_path(attempt_id: str) -> str:
    """The address of a mystery flight."""
    return TEACH_PREFIX + attempt_id


def run_problem(run_id: str, store: RunStore) -> str:
    """Why a run cannot be shown, as a sentence; empty if it can."""
    if not valid_run_id(run_id):
        return (
            f"“{run_id[:60]}” is not the name of a run. "
            "Runs are named like 20261123T061500-k3x9q2wz."
        )
    try:
        store.get(run_id)
    except NoSuchRunError:
        return f"There is no run {run_id} in this store. It may belong to another server."
    except StoreError as error:
        return sentence(str(error))
    return ""


def mode_address(kind: str, mode: str) -> Address:
    """The address of a page about a failure mode."""
    modes = catalogue()
    if mode not in modes:
        return missing(f"“{mode[:60]}” is not a class of the fault catalogue.")
    return Address(kind, item=mode, about=modes[mode].name)

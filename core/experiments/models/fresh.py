"""Fresh flights for what is asked of the shipped models: no data set holds their seeds."""

from collections.abc import Iterator
from dataclasses import dataclass

from core.diagnosis.predict import Diagnoser, Residual, load_diagnoser
from core.errors import MirrorTwinError
from core.fmea.catalogue import class_ids
from core.fmea.fault import Fault
from core.seeds import FRESH_SEED
from core.twin.plan import Plan

FRESH_ONSET_S = 60.0
FRESH_DURATION_S = 200.0
FRESH_SEVERITIES = (0.3, 0.6, 1.0)

RESIDUALS: tuple[Residual, ...] = ("paired", "surrogate")


@dataclass(frozen=True, slots=True)
class FreshRun:
    """A flight to be flown; ``plan.seed`` is its own."""

    plan: Plan
    fault: Fault


def fresh_runs(
    repeats: int, severities: tuple[float, ...] = FRESH_SEVERITIES
) -> Iterator[FreshRun]:
    """Every fault at every severity, ``repeats`` flights each; healthy ones as many."""
    seed = FRESH_SEED
    for mode in class_ids():
        for severity in severities:
            for _ in range(repeats):
                plan = Plan.sampled(seed, duration_s=FRESH_DURATION_S)
                yield FreshRun(plan, Fault(mode, severity, FRESH_ONSET_S))
                seed += 1


def shipped() -> dict[Residual, Diagnoser]:
    """The models that are there; raises `MirrorTwinError` if there is none."""
    found: dict[Residual, Diagnoser] = {}
    problem: MirrorTwinError | None = None
    for residual in RESIDUALS:
        try:
            found[residual] = load_diagnoser(residual)
        except MirrorTwinError as error:
            problem = error
    if not found and problem is not None:
        raise problem
    return found

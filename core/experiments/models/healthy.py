"""Healthy field flights from which `core.residual.healthy` learns how far residuals stray.

Steady cruises in wind and gusts, and flights with the manoeuvres and mixture of training
(`core.dataset.field_plans`), at every level of turbulence. Their seeds belong to no data set.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from core.dataset.field_plans import field_plan, load_distribution
from core.files import whole_file
from core.fmea.fault import Fault
from core.provenance import provenance
from core.residual.healthy import KINDS, NAME, HealthyResidual, Kind, readable, steps
from core.seeds import HEALTHY_SEED
from core.twin.flight import fly_pair
from core.twin.plan import Plan, Weather

LEVELS = (0.0, 1.0, 2.0, 3.0, 4.0)
FLIGHTS = 8
"""Flights of each kind at each level."""

HEALTHY_DURATION_S = 1200.0

NOMINAL = Fault("nominal", 0.0)


def healthy_plan(kind: Kind, turbulence: float, seed: int) -> Plan:
    """The plan of that seed: a cruise of the paper's box in any wind, or a training flight."""
    if kind == "manoeuvres":
        plan = field_plan(seed, {**load_distribution(), "duration_s": HEALTHY_DURATION_S})
        return replace(plan, weather=replace(plan.weather, turbulence=turbulence))
    rng = np.random.default_rng([seed, 0x4EA2])
    weather = Weather(
        isa_deviation_degc=round(float(rng.uniform(-15.0, 22.0)), 1),
        wind_kt=round(float(rng.uniform(0.0, 25.0)), 1),
        wind_from_deg=round(float(rng.uniform(0.0, 360.0)), 1),
        turbulence=turbulence,
    )
    plan = Plan.sampled(seed, duration_s=HEALTHY_DURATION_S)
    return replace(plan, conditions="field", weather=weather)


def healthy_plans(flights: int = FLIGHTS) -> Iterator[tuple[Kind, float, Plan]]:
    """Every flight with its kind and its level of turbulence."""
    seed = HEALTHY_SEED
    for kind in KINDS:
        for level in LEVELS:
            for _ in range(flights):
                yield kind, level, healthy_plan(kind, level, seed)
                seed += 1


def make_healthy(
    out: Path, progress: Callable[[float], None], flights: int = FLIGHTS
) -> HealthyResidual:
    """Fly them and write ``field-healthy.json``; raises `FlightError` or `StoreError`."""
    planned = list(healthy_plans(flights))

    def flown() -> Iterator[tuple[Kind, float, np.ndarray]]:
        for done, (kind, level, plan) in enumerate(planned, start=1):
            yield kind, level, steps(fly_pair(plan, NOMINAL).residual)
            progress(done / len(planned))

    origin = {
        "first_seed": HEALTHY_SEED,
        "flights_a_level": flights,
        "levels": list(LEVELS),
        "duration_s": HEALTHY_DURATION_S,
        "provenance": provenance(),
    }
    healthy = HealthyResidual.fitted(flown(), origin)
    with whole_file(out / f"{NAME}.json") as temporary:
        temporary.write_text(readable(healthy), encoding="utf-8")
    return healthy

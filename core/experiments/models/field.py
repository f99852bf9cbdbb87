"""What `mirrortwin diagnose` says of field flights, from end to end: onset, verdict, evidence.

Nothing is given away: the flights have wind and gusts, the fault begins at any time, and the
diagnosis has to find out that, when and what. Flights have seeds of their own. The score is taken
on one set; whatever was chosen (`core.diagnosis.predict`, `core.residual.departure`) was chosen on
another, that of ``FIELD_VALIDATION_SEED``, or on those of `core.experiments.models.healthy`.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import plotly.graph_objects as go

from core.diagnosis.diagnosis import Diagnosis
from core.diagnosis.predict import load_diagnoser
from core.diagnosis.scores import scores
from core.experiments.drawing import BLUE, axis, finish
from core.experiments.results import Progress, Result
from core.fmea.catalogue import catalogue, class_ids
from core.fmea.fault import Fault
from core.seeds import FIELD_SEED
from core.twin.flight import fly_pair
from core.twin.plan import Plan, Weather

REPEATS, QUICK_REPEATS = 6, 1
HEALTHY, QUICK_HEALTHY = 40, 2
FIELD_SEVERITY_RANGE = (0.3, 1.0)
FIELD_ONSET_RANGE_S = (60.0, 600.0)
AFTER_S = 300.0
"""Every flight goes on for five minutes after its onset."""

TURBULENCE = {0.0: 0.1, 1.0: 0.65, 2.0: 0.25}
"""Level: share of the flights, as in ``assets/data/realism.toml``."""

NEAR_S = 30.0

NOMINAL = "nominal"


@dataclass(frozen=True, slots=True)
class FieldFlight:
    """One flight to be diagnosed; ``fault`` is nominal in a healthy one."""

    plan: Plan
    fault: Fault


def field_flights(first_seed: int, repeats: int, healthy: int) -> Iterator[FieldFlight]:
    """``repeats`` flights of every fault and ``healthy`` ones, with seeds from ``first_seed``."""
    modes = [mode for mode in class_ids() if mode != NOMINAL for _ in range(repeats)]
    for seed, mode in enumerate([*modes, *[NOMINAL] * healthy], start=first_seed):
        yield _flight(seed, mode)


def _flight(seed: int, mode_id: str) -> FieldFlight:
    rng = np.random.default_rng([seed, 0xF1E1])
    mode = catalogue()[mode_id]
    onset_s = round(float(rng.uniform(*FIELD_ONSET_RANGE_S)), 1)
    weather = Weather(
        isa_deviation_degc=round(float(rng.uniform(-15.0, 22.0)), 1),
        wind_kt=round(float(rng.uniform(0.0, 25.0)), 1),
        wind_from_deg=round(float(rng.uniform(0.0, 360.0)), 1),
        turbulence=float(rng.choice(list(TURBULENCE), p=list(TURBULENCE.values()))),
    )
    plan = replace(
        Plan.sampled(seed, duration_s=onset_s + AFTER_S), conditions="field", weather=weather
    )
    fault = Fault(
        mode=mode_id,
        severity=0.0 if mode_id == NOMINAL else round(float(rng.uniform(*FIELD_SEVERITY_RANGE)), 3),
        onset_s=onset_s,
        cylinder=None if mode.whole_engine else int(rng.choice(4, p=mode.prior)) + 1,
    )
    return FieldFlight(plan, fault)


def run(quick: bool, progress: Progress) -> Result:
    """Fly, diagnose and score; raises `FlightError`, or `MirrorTwinError` where no model is."""
    diagnoser = load_diagnoser(conditions="field")
    flights = list(
        field_flights(
            FIELD_SEED,
            QUICK_REPEATS if quick else REPEATS,
            QUICK_HEALTHY if quick else HEALTHY,
        )
    )
    rows = []
    for done, flight in enumerate(flights, start=1):
        diagnosis = diagnoser.diagnose(fly_pair(flight.plan, flight.fault), flight.plan)
        rows.append(_row(flight, diagnosis))
        progress(done / len(flights))
    found = summarise(rows)
    return Result(
        name="field",
        settings={
            "quick": quick,
            "conditions": "field",
            "first_seed": FIELD_SEED,
            "flights": len(flights),
            "severity": list(FIELD_SEVERITY_RANGE),
            "onset_s": list(FIELD_ONSET_RANGE_S),
            "flown_on_s": AFTER_S,
            "turbulence": {f"{level:g}": share for level, share in TURBULENCE.items()},
            "model": diagnoser.name,
        },
        findings={**found, "rows": rows},
        figure=_figure(found["per_class_f1"]),
        summary=_lines(found),
    )


def _row(flight: FieldFlight, diagnosis: Diagnosis) -> dict[str, Any]:
    fault = flight.fault
    return {
        "mode": fault.mode,
        "severity": fault.severity,
        "onset_s": None if fault.mode == NOMINAL else fault.onset_s,
        "turbulence": flight.plan.weather.turbulence,
        "top": diagnosis.top,
        "probability": round(float(diagnosis.probabilities.max()), 4),
        "found_onset_s": diagnosis.onset_s,
        "evidence": len(diagnosis.evidence),
        "none_of_these": diagnosis.none_of_these,
    }


def summarise(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Scores of whole flights, of the onset, and of healthy flights."""
    classes = class_ids()
    truth = np.array([classes.index(row["mode"]) for row in rows])
    found = np.array([classes.index(row["top"]) for row in rows])
    scored = scores(truth, found, classes)
    faulted = [row for row in rows if row["mode"] != NOMINAL]
    healthy = [row for row in rows if row["mode"] == NOMINAL]
    errors = [
        abs(row["found_onset_s"] - row["onset_s"])
        for row in faulted
        if row["found_onset_s"] is not None
    ]
    return {
        **{name: scored[name] for name in ("n", "accuracy", "macro_f1", "per_class_f1")},
        "named_share": float(np.mean([row["top"] == row["mode"] for row in faulted])),
        "onset": {
            "found_share": len(errors) / len(faulted),
            "within_30_s_share": sum(error <= NEAR_S for error in errors) / len(faulted),
            "median_error_s": float(np.median(errors)) if errors else None,
            "mean_error_s": float(np.mean(errors)) if errors else None,
        },
        "healthy": {
            "flights": len(healthy),
            "false_onsets": sum(row["found_onset_s"] is not None for row in healthy),
            "evidence_lines": sum(row["evidence"] for row in healthy),
            "named_with_a_fault_above_half": sum(
                row["top"] != NOMINAL and row["probability"] > 0.5 for row in healthy
            ),
        },
        "refused_share": float(np.mean([row["none_of_these"] for row in faulted])),
        "confusion": scored["confusion"],
        "confused": scored["confused"],
    }


def _lines(found: dict[str, Any]) -> tuple[str, ...]:
    onset, healthy = found["onset"], found["healthy"]
    return (
        f"{found['n']} flights: macro-F1 {found['macro_f1']:.3f}, faults named "
        f"{found['named_share']:.0%}, none of these {found['refused_share']:.0%}",
        f"onset found in {onset['found_share']:.0%}, within 30 s in "
        f"{onset['within_30_s_share']:.0%} of the faulted; median error "
        f"{onset['median_error_s']:.0f} s",
        f"{healthy['flights']} healthy flights: {healthy['false_onsets']} false onsets, "
        f"{healthy['evidence_lines']} lines of false evidence, "
        f"{healthy['named_with_a_fault_above_half']} named with a fault above one half",
    )


def _figure(per_class_f1: dict[str, float]) -> go.Figure:
    """F1 of whole flights by class."""
    figure = go.Figure()
    figure.add_bar(
        y=list(per_class_f1), x=list(per_class_f1.values()), orientation="h", marker_color=BLUE,
        name="whole flights",
    )  # fmt: skip
    figure.update_xaxes(axis("F1 of whole field flights, diagnosed from end to end", range=[0, 1]))
    figure.update_yaxes(axis(autorange="reversed", showgrid=False))
    return finish(figure, 900, 620, margin={"l": 230, "r": 30, "t": 40, "b": 60})

"""Whether the diagnosis says "none of these" to what it has never learnt.

Known are fresh flights of all classes. Unknown are a sensor that sticks at the onset, two faults
at once, and single faults in flights far outside the envelope of the training. The sensor is stuck
in the log of the faulted aircraft alone, after the flight: no fault of the twin can do that. Two
faults are added up as residuals on one mirror, of subsystems that hardly meet.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import plotly.graph_objects as go
from sklearn.metrics import roc_auc_score

from core.channels import CHANNEL_INDEX
from core.clock import DT_S
from core.diagnosis.diagnosis import Diagnosis
from core.diagnosis.predict import Diagnoser, Residual
from core.experiments.drawing import RESIDUAL_COLOURS, axis, finish
from core.experiments.models.fresh import FRESH_DURATION_S, FRESH_ONSET_S, fresh_runs, shipped
from core.experiments.results import Progress, Result
from core.fmea.fault import Fault
from core.seeds import FRESH_SEED, UNKNOWN_SEED
from core.twin.flight import fly_pair
from core.twin.plan import Plan, Weather
from core.twin.trajectory import Pair, Trajectory

REPEATS, QUICK_REPEATS = 3, 1

STUCK = ("E1 OilT", "E1 CHT3", "E1 EGT2", "AltMSL", "volt1", "E1 RPM")
TOGETHER = (
    (
        Fault("baffle_crack", 0.8, FRESH_ONSET_S, 1),
        Fault("oil_cooler_maintenance", 0.8, FRESH_ONSET_S),
    ),
    (Fault("baffle_seal", 0.8, FRESH_ONSET_S), Fault("rocker_cover_leak", 0.8, FRESH_ONSET_S)),
    (
        Fault("intake_gasket_leak", 0.8, FRESH_ONSET_S, 2),
        Fault("engine_seal_loose", 0.8, FRESH_ONSET_S),
    ),
    (
        Fault("baffle_plug", 0.8, FRESH_ONSET_S, 4),
        Fault("cylinder_compression", 0.8, FRESH_ONSET_S, 2),
    ),
)
OUTSIDE = (
    Fault("baffle_crack", 0.8, FRESH_ONSET_S),
    Fault("oil_cooler_maintenance", 0.8, FRESH_ONSET_S),
    Fault("intake_gasket_leak", 0.8, FRESH_ONSET_S),
    Fault("cylinder_compression", 0.8, FRESH_ONSET_S),
    Fault("nominal", 0.0, FRESH_ONSET_S),
)

Flight = tuple[Plan, Pair]


def run(quick: bool, progress: Progress) -> Result:
    """Fly, diagnose and tell; raises `FlightError`, or `MirrorTwinError` where no model is."""
    diagnosers = shipped()
    repeats = QUICK_REPEATS if quick else REPEATS
    groups: dict[str, Callable[[], Iterator[Flight]]] = {
        "known": lambda: _known(repeats),
        "stuck sensor": lambda: _stuck(repeats),
        "two faults at once": lambda: _together(repeats),
        "outside the envelope": lambda: _outside(repeats),
    }
    found: dict[Residual, dict[str, list[Diagnosis]]] = {name: {} for name in diagnosers}
    for done, (group, flights) in enumerate(groups.items()):
        for plan, pair in flights():
            for residual, diagnoser in diagnosers.items():
                found[residual].setdefault(group, []).append(diagnoser.diagnose(pair, plan))
        progress((done + 1) / len(groups))
    rows = [
        _row(residual, group, diagnoses, found[residual]["known"], diagnosers[residual])
        for residual in found
        for group, diagnoses in found[residual].items()
    ]
    return Result(
        name="unknown",
        settings={
            "quick": quick,
            "conditions": "lab",
            "first_seeds": {"known": FRESH_SEED, "unknown": UNKNOWN_SEED},
            "threshold": "the energy that 1 % of validation windows exceed (see the model's card)",
            "models": {name: diagnoser.name for name, diagnoser in diagnosers.items()},
        },
        findings={"rows": rows},
        figure=_figure(rows),
        summary=tuple(map(_line, rows)),
    )


def _known(repeats: int) -> Iterator[Flight]:
    for each in fresh_runs(repeats, (0.6,)):
        yield each.plan, fly_pair(each.plan, each.fault)


def _stuck(repeats: int) -> Iterator[Flight]:
    row = round(FRESH_ONSET_S / DT_S)
    for number, (name, _) in enumerate((name, each) for name in STUCK for each in range(repeats)):
        plan = Plan.sampled(UNKNOWN_SEED + number, duration_s=FRESH_DURATION_S)
        pair = fly_pair(plan, Fault("nominal"))
        channels = pair.faulted.channels.copy()
        channels[row:, CHANNEL_INDEX[name]] = channels[row, CHANNEL_INDEX[name]]
        yield plan, Pair(_logged(pair.faulted, channels), pair.mirror)


def _together(repeats: int) -> Iterator[Flight]:
    couples = [couple for couple in TOGETHER for _ in range(repeats)]
    for number, (first, second) in enumerate(couples, start=1000):
        plan = Plan.sampled(UNKNOWN_SEED + number, duration_s=FRESH_DURATION_S)
        one, other = fly_pair(plan, first), fly_pair(plan, second)
        both = one.faulted.channels + other.residual
        yield plan, Pair(_logged(one.faulted, both), one.mirror)


def _outside(repeats: int) -> Iterator[Flight]:
    faults = [fault for fault in OUTSIDE for _ in range(repeats)]
    for number, fault in enumerate(faults, start=2000):
        plan = Plan(
            altitude_ft=8500.0, speed_kt=85.0, duration_s=FRESH_DURATION_S,
            seed=UNKNOWN_SEED + number, weather=Weather(isa_deviation_degc=-18.0),
        )  # fmt: skip
        yield plan, fly_pair(plan, fault)


def _logged(flight: Trajectory, channels: Any) -> Trajectory:
    return Trajectory(flight.time_s, flight.states, channels)


def _row(
    residual: str,
    group: str,
    diagnoses: list[Diagnosis],
    known: list[Diagnosis],
    diagnoser: Diagnoser,
) -> dict[str, Any]:
    energies, usual = _energies(diagnoses), _energies(known)
    separation = None
    if group != "known":
        truth = np.r_[np.zeros(len(usual)), np.ones(len(energies))]
        separation = float(roc_auc_score(truth, np.r_[usual, energies]))
    return {
        "residual": residual,
        "group": group,
        "runs": len(diagnoses),
        "refused_share": float(np.mean([each.none_of_these for each in diagnoses])),
        "separation_auroc": separation,
        "threshold": float(diagnoser.calibration.threshold)
        if np.isfinite(diagnoser.calibration.threshold)
        else None,
        "taken_for": _counts([each.top for each in diagnoses]),
    }


def _energies(diagnoses: list[Diagnosis]) -> Any:
    return np.array([each.energy for each in diagnoses])


def _counts(names: list[str]) -> dict[str, int]:
    return {name: names.count(name) for name in sorted(set(names), key=lambda n: -names.count(n))}


def _line(row: dict[str, Any]) -> str:
    auroc = row["separation_auroc"]
    apart = "" if auroc is None else f", told from the known with AUROC {auroc:.2f}"
    return (
        f"{row['residual']:<10} {row['group']:<22} none of these: {row['refused_share']:.0%} of "
        f"{row['runs']}{apart}"
    )


def _figure(rows: list[dict[str, Any]]) -> go.Figure:
    """The share that was refused, by group."""
    figure = go.Figure()
    for residual, colour in RESIDUAL_COLOURS.items():
        chosen = [row for row in rows if row["residual"] == residual]
        if chosen:
            figure.add_bar(
                x=[row["group"] for row in chosen], y=[row["refused_share"] for row in chosen],
                name=residual, marker_color=colour,
            )  # fmt: skip
    figure.update_yaxes(axis("Share called none of these", range=[0, 1.02]))
    figure.update_xaxes(axis())
    return finish(figure, 900, 460, barmode="group")

"""How soon the shipped models name a fault, and how well at which severity.

A fault is named once every window from then to the end of its effective window (120 s) says so.
The delay runs from the onset to the end of the first of those windows, which come every 5 s; a
fault that takes its time to show is late by that much whatever the model.
"""

from statistics import median
from typing import Any

import numpy as np
import plotly.graph_objects as go

from core.diagnosis.diagnosis import Diagnosis
from core.diagnosis.naming import named_at
from core.diagnosis.scores import scores
from core.experiments.drawing import RESIDUAL_COLOURS, axis, finish
from core.experiments.models.fresh import FRESH_ONSET_S, FRESH_SEVERITIES, fresh_runs, shipped
from core.experiments.results import Progress, Result
from core.fmea.catalogue import class_ids
from core.seeds import FRESH_SEED
from core.twin.flight import fly_pair

REPEATS, QUICK_REPEATS = 3, 1
QUICK_SEVERITIES = (0.6,)

Row = dict[str, Any]


def run(quick: bool, progress: Progress) -> Result:
    """Fly, diagnose and tell; raises `FlightError`, or `MirrorTwinError` where no model is."""
    diagnosers = shipped()
    severities = QUICK_SEVERITIES if quick else FRESH_SEVERITIES
    runs = list(fresh_runs(QUICK_REPEATS if quick else REPEATS, severities))
    flown: dict[str, list[Row]] = {residual: [] for residual in diagnosers}
    for done, each in enumerate(runs, start=1):
        pair = fly_pair(each.plan, each.fault)
        for residual, diagnoser in diagnosers.items():
            diagnosis = diagnoser.diagnose(pair, each.plan)
            flown[residual].append(
                {
                    "mode": each.fault.mode,
                    "severity": each.fault.severity,
                    "top": diagnosis.top,
                    "delay_s": named_after(diagnosis, each.fault.mode, FRESH_ONSET_S),
                }
            )
        progress(done / len(runs))
    rows = [
        _row(residual, severity, [each for each in flights if each["severity"] == severity])
        for residual, flights in flown.items()
        for severity in severities
    ]
    return Result(
        name="delay",
        settings={
            "quick": quick,
            "conditions": "lab",
            "first_seed": FRESH_SEED,
            "runs": len(runs),
            "onset_s": FRESH_ONSET_S,
            "models": {name: diagnoser.name for name, diagnoser in diagnosers.items()},
        },
        findings={
            "rows": rows,
            "by_mode": {name: _by_mode(flights) for name, flights in flown.items()},
        },
        figure=_figure({name: _by_mode(flights) for name, flights in flown.items()}),
        summary=tuple(map(_line, rows)),
    )


def named_after(diagnosis: Diagnosis, mode: str, onset_s: float) -> float | None:
    """Seconds from the onset until the right answer stays; None if it does not."""
    right = diagnosis.classes.index(mode)
    named_s = named_at(diagnosis.time_s, diagnosis.probabilities_over_time, right, onset_s)
    return None if named_s is None else named_s - onset_s


def _row(residual: str, severity: float, flights: list[Row]) -> Row:
    classes = class_ids()
    truth = np.array([classes.index(each["mode"]) for each in flights])
    found = np.array([classes.index(each["top"]) for each in flights])
    scored = scores(truth, found, classes)
    return {
        "residual": residual,
        "severity": severity,
        "runs": len(flights),
        **{name: scored[name] for name in ("accuracy", "macro_f1", "per_class_f1", "confused")},
        **_delays([each for each in flights if each["mode"] != "nominal"]),
    }


def _delays(flights: list[Row]) -> Row:
    delays = [each["delay_s"] for each in flights if each["delay_s"] is not None]
    return {
        "median_delay_s": median(delays) if delays else None,
        "worst_delay_s": max(delays, default=None),
        "never_named_share": 1.0 - len(delays) / len(flights) if flights else None,
    }


def _by_mode(flights: list[Row]) -> dict[str, Row]:
    return {
        mode: _delays([each for each in flights if each["mode"] == mode])
        for mode in class_ids()
        if mode != "nominal"
    }


def _line(row: Row) -> str:
    delay = "-" if row["median_delay_s"] is None else f"{row['median_delay_s']:.0f} s"
    return (
        f"{row['residual']:<10} severity {row['severity']:.1f}: verdicts' macro-F1 "
        f"{row['macro_f1']:.3f}, named after {delay} (median), never "
        f"{row['never_named_share']:.0%}"
    )


def _figure(by_mode: dict[str, dict[str, Row]]) -> go.Figure:
    """Median delay by fault; a fault that was never named has no bar."""
    figure = go.Figure()
    for residual, modes in by_mode.items():
        figure.add_bar(
            y=list(modes), x=[each["median_delay_s"] for each in modes.values()],
            name=residual, orientation="h", marker_color=RESIDUAL_COLOURS[residual],
        )  # fmt: skip
    figure.update_xaxes(axis("Seconds from onset to a lasting right answer (median)"))
    figure.update_yaxes(axis(autorange="reversed", showgrid=False))
    return finish(
        figure, 900, 720, barmode="group", margin={"l": 230, "r": 30, "t": 60, "b": 60}
    )  # fmt: skip

"""The speed of the twin as a result: `core.experiments.cost.bench` with its picture."""

from statistics import median
from typing import Any

import plotly.graph_objects as go

from core.experiments.cost.bench import FAULT, FULL, MEASURED_PLAN, QUICK, Speed, Workload, measure
from core.experiments.drawing import BLUE, GREEN, INK, axis, finish
from core.experiments.results import Progress, Result

ROUNDS, QUICK_ROUNDS = 10, 3

_GOALS: dict[str, tuple[float, float]] = {
    "trajectory_ratio": (1.0, 1.5),
    "pair_ratio": (2.0, 2.8),
    "long_flight_cost_ratio": (0.9, 1.1),
    "two_worker_speedup": (1.8, 2.0),
}
"""Where we want each: from the best that there can be to the worst that we accept, or about 1."""


def run(quick: bool, progress: Progress) -> Result:
    """Measure and draw."""
    rounds, workload = (QUICK_ROUNDS, QUICK) if quick else (ROUNDS, FULL)
    speed = measure(rounds, workload, progress)
    return Result(
        name="speed",
        settings={
            "quick": quick,
            "conditions": MEASURED_PLAN.conditions,
            "power": MEASURED_PLAN.power,
            "seeds": [MEASURED_PLAN.seed],
            "plan": MEASURED_PLAN.to_dict(),
            "fault": FAULT.to_dict(),
        },
        findings={**speed.to_dict(), "goals": {name: list(goal) for name, goal in _GOALS.items()}},
        figure=draw(speed),
        summary=summary(speed),
    )


def summary(speed: Speed) -> tuple[str, ...]:
    """The four ratios in words, and a warning where they are not to be trusted."""
    lines = tuple(
        f"{label}: {getattr(speed, name):.2f}" for name, label in _labels(speed.workload).items()
    )
    return (*lines, BUSY) if speed.busy else lines


BUSY = (
    "The machine was busy: two workers had less than nine tenths of a core each, so their speedup "
    "says little. Measure again when it is quiet."
)


def draw(speed: Speed) -> go.Figure:
    """Each ratio: a dot a round, a bar at the median, a band where we want it."""
    figure = go.Figure()
    labels = {name: _wrapped(label) for name, label in _labels(speed.workload).items()}
    ratios = [each.ratios() for each in speed.rounds]
    ratios += [each.ratios(speed.workload) for each in speed.long_rounds]
    for row, name in enumerate(labels):
        low, high = _GOALS[name]
        rounds = [each[name] for each in ratios if name in each]
        figure.add_shape(
            type="rect", x0=low, x1=high, y0=row - 0.32, y1=row + 0.32, layer="below",
            line_width=0, fillcolor=GREEN, opacity=0.18,
        )  # fmt: skip
        figure.add_shape(
            type="line", x0=median(rounds), x1=median(rounds), y0=row - 0.32, y1=row + 0.32,
            line={"color": INK, "width": 2.5},
        )  # fmt: skip
        figure.add_scatter(
            x=rounds, y=[row] * len(rounds), mode="markers", name="a round", showlegend=row == 0,
            marker={"color": BLUE, "size": 9, "opacity": 0.6}, hovertemplate="%{x:.2f}",
        )  # fmt: skip
        figure.add_annotation(
            x=median(rounds), y=row - 0.32, text=f"{median(rounds):.2f}", showarrow=False,
            yanchor="bottom",
        )  # fmt: skip
    figure.add_scatter(
        x=[None], y=[None], mode="lines", name="median", line={"color": INK, "width": 2.5}
    )
    figure.add_scatter(
        x=[None], y=[None], mode="markers", name="wanted",
        marker={"color": GREEN, "opacity": 0.3, "size": 16, "symbol": "square"},
    )  # fmt: skip
    figure.update_xaxes(axis(title="Ratio", rangemode="tozero"))
    figure.update_yaxes(_rows(labels))
    return finish(figure, 1000, 480, margin={"l": 270, "r": 30, "t": 70, "b": 60})


def _labels(workload: Workload) -> dict[str, str]:
    hours = f"{workload.long_s / 3600:g} h"
    return {
        "trajectory_ratio": "One flight with all channels, in bare JSBSim loops",
        "pair_ratio": "Faulted flight and mirror, in bare JSBSim loops",
        "long_flight_cost_ratio": f"A second of a {hours} flight, in seconds of a 300 s flight",
        "two_worker_speedup": f"{workload.flights} flights on two workers, speedup over one",
    }


def _wrapped(label: str) -> str:
    return label.replace(", ", ",<br>")


def _rows(labels: dict[str, str]) -> dict[str, Any]:
    return axis(
        tickvals=list(range(len(labels))), ticktext=list(labels.values()),
        range=[len(labels) - 0.4, -0.6], showgrid=False,
    )  # fmt: skip

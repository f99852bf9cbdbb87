"""Paper Fig. 7: six key channels under five faults and in nominal flight."""

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from core.channels import CHANNEL_INDEX, channel, cht_name, egt_name, unit_label
from core.clock import DT_S
from core.experiments.drawing import Array, axis, clock_axis, finish, mark_onset, means
from core.experiments.paper.representative import (
    CYLINDER,
    FIGURES_ONSET_S,
    LINES,
    NOMINAL,
    REPRESENTATIVE,
    fly_modes,
    plan_for,
    settings,
)
from core.experiments.results import Progress, Result
from core.fmea.catalogue import catalogue
from core.twin.plan import Plan
from core.twin.trajectory import Pair

KEY_CHANNELS: tuple[str, ...] = (
    "E1 RPM", cht_name(CYLINDER), egt_name(CYLINDER), "E1 OilT", "E1 OilP", "AltMSL",
)  # fmt: skip

END_S = 30.0
"""What a channel has become is its mean over the last half minute."""


def run(quick: bool, progress: Progress) -> Result:
    """Fly the five faults and draw the six channels; the JSON says what each has become."""
    plan = plan_for(quick)
    pairs = fly_modes(plan, (NOMINAL, *REPRESENTATIVE), progress)
    responses = {mode: response(pair) for mode, pair in pairs.items()}
    return Result(
        name="fig7",
        settings={**settings(plan, quick), "drawn_means_over_s": 1.0},
        findings={"channels": list(KEY_CHANNELS), "faults": responses},
        figure=draw(pairs, plan),
        summary=tuple(
            f"{mode:<24} "
            + ", ".join(
                f"{channel(name).label} {responses[mode][name]['change']:+.1f} {channel(name).unit}"
                for name in KEY_CHANNELS
            )
            for mode in REPRESENTATIVE
        ),
    )


def response(pair: Pair) -> dict[str, dict[str, float]]:
    """Of each key channel: the mirror's and the faulted mean over the last `END_S`, the change."""
    end = slice(-round(END_S / DT_S), None)
    found: dict[str, dict[str, float]] = {}
    for name in KEY_CHANNELS:
        index = CHANNEL_INDEX[name]
        mirror, faulted = (
            float(flight.channels[end, index].mean(dtype=np.float64))
            for flight in (pair.mirror, pair.faulted)
        )
        found[name] = {
            "mirror": round(mirror, 3),
            "faulted": round(faulted, 3),
            "change": round(faulted - mirror, 3),
        }
    return found


def draw(pairs: Mapping[str, Pair], plan: Plan) -> go.Figure:
    """A row a channel on a common clock: what it reads, and magnified what nominal does not show.

    Lines are means over a second. The magnified panels leave out where the failed engine goes.
    """
    rows = len(KEY_CHANNELS)
    figure = make_subplots(
        rows=rows, cols=2, shared_xaxes=True, horizontal_spacing=0.1, vertical_spacing=0.02,
        column_titles=["Reading", "Difference from nominal, magnified"],
    )  # fmt: skip
    for row, name in enumerate(KEY_CHANNELS, start=1):
        _add_channel(figure, row, name, pairs)
    figure.update_xaxes(clock_axis(plan.duration_s))
    figure.update_xaxes(title_text="Flight time (mm:ss)", row=rows)
    mark_onset(figure, FIGURES_ONSET_S, panels=2 * rows)
    return finish(figure, 1200, 1300, hovermode="x unified")


def _add_channel(figure: go.Figure, row: int, name: str, pairs: Mapping[str, Pair]) -> None:
    logged, index = channel(name), CHANNEL_INDEX[name]
    unit = unit_label(logged.unit)
    gone: dict[str, Array] = {}
    for mode, pair in pairs.items():
        reading = means(pair.faulted.channels[:, index])
        gone[mode] = reading - means(pair.mirror.channels[:, index])
        for column, values in ((1, reading), (2, gone[mode])):
            figure.add_scatter(
                x0=0.5, dx=1.0, y=values, mode="lines",
                name=catalogue()[mode].name, legendgroup=mode, showlegend=row == column == 1,
                line=LINES[mode].to_plotly(), row=row, col=column,
                hovertemplate=f"%{{y:.{logged.decimals}f}} {unit}",
            )  # fmt: skip
    moderate = [values for mode, values in gone.items() if mode != "engine_failure"]
    low, high = float(np.min(moderate)), float(np.max(moderate))
    room = 0.12 * max(high - low, 1.0)
    letter = "abcdef"[row - 1]
    figure.update_yaxes(
        axis(title=f"({letter}) {logged.label} ({unit})", tickformat=",d"), row=row, col=1
    )
    figure.update_yaxes(axis(title=unit, range=[low - room, high + room]), row=row, col=2)

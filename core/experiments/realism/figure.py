"""Realism as a picture: levels, noise and ties of our flights against those of real ones."""

from collections.abc import Sequence
from typing import Any

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from core.channels import channel, unit_label
from core.experiments.drawing import BLUE, GREY, VERMILION, axis, finish
from core.experiments.realism.detector import Verdict
from core.experiments.realism.rows import ChannelRow, CorrelationRow

_BAND = {"fillcolor": GREY, "opacity": 0.18, "line_width": 0, "layer": "below"}
_OURS = {"color": BLUE, "symbol": "circle", "size": 9}
_FAILED = {"color": VERMILION, "symbol": "x", "size": 10}
_REAL = {"color": "#222222", "symbol": "line-ns-open", "size": 13, "line_width": 2}


def draw(
    channels: Sequence["ChannelRow"], correlations: Sequence["CorrelationRow"], verdict: Verdict
) -> go.Figure:
    """Four panels: means in the real range, noise ratios, correlations, what gives us away."""
    figure = make_subplots(
        rows=2, cols=2, column_widths=[0.5, 0.5], row_heights=[0.5, 0.5],
        horizontal_spacing=0.16, vertical_spacing=0.11,
        subplot_titles=(
            "(a) Mean in cruise; grey: range of the real readings",
            "(b) White noise, ours to real; grey: a factor 1.5",
            "(c) Correlations: ours, and the real ones (bars) ± 0.25",
            _tells_title(verdict),
        ),
    )  # fmt: skip
    _add_means(figure, channels)
    _add_noise(figure, channels)
    _add_correlations(figure, correlations)
    _add_tells(figure, verdict)
    figure.update_yaxes(autorange="reversed", tickfont_size=11)
    return finish(figure, 1200, 1300, margin={"l": 150, "r": 30, "t": 90, "b": 60})


def _tells_title(verdict: Verdict) -> str:
    if verdict.auc is None:
        return "(d) Too little steady real cruise for the classifier"
    return f"(d) Classifier, AUC {verdict.auc:.2f}: AUC lost without a channel"


def _scatter(figure: go.Figure, row: int, col: int, legend: bool = False, **extra: Any) -> None:
    figure.add_scatter(mode="markers", row=row, col=col, showlegend=legend, **extra)


def _add_means(figure: go.Figure, rows: Sequence["ChannelRow"]) -> None:
    """Each channel on a scale of its own, from the lowest real reading (0) to the highest (1)."""
    known = [row for row in rows if row.mean_held is not None]
    for held, name, marker in ((True, "holds", _OURS), (False, "does not hold", _FAILED)):
        chosen = [row for row in known if row.mean_held is held]
        _scatter(
            figure, 1, 1, True, name=name, marker=marker,
            x=[_place(row.mean_ours, row) for row in chosen],
            y=[channel(row.channel).label for row in chosen],
            hovertext=[_mean_text(row) for row in chosen], hoverinfo="text",
        )  # fmt: skip
    _scatter(
        figure, 1, 1, True, name="real", marker=_REAL, hoverinfo="skip",
        x=[_place(row.mean_real, row) for row in known],
        y=[channel(row.channel).label for row in known],
    )  # fmt: skip
    figure.add_vrect(x0=0.0, x1=1.0, row=1, col=1, **_BAND)
    figure.update_xaxes(
        axis(tickvals=[0, 1], ticktext=["lowest", "highest"], range=[-0.2, 1.2]), row=1, col=1
    )


def _place(value: float | None, row: "ChannelRow") -> float:
    assert value is not None and row.low_real is not None and row.high_real is not None
    return (value - row.low_real) / ((row.high_real - row.low_real) or 1.0)


def _mean_text(row: "ChannelRow") -> str:
    return (
        f"{row.channel}: ours {row.mean_ours:g}, real {row.mean_real:g} "
        f"({row.low_real:g} to {row.high_real:g}) {unit_label(row.unit)}"
    )


def _add_noise(figure: go.Figure, rows: Sequence["ChannelRow"]) -> None:
    for held, marker in ((True, _OURS), (False, _FAILED)):
        chosen = [row for row in rows if row.noise_held is held]
        _scatter(
            figure, 1, 2, marker=marker, x=[row.noise_ratio for row in chosen],
            y=[channel(row.channel).label for row in chosen], hoverinfo="text",
            hovertext=[
                f"{row.channel}: ours {row.noise_ours:g}, real {row.noise_real:g} "
                f"{unit_label(row.unit)}"
                for row in chosen
            ],
        )  # fmt: skip
    figure.add_vrect(x0=1.0 / 1.5, x1=1.5, row=1, col=2, **_BAND)
    figure.update_xaxes(axis(type="log", tickvals=[0.5, 1, 2], range=[-0.31, 0.31]), row=1, col=2)


def _add_correlations(figure: go.Figure, rows: Sequence["CorrelationRow"]) -> None:
    known = [row for row in rows if row.held is not None]
    _scatter(
        figure, 2, 1, x=[row.real for row in known], y=[_pair(row) for row in known],
        marker=_REAL, error_x={"type": "constant", "value": 0.25, "color": GREY, "thickness": 5},
        hoverinfo="skip",
    )  # fmt: skip
    for held, marker in ((True, _OURS), (False, _FAILED)):
        chosen = [row for row in known if row.held is held]
        _scatter(
            figure, 2, 1, marker=marker, x=[row.ours for row in chosen],
            y=[_pair(row) for row in chosen], hoverinfo="text",
            hovertext=[f"{_pair(row)}: ours {row.ours:.2f}, real {row.real:.2f}" for row in chosen],
        )  # fmt: skip
    figure.update_xaxes(axis(range=[-1.1, 1.1]), row=2, col=1)
    figure.update_yaxes(tickfont_size=9, row=2, col=1)


def _pair(row: "CorrelationRow") -> str:
    a, b = (name.removeprefix("E1 ") for name in row.channels)
    return f"{a}, {b}{'' if row.span == 'cruise' else ' (30 s)'}"


def _add_tells(figure: go.Figure, verdict: Verdict) -> None:
    figure.add_bar(
        x=list(verdict.leans_on.values()),
        y=[channel(name).label for name in verdict.leans_on],
        orientation="h", marker_color=BLUE, showlegend=False, row=2, col=2,
    )  # fmt: skip
    figure.update_xaxes(axis(title="AUC lost"), row=2, col=2)

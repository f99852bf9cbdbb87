"""The sign matrix as a picture: what was expected, what the twin does, where the two differ."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from core.channels import channel, unit_label
from core.experiments.drawing import BLACK, INK, finish
from core.experiments.signs.rows import Row
from core.fmea.catalogue import catalogue

_DIVERGING = [[0.0, "#0072B2"], [0.5, "#FFFFFF"], [1.0, "#D55E00"]]
_DECADES = 2.5
"""Colour saturates at 10^2.5 times a channel's wander."""

_GLYPHS = {"+": "+", "-": "−", "0": "0", "~": "~"}


def draw(rows: Sequence["Row"], channels: Sequence[str]) -> go.Figure:
    """A cell a mode and channel: its sign as expected, coloured by the shift found."""
    modes = list(dict.fromkeys(row.fault for row in rows))
    labels = [channel(name).label for name in channels]
    names = [catalogue()[mode].name for mode in modes]
    shape = (len(modes), len(channels))
    strength = np.array([_strength(row) for row in rows]).reshape(shape)
    figure = go.Figure(
        go.Heatmap(
            x=labels, y=names, z=strength, zmin=-_DECADES, zmax=_DECADES,
            colorscale=_DIVERGING, xgap=2, ygap=2,
            text=np.array([_GLYPHS[row.expected] for row in rows]).reshape(shape),
            texttemplate="%{text}",
            customdata=np.array([_hover(row) for row in rows]).reshape(shape),
            hovertemplate="%{customdata}<extra></extra>",
            colorbar={
                "title": {"text": "shift found,<br>in sd of the<br>channel's wander"},
                "tickvals": [-2, -1, 0, 1, 2],
                "ticktext": ["−100", "−10", "below 1", "+10", "+100"],
                "outlinewidth": 0, "len": 0.6,
            },
        )
    )  # fmt: skip
    failing = [row for row in rows if _fails(row)]
    for text, symbol, chosen in (
        (
            "sign or range not as expected",
            "square-open",
            [row for row in failing if not row.disputed],
        ),
        ("the same, and disputed", "diamond-open", [row for row in failing if row.disputed]),
    ):
        figure.add_scatter(
            x=[channel(row.channel).label for row in chosen],
            y=[catalogue()[row.fault].name for row in chosen],
            mode="markers", name=text, showlegend=bool(chosen), hoverinfo="skip",
            marker={"symbol": symbol, "size": 28, "color": BLACK, "line_width": 2.5},
        )  # fmt: skip
    figure.update_xaxes(side="top", tickangle=-40, showgrid=False, linecolor=INK)
    figure.update_yaxes(autorange="reversed", showgrid=False)
    return finish(
        figure, 1200, 900, margin={"l": 190, "r": 20, "t": 110, "b": 60},
        legend_y=0.01, legend_yanchor="bottom",
    )  # fmt: skip


def _fails(row: "Row") -> bool:
    return row.held is False or (row.held is not None and not row.within)


def _strength(row: "Row") -> float:
    """Signed decades above the channel's wander, 0 below it."""
    ratio = abs(row.delta) / row.resolution
    return float(np.sign(row.delta) * np.log10(ratio)) if ratio > 1.0 else 0.0


def _hover(row: "Row") -> str:
    unit = unit_label(row.unit)
    found = ", ".join(f"{value:+.2f} at {s}" for s, value in row.deltas_by_severity.items())
    text = (
        f"<b>{catalogue()[row.fault].name}</b>, {row.channel}<br>"
        f"expected {row.expected}, {row.low:g} to {row.high:g} {unit}<br>found {found}"
    )
    return text + (f"<br>disputed: {row.disputed}" if row.disputed else "")

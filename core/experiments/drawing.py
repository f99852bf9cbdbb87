"""How the experiments' figures look: for print on white paper, readable without colour vision.

The app has its own colours (``app.theme``), made for its light and dark surfaces and for its rule
that green, amber and red mean status. Figures for print use the palette of Okabe and Ito (2008),
which stays distinct under the common colour-vision deficiencies, and never colour alone: lines
differ in dash as well.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from core.clock import DT_S

Array = NDArray[np.floating[Any]]

BLACK, ORANGE, SKY, GREEN, BLUE, VERMILION, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00", "#CC79A7",
)  # fmt: skip
GREY = "#8C8C8C"
RESIDUAL_COLOURS = {"paired": BLUE, "surrogate": ORANGE}
INK, GRID = "#222222", "#E4E4E4"

FONT = {"family": "Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif", "size": 13, "color": INK}


@dataclass(frozen=True, slots=True)
class Line:
    """How one flight is drawn in every panel of a figure."""

    colour: str
    dash: str
    width: float

    def to_plotly(self) -> dict[str, Any]:
        """As Plotly's ``line``."""
        return {
            "color": self.colour, "dash": self.dash, "width": self.width, "simplify": False,
        }  # fmt: skip


def axis(title: str = "", **extra: Any) -> dict[str, Any]:
    """An axis of a printed figure: ink line, light grid, ticks outside."""
    return {
        "showline": True, "linecolor": INK, "linewidth": 1, "gridcolor": GRID, "zeroline": False,
        "ticks": "outside", "tickcolor": INK, "ticklen": 4,
        "title": {"text": title, "font": FONT, "standoff": 8}, **extra,
    }  # fmt: skip


def clock_axis(duration_s: float, **extra: Any) -> dict[str, Any]:
    """A flight-time axis in seconds, labelled mm:ss each minute."""
    minutes = range(int(duration_s // 60) + 1)
    return axis(
        range=[0, duration_s],
        tickvals=[60 * minute for minute in minutes],
        ticktext=[f"{minute:02d}:00" for minute in minutes],
        **extra,
    )


def finish(figure: go.Figure, width: int, height: int, **extra: Any) -> go.Figure:
    """Give the figure its size and the common look, the legend above it; returns it."""
    figure.update_layout(
        width=width, height=height, font=FONT, paper_bgcolor="white", plot_bgcolor="white",
        margin={"l": 70, "r": 20, "t": 90, "b": 60},
        legend={
            "orientation": "h", "x": 0.5, "xanchor": "center", "y": 0.99, "yanchor": "top",
            "yref": "container", "itemwidth": 45, "font_size": 14,
        },
    )  # fmt: skip
    figure.update_annotations(font=FONT)
    return figure.update_layout(**extra)


def mark_onset(figure: go.Figure, at: float, panels: int) -> None:
    """A dotted vertical line, named in the first, in each of the first ``panels`` flat panels.

    ``at`` is in the units of their x axes. (Plotly's own ``add_vline`` fails beside a 3D panel.)
    """
    for panel in range(1, panels + 1):
        number = "" if panel == 1 else str(panel)
        figure.add_shape(
            type="line", x0=at, x1=at, y0=0, y1=1, xref=f"x{number}", yref=f"y{number} domain",
            line={"color": INK, "width": 1, "dash": "dot"},
        )  # fmt: skip
    figure.add_annotation(
        text="onset", x=at, y=0, xref="x", yref="y domain", xanchor="left", yanchor="bottom",
        xshift=3, showarrow=False,
    )  # fmt: skip


def means(values: Array, seconds: float = 1.0) -> Array:
    """Means over consecutive stretches of ``seconds``; values (n, ...) at 50 Hz."""
    width = round(seconds / DT_S)
    whole = len(values) // width * width
    averaged: Array = values[:whole].reshape(-1, width, *values.shape[1:]).mean(axis=1)
    return averaged

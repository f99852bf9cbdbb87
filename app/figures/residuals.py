"""The residual heat strip: all channels against time, in standard deviations of the noise."""

import numpy as np
from numpy.typing import NDArray

from app import theme
from app.figures.axes import (
    Array,
    Array32,
    Figure,
    bare_layout,
    moments,
    onset_mark,
    packed,
    time_axis,
)
from core.channels import CHANNELS

TIME_BINS = 150
"""Time bins of the strip: 2 s each in a 300 s flight."""

SATURATION_SIGMA = 8.0
"""Colour is full here; a healthy channel rarely passes 4."""

NOISE_SIGMA: NDArray[np.float64] = np.array([channel.sigma for channel in CHANNELS])


def binned_sigma(time_s: Array, residual: Array, duration_s: float) -> Array32:
    """Residuals in sigma, (n_channels, `TIME_BINS`): of each bin the value farthest from zero.

    ``residual`` is (n, n_channels) in channel units. Bins not flown yet are NaN, drawn as nothing.
    """
    sigma = np.asarray(residual) / NOISE_SIGMA
    strip = np.full((TIME_BINS, len(CHANNELS)), np.nan, dtype=np.float32)
    bins = np.minimum((np.asarray(time_s) / duration_s * TIME_BINS).astype(int), TIME_BINS - 1)
    starts = np.flatnonzero(np.diff(bins, prepend=-1))
    if len(starts):
        highest = np.maximum.reduceat(sigma, starts)
        lowest = np.minimum.reduceat(sigma, starts)
        strip[bins[starts]] = np.where(highest > -lowest, highest, lowest)
    return strip.T


def heat_strip(
    time_s: Array, residual: Array, *, duration_s: float, onset_s: float | None
) -> Figure:
    """Which channel left its mirror, when and which way; see `binned_sigma` for the inputs."""
    strip = binned_sigma(time_s, residual, duration_s)
    edges = np.linspace(0.0, duration_s, TIME_BINS + 1)
    labels = [channel.label for channel in CHANNELS]
    bars = {
        "type": "heatmap",
        "x": moments(edges),
        "y": list(range(len(CHANNELS))),
        "z": packed(strip),
        "zmin": -SATURATION_SIGMA,
        "zmax": SATURATION_SIGMA,
        "colorscale": [list(stop) for stop in theme.DIVERGING],
        "ygap": 1,
        "hovertemplate": "%{y} at %{x}: %{z:+.1f} σ<extra></extra>",
        # Above the rows, so that they have the whole width.
        "colorbar": {
            "orientation": "h",
            "x": 0.5,
            "y": 1.0,
            "yanchor": "bottom",
            "thickness": 7,
            "len": 1.0,
            "xpad": 0,
            "ypad": 2,
            "outlinewidth": 0,
            "ticks": "",
            "tickvals": [-8, -4, 0, 4, 8],
            "ticktext": ["−8 σ", "−4", "0", "+4", "+8 σ"],
        },
    }
    layout = bare_layout(
        margin={"l": 136, "r": 14, "t": 4, "b": 20},
        hovermode="closest",
        xaxis=time_axis(duration_s, showgrid=False),
        yaxis={
            "range": [len(CHANNELS) - 0.5, -0.5],
            "tickvals": list(range(len(CHANNELS))),
            "ticktext": labels,
            "ticks": "",
            "showgrid": False,
            "fixedrange": True,
            "zeroline": False,
            "tickfont": {"size": 10.5},
        },
        shapes=onset_mark(onset_s),
    )
    return {"data": [bars], "layout": layout}

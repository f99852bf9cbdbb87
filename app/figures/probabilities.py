"""Class probabilities against time, the leading classes in colour and named."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from app import theme
from app.figures.axes import (
    Array,
    Figure,
    along,
    bare_layout,
    kept_rows,
    moment,
    onset_mark,
    packed,
    time_axis,
)
from core.clock import clock

LEADERS = len(theme.CLASS_COLOURS)

NEGLIGIBLE = 0.02
"""Below this throughout, a class's line would lie on the axis: it is left out."""

CLASS_POINTS = 240
"""A window every 5 s makes 1,440 in 2 h, and the chart is redrawn every few windows."""

MIN_LEAD = 0.15
"""A class that leads for this share of the flight has its name on the chart: it has room there."""


def leaders(classes: Sequence[str], probabilities: Array, k: int = LEADERS) -> list[str]:
    """The ``k`` most probable classes, best first; ``probabilities`` is (n_classes,)."""
    order = np.argsort(-np.asarray(probabilities), kind="stable")[:k]
    return [classes[int(index)] for index in order]


def class_colours(ranking: Sequence[str]) -> dict[str, str]:
    """Colour of each leading class, in the order of `theme.CLASS_COLOURS`."""
    return dict(zip(ranking, theme.CLASS_COLOURS, strict=False))


def probability_figure(
    names: Mapping[str, str],
    time_s: Array,
    probabilities: Array,
    ranking: Sequence[str],
    *,
    duration_s: float,
    onset_s: float | None,
) -> Figure:
    """Probability of every class that matters over the flight.

    ``names`` maps the ids, in the order of the columns of ``probabilities`` (k, n_classes), to
    names for people; ``time_s`` (k,) is the end of each window; ``ranking`` names the classes to
    colour, best first.
    """
    colours = class_colours(ranking)
    shares = np.asarray(probabilities)
    label = f"onset {clock(onset_s)}" if onset_s is not None else ""
    layout = bare_layout(
        margin={"l": 38, "r": 18, "t": 18, "b": 20},
        hovermode="closest",
        xaxis=time_axis(duration_s),
        yaxis={
            "range": [-0.02, 1.02],
            "tickformat": ".0%",
            "tickvals": [0, 0.5, 1],
            "ticks": "",
            "zeroline": False,
            "fixedrange": True,
        },
        shapes=onset_mark(onset_s, label=label),
        annotations=_names_on_lines(names, time_s, shares, duration_s),
    )
    columns = {mode: index for index, mode in enumerate(names)}
    # Leaders last, so that they lie on top.
    likely = [mode for mode in names if shares[:, columns[mode]].max(initial=0.0) >= NEGLIGIBLE]
    order = [*(mode for mode in likely if mode not in colours), *reversed(colours)]
    lines = {mode: shares[:, columns[mode]] for mode in order}
    drawn = {mode: kept_rows(time_s, line, CLASS_POINTS) for mode, line in lines.items()}
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            "name": names[mode],
            **along(time_s[drawn[mode]]),
            "y": packed(lines[mode][drawn[mode]]),
            "line": {
                "color": colours.get(mode, theme.CLASS_REST),
                "width": 2 if mode in colours else 0.8,
            },
            "opacity": 1.0 if mode in colours else 0.5,
            "hovertemplate": "%{y:.0%} at %{x}",
        }
        for mode in order
    ]
    return {"data": traces, "layout": layout}


def _names_on_lines(
    names: Mapping[str, str], time_s: Array, shares: Array, duration_s: float
) -> list[dict[str, Any]]:
    """The name of each class that leads for a while, under its line, mid-way through its lead."""
    if not len(time_s):
        return []
    first = shares.argmax(axis=1)
    labels = list(names.values())
    annotations = []
    for column in np.unique(first):
        led = np.flatnonzero(first == column)
        if float(time_s[led[-1]] - time_s[led[0]]) < MIN_LEAD * duration_s:
            continue
        middle = led[len(led) // 2]
        annotations.append(
            {
                "x": moment(float(time_s[middle])),
                "y": float(shares[middle, column]),
                "text": labels[column],
                "showarrow": False,
                "yanchor": "top",
                "yshift": -3,
                "font": {"size": 10},
            }
        )
    return annotations

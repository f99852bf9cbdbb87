"""Scores as charts: ours beside the paper's, and the confusion matrix."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app import theme
from app.figures.axes import Figure, bare_layout

BAR_PX = 34


def beside_paper(
    rows: Sequence[Mapping[str, Any]], measure: str, title: str, *, log: bool = False
) -> Figure:
    """A row a scheme: the paper's value as an open diamond, ours as a dot, a line between.

    ``rows`` hold ``scheme``, ``measure`` and ``paper_measure``, None where there is none; ours may
    carry its spread as ``measure_sd``.
    """
    places = list(range(len(rows)))
    ours = [row.get(measure) for row in rows]
    theirs = [row.get(f"paper_{measure}") for row in rows]
    spreads = [row.get(f"{measure}_sd") or 0.0 for row in rows]
    both = [
        (place, mine, paper)
        for place, mine, paper in zip(places, ours, theirs, strict=True)
        if mine is not None and paper is not None
    ]
    between: dict[str, Any] = {
        "type": "scatter",
        "mode": "lines",
        "x": [value for _, mine, paper in both for value in (mine, paper, None)],
        "y": [value for place, _, _ in both for value in (place, place, None)],
        "line": {"color": theme.MIRROR, "width": 2},
        "hoverinfo": "skip",
        "showlegend": False,
    }
    layout = bare_layout(
        margin={"l": 8, "r": 16, "t": 6, "b": 38},
        hovermode="closest",
        showlegend=True,
        legend={"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom", "font": {"size": 11}},
        height=90 + BAR_PX * len(rows),
        xaxis={
            "title": {"text": title, "font": {"size": 11}},
            "type": "log" if log else "linear",
            "zeroline": False,
            "ticks": "",
            **({"dtick": 1} if log else {}),
        },
        yaxis={
            "range": [len(rows) - 0.4, -0.6],
            "tickvals": places,
            "ticktext": [row["scheme"] for row in rows],
            "ticks": "",
            "zeroline": False,
            "fixedrange": True,
            "automargin": True,
            "tickfont": {"size": 11},
        },
    )
    return {
        "data": [
            between,
            _dots("paper", theirs, places, [0.0] * len(rows), theme.MIRROR, "diamond-open"),
            _dots("ours", ours, places, spreads, theme.FAULTED, "circle"),
        ],
        "layout": layout,
    }


def _dots(
    name: str,
    values: Sequence[float | None],
    places: Sequence[int],
    spreads: Sequence[float],
    colour: str,
    symbol: str,
) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "markers",
        "name": name,
        "x": list(values),
        "y": list(places),
        "marker": {"color": colour, "symbol": symbol, "size": 11, "line": {"width": 2}},
        "error_x": {
            "array": list(spreads), "thickness": 1.5, "width": 4, "color": colour,
            "visible": any(spreads),
        },
        "hovertemplate": "%{y}: %{x:.4g}<extra>" + name + "</extra>",
    }  # fmt: skip


def confusion_figure(names: Sequence[str], counts: Sequence[Sequence[int]]) -> Figure:
    """Rows injected, columns diagnosed; colour by the share of the row, counts in the cells.

    ``counts`` is (n, n) in the order of ``names``. Right answers are pale, so that the mistakes
    stand out.
    """
    table = np.asarray(counts, dtype=float)
    shares = table / np.maximum(table.sum(axis=1, keepdims=True), 1.0)
    n = len(names)
    shared: dict[str, Any] = {
        "type": "heatmap",
        "x": list(range(n)),
        "y": list(range(n)),
        "xgap": 1,
        "ygap": 1,
        "showscale": False,
        "customdata": [
            [f"{names[i]} diagnosed as {names[j]}: {int(table[i, j])} of {int(table[i].sum())}"
             for j in range(n)]
            for i in range(n)
        ],
        "hovertemplate": "%{customdata}<extra></extra>",
    }  # fmt: skip
    text = [[str(int(count)) if count else "" for count in row] for row in table]
    ticks = {
        "tickvals": list(range(n)), "ticktext": list(names), "ticks": "", "showgrid": False,
        "zeroline": False, "fixedrange": True, "tickfont": {"size": 10}, "automargin": True,
    }  # fmt: skip
    return {
        "data": [
            {
                **shared,
                "z": _kept(shares, np.eye(n, dtype=bool)),
                "zmin": 0.0,
                "zmax": 1.0,
                "colorscale": [[0, "rgba(47,129,216,0)"], [1, "rgba(47,129,216,0.28)"]],
                "text": text,
                "texttemplate": "%{text}",
            },
            {
                **shared,
                "z": _kept(shares, ~np.eye(n, dtype=bool) & (shares > 0.0)),
                "zmin": 0.0,
                "zmax": 0.2,
                "colorscale": [[0, "rgba(180,85,201,0.25)"], [1, "rgba(180,85,201,0.95)"]],
                "text": text,
                "texttemplate": "%{text}",
            },
        ],
        "layout": bare_layout(
            margin={"l": 8, "r": 8, "t": 8, "b": 8},
            hovermode="closest",
            height=640,
            xaxis={**ticks, "tickangle": -50, "title": {"text": "diagnosed as", "standoff": 8}},
            yaxis={**ticks, "range": [n - 0.5, -0.5], "title": {"text": "injected", "standoff": 8}},
        ),
    }


def _kept(values: NDArray[np.float64], mask: NDArray[np.bool_]) -> list[list[float | None]]:
    """The values under the mask as Plotly takes them, nothing elsewhere."""
    return [
        [round(float(value), 4) if keep else None for value, keep in zip(*line, strict=True)]
        for line in zip(values, mask, strict=True)
    ]

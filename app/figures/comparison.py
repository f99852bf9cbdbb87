"""Several runs in one chart: channels on one time axis, paths from the side and from above."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from app import theme
from app.figures.axes import (
    Array,
    Figure,
    bare_layout,
    kept_rows,
    moments,
    onset_mark,
    packed,
    time_axis,
)
from core.channels import channel, unit_label

MAX_COMPARED = 6
COMPARED_POINTS = 900
OUTLIER = 5.0
LEAST_FT = 2.0
ROW_PX = 170
M_PER_NM = 1852.0
PATH_STATES = ("north_m", "east_m", "altitude_ft")

COLOURS = (*theme.CLASS_COLOURS, "#5f6b78")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot")
"""Colour and dash of each run in turn: either is enough to distinguish runs."""

Kind = Literal["reading", "residual", "difference"]


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """A run to be drawn: ``faulted`` and ``mirror`` hold (n,) arrays by channel or state name."""

    label: str
    duration_s: float
    onset_s: float | None
    time_s: Array
    faulted: Mapping[str, Array]
    mirror: Mapping[str, Array]


def channels_figure(runs: Sequence[Flown], names: Sequence[str], kind: Kind) -> Figure:
    """A panel a channel over one time axis, a line a run; see `values_of` for ``kind``.

    Residuals and differences are scaled to what most runs do (`framed`).
    """
    rows = len(names)
    traces: list[dict[str, Any]] = []
    axes: dict[str, Any] = {}
    gap = 0.18 / max(rows, 1)
    for row, name in enumerate(names):
        suffix = "" if row == 0 else str(row + 1)
        logged = channel(name)
        top = 1.0 - row / rows
        axes[f"yaxis{suffix}"] = {
            "domain": [max(0.0, top - 1.0 / rows + gap), top],
            "title": {
                "text": f"{logged.label}<br>{unit_label(logged.unit)}", "font": {"size": 11},
            },
            "ticks": "", "zeroline": kind != "reading", "nticks": 5,
        }  # fmt: skip
        lines = [values_of(run, runs[0], name, kind) for run in runs]
        if kind != "reading":
            noise = logged.sigma
            axes[f"yaxis{suffix}"]["range"] = framed(lines, 4.0 * noise)
        for place, (run, values) in enumerate(zip(runs, lines, strict=True)):
            drawn = kept_rows(run.time_s[: len(values)], values, COMPARED_POINTS)
            traces.append(
                {
                    **_line(place, run.label),
                    "x": moments(run.time_s[drawn]),
                    "y": packed(values[drawn]),
                    "yaxis": f"y{suffix}",
                    "hovertemplate": f"%{{y:.{logged.decimals}f}} {unit_label(logged.unit)}",
                }
            )
    longest = max((run.duration_s for run in runs), default=300.0)
    onsets = {run.onset_s for run in runs if run.onset_s is not None}
    return {
        "data": traces,
        "layout": bare_layout(
            margin={"l": 62, "r": 12, "t": 8, "b": 24},
            height=70 + ROW_PX * rows,
            hoversubplots="axis",
            xaxis=time_axis(longest, anchor="free", position=0.0),
            shapes=[mark for onset_s in sorted(onsets) for mark in onset_mark(onset_s)],
            **axes,
        ),
    }


def values_of(run: Flown, first: Flown, name: str, kind: Kind) -> Array:
    """The values drawn of a run: readings, residuals, or differences from the first run.

    Differences end with the shorter of the two flights.
    """
    faulted = run.faulted[name]
    if kind == "residual":
        return faulted - run.mirror[name]
    if kind == "difference":
        n = min(len(faulted), len(first.faulted[name]))
        return faulted[:n] - first.faulted[name][:n]
    return faulted


def framed(lines: Sequence[Array], at_least: float) -> list[float]:
    """The range of an axis around zero that shows what most lines do.

    A line that goes more than five times as far as the next does not count: beside a stopped
    engine every other line would look flat. ``at_least`` is the least span to either side.
    """
    reach = sorted((float(np.abs(line).max(initial=0.0)) for line in lines), reverse=True)
    while len(reach) > 1 and reach[1] > at_least and reach[0] > OUTLIER * reach[1]:
        del reach[0]
    limit = max(reach[0] if reach else 0.0, at_least)
    kept = [line for line in lines if float(np.abs(line).max(initial=0.0)) <= limit]
    low = min((float(line.min(initial=0.0)) for line in kept), default=0.0)
    high = max((float(line.max(initial=0.0)) for line in kept), default=0.0)
    room = max(0.12 * (high - low), 0.5 * at_least)
    return [low - room, high + room]


def side_figure(runs: Sequence[Flown], *, against_mirror: bool) -> Figure:
    """Altitude in feet over distance flown; or the altitude lost against its own mirror."""
    traces = []
    drawn = []
    for place, run in enumerate(runs):
        north, east = run.faulted["north_m"], run.faulted["east_m"]
        along_nm = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(north), np.diff(east)))])
        along_nm = along_nm / M_PER_NM
        altitude_ft = run.faulted["altitude_ft"]
        if against_mirror:
            altitude_ft = altitude_ft - run.mirror["altitude_ft"]
        drawn.append(altitude_ft)
        rows = kept_rows(run.time_s, altitude_ft, COMPARED_POINTS)
        traces.append(
            {
                **_line(place, run.label),
                "x": packed(along_nm[rows]),
                "y": packed(altitude_ft[rows]),
                "hovertemplate": "%{y:,.0f} ft at %{x:.2f} nm",
            }
        )
    title = "Altitude less the mirror's, ft" if against_mirror else "Altitude, ft"
    figure = _path_figure(traces, "Distance flown, nm", title)
    if against_mirror:
        figure["layout"]["yaxis"]["range"] = framed(drawn, LEAST_FT)
    return figure


def track_figure(runs: Sequence[Flown]) -> Figure:
    """The ground tracks from above, in nautical miles, both axes to one scale."""
    traces = []
    for place, run in enumerate(runs):
        east_nm, north_nm = (run.faulted[name] / M_PER_NM for name in ("east_m", "north_m"))
        rows = np.linspace(0, len(run.time_s) - 1, min(len(run.time_s), COMPARED_POINTS))
        drawn = rows.astype(np.intp)
        traces.append(
            {
                **_line(place, run.label),
                "x": packed(east_nm[drawn]),
                "y": packed(north_nm[drawn]),
                "hovertemplate": "%{x:.2f} nm east, %{y:.2f} nm north",
            }
        )
    figure = _path_figure(traces, "East, nm", "North, nm")
    figure["layout"]["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1}
    return figure


def _path_figure(traces: list[dict[str, Any]], x_title: str, y_title: str) -> Figure:
    def axis(title: str) -> dict[str, Any]:
        return {
            "title": {"text": title, "font": {"size": 11}}, "ticks": "", "zeroline": False,
            "tickformat": ",~f", "automargin": True,
        }  # fmt: skip

    return {
        "data": traces,
        "layout": bare_layout(
            margin={"l": 60, "r": 12, "t": 8, "b": 40},
            height=330,
            hovermode="closest",
            xaxis=axis(x_title),
            yaxis=axis(y_title),
        ),
    }


def _line(place: int, label: str) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": label,
        "line": {"color": COLOURS[place], "dash": DASHES[place], "width": 1.8},
    }

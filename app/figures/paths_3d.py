"""Several flight paths in 3D, and their separation from the healthy mirror."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from app import theme
from app.figures.axes import Array, Figure, bare_layout, packed
from app.figures.comparison import COLOURS, DASHES, M_PER_NM, Flown
from core.clock import clock
from core.units import FOOT_M as M_PER_FT
from core.units import distance_words

HEIGHT_PX = 440
POINTS_PER_PATH = 500
RUNGS = 16
"""Number of lines from a flight to its mirror, at equal intervals of time."""

RISES = (theme.VERTICAL_SCALE, 1.0)
"""Vertical scales to choose from: as in the live scene, or true to scale."""

_LEAST_WIDTH, _LEAST_HEIGHT = 0.35, 0.18
"""Of the longest side: a flight straight ahead has neither width nor height, and needs a box."""

_ROOM = 0.04
_SIZE = 1.95
_PLACE = "%{z:,.0f} ft<br>%{y:.2f} nm north, %{x:.2f} nm east<extra></extra>"


@dataclass(frozen=True, slots=True)
class Separation:
    """The largest distance of a flight from its mirror, true to scale, and its time."""

    label: str
    distance_m: float
    time_s: float


def separations(runs: Sequence[Flown]) -> list[Separation]:
    """The largest one of each run."""
    found = []
    for run in runs:
        apart_m = np.linalg.norm(_metres(run.faulted) - _metres(run.mirror), axis=0)
        row = int(apart_m.argmax())
        found.append(Separation(run.label, float(apart_m[row]), float(run.time_s[row])))
    return found


def described(runs: Sequence[Flown]) -> str:
    """A description of the paths for those who cannot see them."""
    count = "1 flight path" if len(runs) == 1 else f"{len(runs)} flight paths"
    said = []
    for apart in sorted(separations(runs), key=lambda found: -found.distance_m):
        if apart.distance_m < 1.0:
            said.append(f"{apart.label}, none")
        else:
            far = distance_words(apart.distance_m)
            said.append(f"{apart.label}, {far} at {clock(apart.time_s)}")
    return f"{count} in space. Largest separation from its own mirror: {'; '.join(said)}."


def paths_figure(runs: Sequence[Flown], rise: float = 1.0) -> Figure:
    """The paths, one to a colour and dash, in nautical miles and feet drawn to one scale.

    ``rise``: the vertical scale. Dashed and pale is the mirror of the first run; a run
    that had the same mirror has rungs to it. Circle: start, cross: onset, diamond: end.
    """
    traces = []
    for place, run in enumerate(runs):
        traces.append(_path(run.faulted, _rows(run), run, COLOURS[place], DASHES[place], 5))
        traces.append(_marks(run, COLOURS[place]))
        if _same_mirror(run, runs[0]):
            traces.append(_rungs(run, COLOURS[place]))
    first = runs[0]
    ghost = _path(first.mirror, _rows(first), first, theme.MIRROR, "dash", 4)
    traces.append(ghost | {"name": f"Mirror of {first.label}", "opacity": 0.9})
    points = np.concatenate(
        [_metres(flight) for run in runs for flight in (run.faulted, run.mirror)], axis=1
    )
    return {
        "data": traces,
        "layout": bare_layout(
            margin={"l": 0, "r": 0, "t": 0, "b": 0},
            height=HEIGHT_PX,
            hovermode="closest",
            dragmode="orbit",
            scene=_scene(points, rise),
        ),
    }


def _metres(flight: Any) -> Array:
    """East, north and up of a flight, (3, n)."""
    up_m = M_PER_FT * flight["altitude_ft"]
    return np.stack([flight["east_m"], flight["north_m"], up_m])


def _rows(run: Flown) -> Any:
    n = len(run.time_s)
    return np.linspace(0, n - 1, min(n, POINTS_PER_PATH)).astype(np.intp)


def _row_at(run: Flown, time_s: float) -> int:
    return min(int(np.searchsorted(run.time_s, time_s)), len(run.time_s) - 1)


def _coordinates(points_m: Array) -> dict[str, Any]:
    """Points (3, n) in metres as the axes have them."""
    east, north, up = points_m
    return {
        "x": packed(east / M_PER_NM),
        "y": packed(north / M_PER_NM),
        "z": packed(up / M_PER_FT),
    }


def _path(flight: Any, rows: Any, run: Flown, colour: str, dash: str, width: float) -> Any:
    return {
        "type": "scatter3d",
        "mode": "lines",
        "name": run.label,
        "line": {"color": colour, "dash": dash, "width": width},
        "text": [clock(time_s) for time_s in run.time_s[rows]],
        "hovertemplate": f"{run.label}<br>%{{text}}<br>{_PLACE}",
        **_coordinates(_metres(flight)[:, rows]),
    }


def _marks(run: Flown, colour: str) -> dict[str, Any]:
    """Where a flight begins, breaks and ends."""
    places = {"Start": (0, "circle"), "End": (len(run.time_s) - 1, "diamond")}
    if run.onset_s is not None:
        places["Onset"] = (_row_at(run, run.onset_s), "cross")
    rows = [row for row, _ in places.values()]
    times = [clock(run.time_s[row]) for row in rows]
    return {
        "type": "scatter3d",
        "mode": "markers",
        "name": run.label,
        "marker": {"color": colour, "size": 5, "symbol": [sign for _, sign in places.values()]},
        "text": [f"{name} {when}" for name, when in zip(places, times, strict=True)],
        "hovertemplate": f"{run.label}<br>%{{text}}<br>{_PLACE}",
        **_coordinates(_metres(run.faulted)[:, rows]),
    }


def _same_mirror(run: Flown, first: Flown) -> bool:
    """Whether two runs have the same healthy mirror."""
    if len(run.time_s) != len(first.time_s):
        return False
    return bool(np.abs(_metres(run.mirror) - _metres(first.mirror)).max(initial=0.0) < 1.0)


def _rungs(run: Flown, colour: str) -> dict[str, Any]:
    """Straight lines between a flight and its mirror at equal times; a gap after each."""
    rows = np.linspace(0, len(run.time_s) - 1, RUNGS).astype(np.intp)
    ends = [_metres(run.faulted)[:, rows], _metres(run.mirror)[:, rows]]
    points = np.stack([*ends, np.full((3, len(rows)), np.nan)], axis=2).reshape(3, -1)
    return {
        "type": "scatter3d",
        "mode": "lines",
        "name": f"{run.label}, to its mirror",
        "line": {"color": colour, "width": 2},
        "opacity": 0.55,
        "hoverinfo": "skip",
        **_coordinates(points),
    }


def _scene(points_m: Array, rise: float) -> dict[str, Any]:
    """Axes of equal scale around all points (3, n), heights drawn ``rise`` times."""
    low, high = points_m.min(axis=1), points_m.max(axis=1)
    stretch = np.array([1.0, 1.0, rise])
    drawn = (high - low) * stretch
    longest = float(max(drawn.max(), 1.0))
    least = longest * np.array([_LEAST_WIDTH, _LEAST_WIDTH, _LEAST_HEIGHT])
    side = np.maximum(drawn, least) + 2 * _ROOM * longest
    half = side / stretch / 2
    middle = (low + high) / 2
    per_unit = np.array([M_PER_NM, M_PER_NM, M_PER_FT])
    ranges = np.stack([(middle - half) / per_unit, (middle + half) / per_unit], axis=1)
    titles = ("East, nm", "North, nm", "Altitude, ft")
    axes = {
        f"{name}axis": {
            "title": {"text": title, "font": {"size": 12}},
            "range": [float(end) for end in span],
            "nticks": 5, "tickformat": ",~f", "tickfont": {"size": 11},
            "showbackground": False, "zeroline": False, "showspikes": False,
            "color": theme.ONSET, "gridcolor": "rgba(128,140,152,0.35)",
        }
        for name, title, span in zip("xyz", titles, ranges, strict=True)
    }  # fmt: skip
    is_northward = side[1] >= side[0]
    across, along = ("x", "y") if is_northward else ("y", "x")
    eye = {across: 1.55 if is_northward else -1.55, along: -1.05, "z": 0.65}
    ratio = _SIZE * side / side.max()
    return {
        **axes,
        "aspectmode": "manual",
        "aspectratio": {name: float(part) for name, part in zip("xyz", ratio, strict=True)},
        "camera": {"eye": eye, "center": {"x": 0, "y": 0, "z": -0.22}},
    }

"""Paper Fig. 6: paths in 3D and altitude from the side, five faults and nominal; all in JSON."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from core.clock import DT_S
from core.experiments.drawing import FONT, Array, axis, finish, mark_onset
from core.experiments.paper.representative import (
    FIGURES_ONSET_S,
    LINES,
    NOMINAL,
    REPRESENTATIVE,
    fly_modes,
    plan_for,
    settings,
)
from core.experiments.results import Progress, Result
from core.fmea.catalogue import catalogue, class_ids
from core.twin.plan import Plan
from core.twin.trajectory import Pair, Trajectory

_M_PER_NM = 1852.0
_FT_PER_M = 1.0 / 0.3048
_EVERY = round(1.0 / DT_S)
"""Paths are drawn with a point a second; the figures in the JSON come from every sample."""


def run(quick: bool, progress: Progress) -> Result:
    """Fly all modes beside one mirror, measure how far each leaves it, and draw the five."""
    plan = plan_for(quick)
    pairs = fly_modes(plan, class_ids(), progress)
    faults = {mode: departure(pair) for mode, pair in pairs.items() if mode != NOMINAL}
    lowest = max(faults, key=lambda mode: faults[mode]["altitude_lost_ft"])
    drawn = {mode: pairs[mode] for mode in (NOMINAL, *REPRESENTATIVE)}
    return Result(
        name="fig6",
        settings=settings(plan, quick),
        findings={"drawn": list(drawn), "loses_most_altitude": lowest, "faults": faults},
        figure=draw(drawn, plan),
        summary=tuple(_in_words(mode, faults[mode]) for mode in REPRESENTATIVE),
    )


def _in_words(mode: str, left: Mapping[str, float]) -> str:
    return (
        f"{mode:<24} {left['altitude_lost_ft']:>8.1f} ft lost at the end, "
        f"{left['max_altitude_deviation_ft']:.1f} ft off the mirror's altitude at most"
    )


def departure(pair: Pair) -> dict[str, float]:
    """How far the faulted aircraft leaves its mirror, by altitude and as the crow flies (ft).

    ``power_lost_percent`` and ``sink_fpm`` are means over the last 10 s; sink is counted against
    the mirror.
    """
    faulted, mirror = pair.faulted, pair.mirror
    altitude_ft = faulted.state("altitude_ft") - mirror.state("altitude_ft")
    along_ft = [
        (faulted.state(name) - mirror.state(name)) * _FT_PER_M for name in ("north_m", "east_m")
    ]
    apart_ft = np.sqrt(along_ft[0] ** 2 + along_ft[1] ** 2 + altitude_ft**2)
    end = slice(-round(10.0 / DT_S), None)
    power = faulted.state("power_hp")[end].mean() / mirror.state("power_hp")[end].mean()
    sink_fpm = mirror.state("vspd_fpm")[end].mean() - faulted.state("vspd_fpm")[end].mean()
    return {
        "altitude_lost_ft": round(0.0 - float(altitude_ft[-1]), 3),
        "max_altitude_deviation_ft": round(float(np.abs(altitude_ft).max()), 3),
        "max_separation_ft": round(float(apart_ft.max()), 3),
        "sink_fpm": round(float(sink_fpm), 3),
        "power_lost_percent": round(100.0 * (1.0 - float(power)), 3),
    }


def draw(pairs: Mapping[str, Pair], plan: Plan) -> go.Figure:
    """3D paths, altitude from the side, and the same magnified to the few feet around nominal."""
    figure = make_subplots(
        rows=2,
        cols=2,
        specs=[[{"type": "scene", "rowspan": 2}, {}], [None, {}]],
        column_widths=[0.58, 0.42],
        horizontal_spacing=0.07,
        vertical_spacing=0.18,
        subplot_titles=(
            "(a) Flight paths",
            "(b) Side view",
            "(c) Side view, magnified: difference from nominal",
        ),
    )
    for mode, pair in pairs.items():
        _add_path(figure, mode, pair)
    onset_nm = float(
        _along_nm(next(iter(pairs.values())).mirror)[round(FIGURES_ONSET_S / DT_S) // _EVERY]
    )
    mark_onset(figure, onset_nm, panels=2)
    figure.update_xaxes(axis(title="Distance flown (nm)"), col=2)
    figure.update_yaxes(axis(title="Altitude (ft)", tickformat=",d"), row=1, col=2)
    figure.update_yaxes(
        axis(title="Altitude difference (ft)", range=_magnified_range(pairs)), row=2, col=2
    )
    figure.update_scenes(_scene())
    return finish(figure, 1200, 600)


def _add_path(figure: go.Figure, mode: str, pair: Pair) -> None:
    flight, line, name = pair.faulted[::_EVERY], LINES[mode], catalogue()[mode].name
    altitude_ft = flight.state("altitude_ft")
    shared = {"mode": "lines", "name": name, "legendgroup": mode}
    figure.add_scatter3d(
        x=flight.state("east_m") / _M_PER_NM, y=flight.state("north_m") / _M_PER_NM, z=altitude_ft,
        line={"color": line.colour, "dash": line.dash, "width": 2.5 * line.width},
        showlegend=False, row=1, col=1, hovertemplate="%{z:,.0f} ft", **shared,
    )  # fmt: skip
    along_nm = _along_nm(pair.faulted)
    figure.add_scatter(
        x=along_nm, y=altitude_ft, line=line.to_plotly(), row=1, col=2,
        hovertemplate="%{y:,.0f} ft", **shared,
    )  # fmt: skip
    figure.add_scatter(
        x=along_nm, y=altitude_ft - pair.mirror[::_EVERY].state("altitude_ft"),
        line=line.to_plotly(), showlegend=False, row=2, col=2, hovertemplate="%{y:.1f} ft",
        **shared,
    )  # fmt: skip


def _along_nm(flight: Trajectory) -> Array:
    """Distance from the start, a point a second (the flights go straight)."""
    path = flight[::_EVERY]
    distance: Array = np.hypot(path.state("north_m"), path.state("east_m")) / _M_PER_NM
    return distance


def _magnified_range(pairs: Mapping[str, Pair]) -> list[float]:
    """Room for every flight but the one that falls out of the sky."""
    lost = [
        departure(pair)["altitude_lost_ft"]
        for mode, pair in pairs.items()
        if mode != "engine_failure"
    ]
    return [-1.25 * max(*lost, 8.0), 0.25 * max(*lost, 8.0)]


def _scene() -> dict[str, Any]:
    # Altitude is stretched some twenty times: true to scale, the paths would be one line.
    shared = {"gridcolor": "#CFCFCF", "backgroundcolor": "white", "tickfont_size": 12}
    return {
        "xaxis": {"title": {"text": "East (nm)", "font": FONT}, "dtick": 2, **shared},
        "yaxis": {"title": {"text": "North (nm)", "font": FONT}, "dtick": 2, **shared},
        "zaxis": {
            "title": {"text": "Altitude (ft)", "font": FONT}, "tickformat": ",d", **shared,
        },
        "aspectmode": "manual",
        "aspectratio": {"x": 1.3, "y": 0.8, "z": 0.8},
        "camera": {
            "eye": {"x": 0.55, "y": -1.72, "z": 0.5}, "center": {"x": 0.0, "y": 0.0, "z": -0.08},
        },
        "domain": {"x": [0.0, 0.55], "y": [0.0, 1.0]},
    }  # fmt: skip

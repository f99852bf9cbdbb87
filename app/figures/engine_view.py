"""The engine view: what an engine monitor shows, at the time cursor, with the mirror as a ghost.

A flat four seen from above, two bars on each cylinder, EGT above CHT, and gauges beside it. The
page holds the samples, so ``fly/engine.js`` draws it all; here is what it draws, and where.
"""

from dataclasses import dataclass
from typing import Any

from dash import html

from app.kit.attributes import attributes
from core.channels import CHANNELS, CYLINDERS, Channel, cht_name, egt_name
from core.cylinders import LAYOUT


@dataclass(frozen=True, slots=True)
class Scale:
    """From where to where a gauge goes, in the channel's unit; its limits are the channel's.

    ``low_matters``: whether falling out of the green arc calls for caution. A cold cylinder, or an
    engine that turns slowly because it was told to, does not.
    """

    low: float
    high: float
    low_matters: bool = True


SCALES: dict[str, Scale] = {
    **{egt_name(cylinder): Scale(600.0, 1700.0) for cylinder in CYLINDERS},
    **{cht_name(cylinder): Scale(100.0, 540.0, low_matters=False) for cylinder in CYLINDERS},
    "E1 RPM": Scale(500.0, 3000.0, low_matters=False),
    "E1 OilT": Scale(50.0, 270.0, low_matters=False),
    "E1 OilP": Scale(0.0, 130.0),
    "volt1": Scale(22.0, 34.0),
    "volt2": Scale(22.0, 34.0),
    "amp1": Scale(-40.0, 40.0),
    "amp2": Scale(-10.0, 10.0),
    "FQtyL": Scale(0.0, 27.0),
    "FQtyR": Scale(0.0, 27.0),
    "E1 FFlow": Scale(0.0, 16.0, low_matters=False),
}
"""The gauges of the engine view. Ammeters are the only ones with zero in the middle."""


_GAUGES = {
    name: (cylinder, kind)
    for cylinder in LAYOUT
    for name, kind in ((egt_name(cylinder), "EGT"), (cht_name(cylinder), "CHT"))
}
"""The cylinder of a gauge that stands on one, and what it measures there; from above."""

_GROUPS = ("engine", "oil", "fuel", "electrical")

_ORDER = list(
    dict.fromkeys(
        [*_GAUGES, *(c.name for group in _GROUPS for c in CHANNELS if c.subsystem == group)]
    )
)
"""All gauges as the page has them."""


def gauge_spec(channel: Channel) -> dict[str, Any] | None:
    """How to draw a channel's gauge, None for one that has none.

    ``bands`` are stretches of the scale, each with its status, from ``low`` to ``high``; a reading
    has the status of the stretch that it lies in. ``form`` is how it is drawn: on a ``cylinder`` at
    its ``place``, as a ``dial``, or as a ``bar`` with others under its ``title``.
    """
    scale = SCALES.get(channel.name)
    if scale is None:
        return None
    return {
        "low": scale.low,
        "high": scale.high,
        "bands": [
            {"from": start, "to": end, "status": status}
            for start, end, status in _bands(channel, scale)
            if end > start
        ],
        "red": [limit for limit in channel.red if limit is not None],
        "order": _ORDER.index(channel.name),
        **_position(channel),
    }


def _position(channel: Channel) -> dict[str, Any]:
    """Where a gauge stands in the view."""
    if channel.name in _GAUGES:
        cylinder, kind = _GAUGES[channel.name]
        place = {"side": LAYOUT[cylinder].side, "row": LAYOUT[cylinder].row}
        return {"form": "cylinder", "title": kind, "cylinder": cylinder, "place": place}
    form = "dial" if channel.subsystem == "engine" else "bar"
    title = channel.subsystem.capitalize()
    return {"form": form, "title": title, "cylinder": None, "place": None}


def _bands(channel: Channel, scale: Scale) -> list[tuple[float, float, str]]:
    """Red below the lower limit, amber up to the green arc, green, amber, red above the upper."""
    red_low, red_high = channel.red
    green_low, green_high = channel.green or (scale.low, scale.high)
    bottom = scale.low if red_low is None else red_low
    top = scale.high if red_high is None else red_high
    below = "caution" if scale.low_matters else "quiet"
    return [
        (scale.low, bottom, "limit"),
        (bottom, green_low, below),
        (green_low, green_high, "normal"),
        (green_high, top, "caution"),
        (top, scale.high, "limit"),
    ]


def engine_view() -> html.Section:
    """The panel, which ``fly/engine.js`` fills once there is a first sample."""
    return html.Section(
        [
            html.Div(
                [
                    html.H2("Engine monitor", className="panel-title"),
                    html.Span("", id="engine-time", className="note mono"),
                    html.Span("", id="engine-status", className="engine-status"),
                ],
                className="panel-head",
            ),
            html.Div(id="engine-view", className="engine-view"),
        ],
        className="panel panel-monitor",
        **attributes(aria_label="Engine monitor at the time cursor"),
    )

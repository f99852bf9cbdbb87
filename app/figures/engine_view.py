"""The engine view: what an engine monitor shows, at the time cursor, with the mirror as a ghost.

A flat four seen from above, two bars on each cylinder, EGT above CHT, and gauges beside it. The
page holds the samples, so ``fly/engine.js`` draws it all; here is what it draws, and where.
"""

from dataclasses import asdict
from typing import Any

from dash import html

from app.kit.attributes import attributes
from core.channels import CHANNELS, Channel, Gauge, cht_name, egt_name
from core.cylinders import LAYOUT

_CYLINDER_OF = {name(cylinder): cylinder for cylinder in LAYOUT for name in (egt_name, cht_name)}

_SUBSYSTEMS = ("engine", "oil", "fuel", "electrical")
"""The order of gauges in the view; on a cylinder EGT, which is logged last, stands first."""


def _place_in_view(channel: Channel) -> tuple[int, int, int]:
    index, cylinder = CHANNELS.index(channel), _CYLINDER_OF.get(channel.name)
    subsystem = _SUBSYSTEMS.index(channel.subsystem)
    return (
        (subsystem, len(LAYOUT) + 1, index) if cylinder is None else (subsystem, cylinder, -index)
    )


_ORDER = {
    channel.name: order
    for order, channel in enumerate(
        sorted((each for each in CHANNELS if each.gauge is not None), key=_place_in_view)
    )
}


def gauge_spec(channel: Channel) -> dict[str, Any] | None:
    """How to draw a channel's gauge, None for one that has none.

    ``bands`` are stretches of the scale, each with its status, from ``low`` to ``high``; a reading
    has the status of the stretch that it lies in. ``form`` is how it is drawn: on a ``cylinder`` at
    its ``place``, as a ``dial``, or as a ``bar`` with others under its ``title``.
    """
    scale = channel.gauge
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
        "order": _ORDER[channel.name],
        **_position(channel),
    }


def _position(channel: Channel) -> dict[str, Any]:
    """Where a gauge stands in the view."""
    cylinder = _CYLINDER_OF.get(channel.name)
    if cylinder is not None:
        kind = channel.label.removesuffix(f" {cylinder}")
        place = asdict(LAYOUT[cylinder])
        return {"form": "cylinder", "title": kind, "cylinder": cylinder, "place": place}
    form = "dial" if channel.subsystem == "engine" else "bar"
    title = channel.subsystem.capitalize()
    return {"form": form, "title": title, "cylinder": None, "place": None}


def _bands(channel: Channel, scale: Gauge) -> list[tuple[float, float, str]]:
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

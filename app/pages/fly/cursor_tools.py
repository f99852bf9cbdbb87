"""The tools under the playback bar: marked moments, cursors A and B, zoom, and units.

``fly/cursor.js`` works all of them but the units, which are in ``fly/flight.js``.
"""

import dash_mantine_components as dmc
from dash import Dash, Input, Output, dcc, html

from app.kit.attributes import attributes
from app.kit.wiring import in_browser
from core.units import QUANTITIES

UNIT_CHOICES = {
    "temperature": "Temperatures in °C",
    "altitude": "Altitudes in m, climb in m/s",
    "speed": "Airspeed in km/h",
    "pressure": "Pressures in bar",
    "volume": "Fuel in L and L/h",
}

VERDICT_MARKS_ID = "verdict-marks"
LIMIT_MARKS_ID = "limit-marks"
ACTION_MARKS_ID = "action-marks"
TRACK_ID = "answers-track"

_STORES = (VERDICT_MARKS_ID, LIMIT_MARKS_ID, ACTION_MARKS_ID, TRACK_ID)


def cursor_tools() -> html.Div:
    """The row of tools; the browser remembers the units."""
    return html.Div(
        [
            html.Div(id="moments", className="moments", role="group",
                     **attributes(aria_label="Marked moments")),
            html.Div(
                [
                    html.Output("", id="between", className="mono note"),
                    _button("between-clear", "✕", "Clear A and B", hidden=True),
                    _button("set-a", "Set A", "Put A at the time cursor (key a)"),
                    _button("set-b", "Set B", "Put B at the time cursor (key b)"),
                    _button("zoom-out", "", "Show the whole flight (key 0)", hidden=True),
                    _units(),
                ],
                className="cursor-buttons",
            ),
            *(dcc.Store(id=store) for store in _STORES),
        ],
        className="cursor-tools",
    )  # fmt: skip


def register(app: Dash) -> None:
    """Attach the functions in the browser to ``app``."""
    # With an output: Dash calls what has none only when its inputs change.
    units = Output("units-chosen", "children"), Input("units", "value")
    in_browser(app, "flight", "chooseUnits", *units)
    marks = (VERDICT_MARKS_ID, LIMIT_MARKS_ID, ACTION_MARKS_ID)
    in_browser(app, "cursor", "showMarks", *(Input(store, "data") for store in marks))
    in_browser(app, "ranking", "take", Input(TRACK_ID, "data"))


def _button(button_id: str, text: str, title: str, *, hidden: bool = False) -> html.Button:
    return html.Button(
        text, id=button_id, type="button", className="tool-button", title=title, hidden=hidden,
        **attributes(aria_label=None if text not in ("", "✕") else title),
    )  # fmt: skip


def _units() -> html.Details:
    return html.Details(
        [
            html.Summary("Units", id="units-chosen", className="tool-button",
                         title="Show readings in other units"),
            html.Div(
                dmc.CheckboxGroup(
                    dmc.Stack(
                        [
                            dmc.Checkbox(label=UNIT_CHOICES[quantity], value=quantity, size="xs")
                            for quantity in QUANTITIES
                        ],
                        gap=8,
                    ),
                    id="units",
                    value=[],
                    persistence=True,
                    persistence_type="local",
                ),
                className="units-choice",
            ),
        ],
        className="units",
    )  # fmt: skip

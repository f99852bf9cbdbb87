"""The presenter view: Fly dark and large for a projector, with only what a room can read.

It is Fly itself, at an address of its own: a run continues, and the one time cursor moves
everything. ``fly/present.js`` and ``assets/web/present.css`` do the rest.
"""

import dash_mantine_components as dmc
from dash import Dash, Input, Output, dcc, html

from app.kit.attributes import attributes
from app.kit.wiring import in_browser
from core.channels import CHANNEL_INDEX, cht_name, egt_name
from core.cylinders import CYLINDERS

WALL_CHANNELS: tuple[str, ...] = (
    *(egt_name(cylinder) for cylinder in CYLINDERS),
    *(cht_name(cylinder) for cylinder in CYLINDERS),
    "E1 RPM", "E1 FFlow", "E1 OilT", "E1 OilP",
)  # fmt: skip
"""The channels of the presenter view, four a row: EGT above the CHT of its cylinder."""


def present_button() -> html.Div:
    """The button that switches the presenter view, and its options."""
    return html.Div(
        [
            html.Button(
                "Present",
                id="present",
                type="button",
                title="Large and dark, for a projector (P)",
                **attributes(aria_keyshortcuts="p", aria_pressed="false"),
            ),
            html.Span(
                "Space plays · ← → move 5 s · F full screen · Esc leaves", className="wall-keys"
            ),
            # Of this tab, and as it was left: what a class is to find must not flash up first.
            dmc.Checkbox(
                id="wall-hide",
                label="Hide fault and verdict (H)",
                size="xs",
                className="wall-hide",
                persistence=True,
                persistence_type="session",
            ),
            dcc.Store(id="wall", data=[CHANNEL_INDEX[name] for name in WALL_CHANNELS]),
            dcc.Store(id="presenting", data=None),
        ],
        className="present-switch",
    )


def register(app: Dash) -> None:
    """Attach the switch to the address in ``app``."""
    in_browser(
        app,
        "present",
        "follow",
        Output("presenting", "data"),
        Input("url", "pathname"),
        Input("wall", "data"),
    )

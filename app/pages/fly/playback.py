"""The time cursor and its playback: one moment of the flight for every chart and 3D view.

``fly/cursor.js`` does all of it in the browser but for the aircraft of the live view.
"""

import asyncio
from collections.abc import Callable

import dash_mantine_components as dmc
from dash import Dash, Input, State, dcc, html

from app.kit.attributes import attributes
from app.kit.wiring import in_browser
from app.pages.fly.present import present_button
from core.clock import clock

SPEEDS = (1, 10, 60)
"""Speeds to choose from, seconds of flight per second."""


def playback_bar() -> html.Div:
    """Play, speed, and the slider that holds the cursor."""
    return html.Div(
        [
            html.Button("▶", id="play", type="button", **attributes(aria_label="Play the flight")),
            dmc.SegmentedControl(
                id="play-speed",
                data=[{"value": str(speed), "label": f"×{speed}"} for speed in SPEEDS],
                value="10",
                size="xs",
                **attributes(aria_label="Speed of play"),
            ),
            dmc.Slider(
                id="scrub",
                value=0,
                min=0,
                max=300,
                step=1,
                label=None,
                size="sm",
                updatemode="drag",
                thumbLabel="Time in the flight, in seconds",
                className="scrub",
            ),
            html.Output(clock(0.0), id="scrub-time", className="mono"),
            present_button(),
            dcc.Store(id="cursor", data=None),
        ],
        className="playback",
        role="group",
        **attributes(aria_label="Playback"),
    )


def register(app: Dash, seek: Callable[[str, float | None], None]) -> None:
    """Attach the cursor's callbacks to ``app``.

    ``seek`` puts the aircraft of a session's live view where they were at a time, in seconds, or,
    for None, where they are.
    """

    @app.callback(
        Input("cursor", "data"),
        State("session", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def follow_cursor(time_s: float | None, session_id: str) -> None:
        """Move the aircraft of the live view with the cursor."""
        await asyncio.to_thread(seek, session_id, time_s)

    in_browser(app, "cursor", "scrub", Input("scrub", "value"))
    in_browser(app, "cursor", "setSpeed", Input("play-speed", "value"))

"""The bar above the 3D scene of *Fly*: the colouring of the path, and the camera."""

import asyncio
from typing import Any

import dash_mantine_components as dmc
from dash import Dash, Input, Output, State, dcc, html

from app.kit.attributes import attributes
from app.scenes.cameras import View
from app.scenes.painting import Legend, Paint, choices
from app.sessions import Sessions

PAINT_ID, VIEW_ID, LEGEND_ID, BAR_ID, CLOCK_ID = (
    "scene-paint", "scene-view", "scene-legend", "scene-bar", "scene-clock",
)  # fmt: skip

LEGEND_POLL_MS = 1000
"""How often the key is updated: its ends move during a flight."""

_VIEW_WORDS: dict[View, str] = {
    "whole": "Whole", "chase": "Chase", "side": "Side", "free": "Free",
}  # fmt: skip


def scene_bar() -> html.Div:
    """The controls; they work on the live scene, and the viewer of the replay has its own."""
    return html.Div(
        [
            dmc.Select(
                id=PAINT_ID,
                data=choices(),
                placeholder="Path: one colour",
                searchable=True,
                clearable=True,
                size="xs",
                className="scene-paint",
                comboboxProps={"withinPortal": True},
                **attributes(aria_label="Colour the path by"),
            ),
            html.Div(id=LEGEND_ID, className="scene-legend"),
            dmc.SegmentedControl(
                id=VIEW_ID,
                data=[{"value": view, "label": word} for view, word in _VIEW_WORDS.items()],
                value="whole",
                size="xs",
                **attributes(aria_label="Camera"),
            ),
            dcc.Interval(id=CLOCK_ID, interval=LEGEND_POLL_MS, disabled=True),
        ],
        id=BAR_ID,
        className="scene-bar",
    )


def register(app: Dash, sessions: Sessions) -> None:
    """Attach the callbacks of the controls to ``app``."""
    _register_paint(app, sessions)
    _register_camera(app, sessions)


def _register_paint(app: Dash, sessions: Sessions) -> None:
    @app.callback(
        Output(CLOCK_ID, "disabled"),
        Output(LEGEND_ID, "children"),
        Input(PAINT_ID, "value"),
        State("session", "data"),
        websocket=True,
    )
    async def paint(chosen: str | None, session_id: str) -> tuple[bool, Any]:
        """Colour the path, and show the key."""
        scene = sessions.get(session_id).scene()
        await asyncio.to_thread(scene.paint, Paint.read(chosen))
        return not chosen, _legend(scene.legend())

    @app.callback(
        Output(LEGEND_ID, "children", allow_duplicate=True),
        Input(CLOCK_ID, "n_intervals"),
        State("session", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def update(ticks: int | None, session_id: str) -> Any:
        """The key of the flight so far."""
        return _legend(sessions.get(session_id).scene().legend())


def _register_camera(app: Dash, sessions: Sessions) -> None:
    @app.callback(
        Input(VIEW_ID, "value"),
        State("session", "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def look(view: View, session_id: str) -> None:
        """Turn the camera."""
        await asyncio.to_thread(sessions.get(session_id).scene().look, view)

    @app.callback(
        Output(BAR_ID, "style"),
        Input("scene-tab", "value"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def belong(tab: str) -> dict[str, str]:
        """Hide the controls where they have no effect."""
        return {} if tab == "live" else {"display": "none"}


def _legend(legend: Legend | None) -> list[Any]:
    if legend is None:
        return []
    return [
        html.Span(legend.low, className="mono"),
        html.Span(
            className="scene-scale",
            role="img",
            style={"background": f"linear-gradient(90deg, {', '.join(legend.stops)})"},
            **attributes(aria_label=f"Colours from {legend.low} to {legend.high}"),
        ),
        html.Span(legend.high, className="mono"),
    ]

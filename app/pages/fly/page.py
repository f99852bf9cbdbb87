"""The layout of the page *Fly*. `view` fills it, `callbacks` attaches the callbacks."""

from typing import Any
from urllib.parse import urlencode

import dash_mantine_components as dmc
import numpy as np
from dash import dcc, html

from app.figures.axes import GRAPH_CONFIG
from app.figures.engine_view import engine_view
from app.figures.outcome_line import OUTCOME_ID
from app.figures.probabilities import probability_figure
from app.figures.residuals import heat_strip
from app.figures.sensors import cleared, tile_specs
from app.kit.attributes import attributes
from app.kit.channel_panels import channel_panels
from app.kit.nodes import Node, nodes
from app.kit.terms import term
from app.pages.fly.cursor_tools import cursor_tools
from app.pages.fly.live_controls import ACTIONS_ID, live_bar
from app.pages.fly.playback import playback_bar
from app.pages.fly.scene_bar import scene_bar
from app.pages.fly.setup import DEFAULT_FAULT, DEFAULT_PLAN, setup_panel
from app.pages.report.panel import report_panel
from core.channels import N_CHANNELS, Channel, unit_label
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault

PROBABILITIES_ID = "probabilities"
STRIP_ID = "residual-strip"
RESIDUAL_SWITCH_ID = "residual-switch"
RANKING_NODES_ID = "ranking-nodes"

RANKING_HINT = (
    "The classifier reads the last 30 s of residuals every 5 s. Its first answer appears half a "
    "minute into the flight."
)


def ranking_hint() -> list[Node]:
    """The text in place of the ranking before the first answer."""
    return nodes(html.P(RANKING_HINT, className="note"))


def tile_id(index: int) -> str:
    """Element id of the charts of a channel, which ``fly/tiles.js`` draws."""
    return f"tile-{index}"


def readout_id(index: int) -> str:
    """Element id of the number in the head of a channel's tile."""
    return f"readout-{index}"


def layout(fault: Fault = DEFAULT_FAULT) -> html.Div:
    """The whole page before any run, with this fault filled in."""
    return html.Div(
        [
            html.Aside(setup_panel(fault), className="area-setup"),
            html.Div(_run_bar(fault), className="area-bar"),
            html.Div(_scene_panel(), className="area-scene"),
            html.Div([_diagnosis_panel(), report_panel()], className="area-verdict"),
            html.Div(
                html.Div(
                    [engine_view(), *channel_panels(_tile, "sensors and residuals")],
                    className="charts",
                ),
                className="area-charts",
            ),
            dcc.Store(id="tile-specs", data=tile_specs()),
            dcc.Store(id="flight", data=cleared("", DEFAULT_PLAN.duration_s, None)),
        ],
        id="fly",
        className="fly",
        **attributes(data_status="idle"),
    )


def resting_figures(duration_s: float, onset_s: float | None) -> dict[str, Any]:
    """Each Plotly figure of the page as it rests before a flight of that length: only axes."""
    nothing = np.empty(0, dtype=np.float32)
    rest: dict[str, Any] = {"duration_s": duration_s, "onset_s": onset_s}
    names = {mode.id: mode.name for mode in catalogue().values()}
    return {
        STRIP_ID: heat_strip(nothing, np.empty((0, N_CHANNELS)), **rest),
        PROBABILITIES_ID: probability_figure(names, nothing, np.empty((0, len(names))), (), **rest),
    }


def live_frame(session_id: str) -> html.Iframe:
    """The session's viser scene. It must stay same-origin: viser cannot connect from a sandbox."""
    return html.Iframe(
        src=f"/viser/{session_id}/",
        title="Both aircraft in 3D: drag to turn, scroll to zoom",
    )


def replay_frame(
    run_id: str | None, prefix: str = "", *, dark: bool = False
) -> html.Iframe | html.P:
    """The run's recording in the Rerun viewer; sandboxed, so that it has a process of its own.

    ``prefix`` is that of the addresses open to a sandbox.
    """
    if run_id is None:
        return html.P("Fly a run first: its recording opens here.", className="note centred")
    recording = f"{prefix}/recordings/{run_id}.rrd"
    query = urlencode({"url": recording, "theme": "dark" if dark else "light"})
    return html.Iframe(
        src=f"{prefix}/rerun/viewer.html?{query}",
        title="Recording of the run in the Rerun viewer",
        sandbox="allow-scripts",
    )


def _run_bar(fault: Fault) -> html.Section:
    """The name of the run, its progress and its actions."""
    return html.Section(
        [
            html.Div(
                [
                    html.Div(
                        [
                            html.H1("No flight yet", id="run-title"),
                            html.P(idle_hint(fault), id="run-subtitle", className="note"),
                        ],
                        className="run-name",
                    ),
                    html.Span("Ready", id="run-status", className="badge", role="status"),
                    dmc.Button("Cancel", id="cancel", size="xs", variant="default", display="none"),
                    dmc.Button(
                        "Run again", id="again", size="xs", variant="default", display="none"
                    ),
                    dmc.Button("Retry", id="retry", size="xs", variant="default", display="none"),
                ],
                className="run-head",
            ),
            html.Div(
                [
                    dmc.Progress(id="progress", value=0, size="xs", transitionDuration=150,
                                 **attributes(aria_label="Progress of the run")),
                    html.Span("", id="stage", className="note mono"),
                ],
                className="run-progress",
            ),
            live_bar(),
            html.Div(id="alert"),
            html.Div(id=ACTIONS_ID),
            html.Div(id="flight-events"),
        ],
        className="panel run-bar",
        **attributes(aria_label="Run"),
    )  # fmt: skip


def idle_hint(fault: Fault = DEFAULT_FAULT) -> str:
    """A hint at what a click on Run does."""
    name = catalogue()[fault.mode].name
    return (
        "Two aircraft fly the same plan, one of them with a fault. "
        f"Press Run to break this one: {name.lower()}, severity {fault.severity:g}."
    )


def _scene_panel() -> html.Section:
    return html.Section(
        [
            html.Div(
                [
                    html.H2("Flight path", className="panel-title"),
                    _legend(),
                    dmc.SegmentedControl(
                        id="scene-tab",
                        data=[
                            {"value": "live", "label": "Live"},
                            {"value": "replay", "label": "Replay"},
                        ],
                        value="live",
                        size="xs",
                    ),
                ],
                className="panel-head",
            ),
            scene_bar(),
            html.Div(id="scene", className="scene"),
            playback_bar(),
            cursor_tools(),
        ],
        className="panel",
        **attributes(aria_label="Flight path in 3D"),
    )


def _legend() -> html.Div:
    return html.Div(
        [
            html.Span([html.I(className="key faulted"), term("faulted", "faulted")]),
            html.Span([html.I(className="key mirror"), term("mirror", "mirror")]),
            html.Span([html.I(className="key residual"), term("residual", "residual")]),
            html.Span([html.I(className="key onset"), term("onset", "onset")]),
        ],
        className="path-legend",
    )


def _diagnosis_panel() -> html.Section:
    figures = resting_figures(DEFAULT_PLAN.duration_s, None)
    return html.Section(
        [
            html.Div(
                [
                    html.H2("Diagnosis", className="panel-title"),
                    html.Div(
                        dmc.SegmentedControl(
                            id=RESIDUAL_SWITCH_ID,
                            data=[
                                {"value": "paired", "label": "Mirror"},
                                {"value": "surrogate", "label": "Surrogate"},
                            ],
                            value="paired",
                            size="xs",
                            disabled=True,
                            **attributes(aria_label="Residuals against"),
                        ),
                        title="The reference of the residuals: the healthy mirror flown alongside, "
                        "or a network that predicts a healthy aircraft",
                    ),
                ],
                className="panel-head",
            ),
            html.Div(id=OUTCOME_ID),
            html.Div(id="ranking"),
            dcc.Store(id=RANKING_NODES_ID, data=ranking_hint()),
            html.Div(id="ranking-at", hidden=True),
            html.Div(id="diagnosis-notes"),
            html.H3(
                [term("probability", "Probability"), " of each class"], className="chart-title"
            ),
            _graph(PROBABILITIES_ID, figures, "probability-chart"),
            html.H3(
                ["Residuals in ", term("sigma", "standard deviations"), " of sensor noise"],
                className="chart-title",
            ),
            _graph(STRIP_ID, figures, "strip-chart"),
        ],
        className="panel",
        **attributes(aria_label="Diagnosis"),
    )


def _tile(index: int, channel: Channel) -> html.Figure:
    return html.Figure(
        [
            html.Figcaption(
                [
                    html.Span(channel.label, className="tile-name"),
                    html.Output("", id=readout_id(index), className="tile-readout mono"),
                    html.Span(unit_label(channel.unit), className="tile-unit"),
                ]
            ),
            html.Output("", id=f"between-{index}", className="tile-between mono"),
            html.Div(id=tile_id(index), className="tile-chart"),
        ],
        className="tile",
        **attributes(aria_label=f"{channel.label}, {unit_label(channel.unit)}, against time"),
    )


def _graph(component_id: str, figures: dict[str, Any], class_name: str) -> html.Div:
    # A responsive graph fills its parent, which therefore has the height.
    graph = dcc.Graph(
        id=component_id, figure=figures[component_id], config=GRAPH_CONFIG, responsive=True
    )
    return html.Div(graph, className=class_name)

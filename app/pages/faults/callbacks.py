"""The callbacks of the pages *Faults*: search, and signatures flown on demand."""

import asyncio
from functools import lru_cache
from threading import Lock
from typing import Any

from dash import Dash, Input, Output, dcc, html

from app.figures.axes import GRAPH_CONFIG
from app.figures.growth import SEVERITY_DASHES, growth_figure
from app.figures.residuals import NOISE_SIGMA, heat_strip
from app.kit.attributes import attributes
from app.pages.faults import mode_page as fault_page
from app.pages.faults import page as faults
from core.channels import CHANNELS, N_CHANNELS, unit_label
from core.errors import MirrorTwinError
from core.experiments.signs.growth import GROWTH_ONSET_S, GROWTH_PLAN, GROWTH_SEVERITIES, fly_growth
from core.knowledge.knowledge import knowledge
from core.knowledge.search import search

SHOWN_CHANNELS = 6

_one_at_a_time = Lock()
"""A signature takes a second of one core: visitors of several pages wait for one another."""


def register(app: Dash) -> None:
    """Attach the callbacks of the catalogue's pages to ``app``."""

    @app.callback(
        Output(faults.HITS_ID, "children"),
        Output(faults.LIST_ID, "children"),
        Input(faults.QUERY_ID, "value"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def find(query: str | None) -> tuple[Any, Any]:
        """Show the passages that answer a search, and their modes."""
        text = (query or "")[:200]
        hits = await asyncio.to_thread(search, text)
        modes = [hit.mode for hit in hits] if hits else list(knowledge())
        return faults.hit_list(text, hits), faults.matrix(modes)

    @app.callback(
        Output(fault_page.SIGNATURE_ID, "children"),
        Input("fault-mode", "data"),
        websocket=True,
    )
    async def draw_signature(mode: str) -> Any:
        """Fly the mode and draw what it does."""
        if mode not in knowledge():
            return None
        try:
            return await asyncio.to_thread(_signature, mode)
        except MirrorTwinError as error:
            return html.P(f"The twin could not fly this: {error}", className="note")


def _signature(mode: str) -> list[Any]:
    with _one_at_a_time:
        return _flown_signature(mode)


@lru_cache(maxsize=32)
def _flown_signature(mode: str) -> list[Any]:
    """The charts of a mode: about 60 kB each, so all of them may stay."""
    growth = fly_growth(mode)
    moved = growth.moved(NOISE_SIGMA, SHOWN_CHANNELS)
    if not moved:
        return [
            html.P(
                "No channel moves: with the same seed both aircraft read the same to the last "
                "digit.",
                className="note",
            )
        ]
    strip = heat_strip(
        growth.time_s, growth.severest, duration_s=GROWTH_PLAN.duration_s, onset_s=GROWTH_ONSET_S
    )
    return [
        html.P([fault_page.flown_words(), _legend()], className="note"),
        html.Div(
            [
                html.Figure(
                    [
                        html.Figcaption(
                            [
                                html.Span(CHANNELS[index].label, className="tile-name"),
                                html.Span(unit_label(CHANNELS[index].unit), className="tile-unit"),
                            ]
                        ),
                        _graph(f"growth-{index}", growth_figure(growth, index), "growth-chart"),
                    ],
                    **attributes(
                        aria_label=f"{CHANNELS[index].label}, faulted minus mirror, against time"
                    ),
                )
                for index in moved
            ],
            className="growth",
        ),
        html.H3(
            f"All {N_CHANNELS} channels at severity 1, in standard deviations of sensor noise",
            className="chart-title",
        ),
        _graph("signature-strip", strip, "strip-chart"),
    ]


def _legend() -> html.Span:
    return html.Span(
        [
            html.Span([html.I(className=f"key residual key-{dash}"), f"{severity:g}"])
            for severity, dash in zip(GROWTH_SEVERITIES, SEVERITY_DASHES, strict=True)
        ],
        className="growth-legend",
    )


def _graph(component_id: str, figure: Any, class_name: str) -> html.Div:
    # A responsive graph fills its parent, which therefore has the height.
    graph = dcc.Graph(id=component_id, figure=figure, config=GRAPH_CONFIG, responsive=True)
    return html.Div(graph, className=class_name)

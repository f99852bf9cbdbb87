"""The callbacks of the page *Compare*: choosing runs, flying a preset, drawing."""

import asyncio
from collections.abc import Sequence
from typing import Any

from dash import Dash, Input, Output, State, dcc, html, no_update
from dash.exceptions import PreventUpdate

from app.figures.axes import GRAPH_CONFIG
from app.figures.comparison import (
    MAX_COMPARED,
    PATH_STATES,
    Flown,
    Kind,
    channels_figure,
    side_figure,
    track_figure,
)
from app.figures.paths_3d import RISES, described, paths_figure
from app.kit.addresses import COMPARE_PREFIX, compare_path
from app.kit.attributes import attributes
from app.kit.wiring import in_browser
from app.kit.words import short_titles
from app.pages.compare import page as compare
from app.services import Services
from core.channels import CHANNEL_INDEX
from core.errors import MirrorTwinError
from core.store.records import RunRecord, valid_run_id
from core.store.store import RunStore

KINDS: tuple[Kind, ...] = ("reading", "residual", "difference")


def register(app: Dash, services: Services) -> None:
    """Attach the callbacks of the page to ``app``."""
    _register_choice(app, services.store)
    _register_flying(app, services)
    _register_refill(app, services.store)
    _register_drawing(app, services.store)
    in_browser(app, "paths3d", "dress", Input(compare.FIGURES_ID, "children"))


def _register_choice(app: Dash, store: RunStore) -> None:
    @app.callback(
        Output("url", "pathname", allow_duplicate=True),
        Input(compare.PICK_ID, "value"),
        State("url", "pathname"),
        State(compare.PICK_ID, "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def choose(run_ids: list[str] | None, path: str, offered: list[dict[str, str]]) -> str:
        """Go to the address of the comparison that was chosen."""
        known = {item["value"] for item in offered}
        chosen = [run_id for run_id in run_ids or [] if run_id in known][:MAX_COMPARED]
        shown = await asyncio.to_thread(_shown_at, path, store)
        if chosen == shown:
            raise PreventUpdate
        return compare_path(chosen)


def _register_flying(app: Dash, services: Services) -> None:
    store = services.store

    @app.callback(
        Output("page", "children", allow_duplicate=True),
        Input(compare.FLY_ID, "n_clicks"),
        State("url", "pathname"),
        running=[(Output(compare.FLY_ID, "loading"), True, False)],
        websocket=True,
        prevent_initial_call=True,
    )
    async def fly_missing(clicks: int | None, path: str) -> Any:
        """Fly what a preset lacks; the page then waits for it."""
        name = path.removeprefix(COMPARE_PREFIX)
        if not clicks or name not in compare.presets():
            raise PreventUpdate
        preset = compare.presets()[name]
        found = await asyncio.to_thread(compare.preset_runs, preset, store)
        try:
            for fault, record in zip(preset.faults, found, strict=True):
                if record is None:
                    run_id = await asyncio.to_thread(services.engine.submit, preset.plan, fault)
                    services.recorder.record(run_id)
        except MirrorTwinError as error:
            return html.Div([html.H1("The runs could not be started"), html.P(str(error))],
                            className="panel message-page")  # fmt: skip
        return await asyncio.to_thread(compare.layout, (), name, store)


def _register_refill(app: Dash, store: RunStore) -> None:
    @app.callback(
        Output("page", "children", allow_duplicate=True),
        Input(compare.CLOCK_ID, "n_intervals"),
        State("url", "pathname"),
        State(compare.RUNS_ID, "data"),
        websocket=True,
        prevent_initial_call=True,
    )
    async def refill(ticks: int | None, path: str, shown: list[str]) -> Any:
        """Lay the page out again once another run is finished."""
        if not ticks or not path.startswith(COMPARE_PREFIX):
            raise PreventUpdate
        return await asyncio.to_thread(_refilled, path, shown, store)


def _register_drawing(app: Dash, store: RunStore) -> None:
    @app.callback(
        Output(compare.FIGURES_ID, "children"),
        Output("compare-channel-controls", "style"),
        Output("compare-path-controls", "style"),
        Input(compare.RUNS_ID, "data"),
        Input(compare.VIEW_ID, "value"),
        Input(compare.KIND_ID, "value"),
        Input(compare.CHANNELS_ID, "value"),
        Input(compare.RISE_ID, "value"),
        websocket=True,
    )
    async def draw(
        run_ids: list[str], view: str, kind: Kind, names: list[str] | None, rise: str
    ) -> tuple[Any, Any, Any]:
        """Draw the runs as asked."""
        channels = [name for name in names or [] if name in CHANNEL_INDEX]
        ids = [run_id for run_id in run_ids if valid_run_id(run_id)][:MAX_COMPARED]
        times = next((times for times in RISES if str(times) == rise), RISES[0])
        figures: Any = None
        try:
            if ids and view == "paths":
                figures = await asyncio.to_thread(_paths, ids, store, times)
            elif ids and kind in KINDS:
                figures = await asyncio.to_thread(_channels, ids, channels, kind, store)
        except MirrorTwinError as error:
            figures = html.P(f"A run cannot be read: {error}", className="empty")
        hidden = {"display": "none"}
        return figures, *((hidden, {}) if view == "paths" else ({}, hidden))


def _shown_at(path: str, store: RunStore) -> list[str]:
    """The runs that the address shows, in its order."""
    name = path.removeprefix(COMPARE_PREFIX)
    if name in compare.presets():
        found = compare.preset_runs(compare.presets()[name], store)
        return [record.id for record in found if record is not None]
    return [run_id for run_id in name.split(",") if valid_run_id(run_id)]


def _refilled(path: str, shown: Sequence[str], store: RunStore) -> Any:
    name = path.removeprefix(COMPARE_PREFIX)
    preset = name if name in compare.presets() else None
    records = [store.get(run_id) for run_id in _shown_at(path, store)]
    done = [record.id for record in records if record.status == "done"]
    if done == list(shown) and any(not record.finished for record in records):
        return no_update
    return compare.layout([record.id for record in records], preset, store)


def _channels(ids: Sequence[str], names: Sequence[str], kind: Kind, store: RunStore) -> Any:
    if not names:
        return html.P("Choose a channel above.", className="note")
    figure = channels_figure(_all_flown(ids, names, store), names, kind)
    return _graph("compare-channels-figure", figure)


def _paths(ids: Sequence[str], store: RunStore, rise: float) -> list[Any]:
    runs = _all_flown(ids, PATH_STATES, store)
    return [
        _in_space(runs, rise),
        _titled("From the side", "compare-side", side_figure(runs, against_mirror=False)),
        _titled(
            "Against the mirror, scaled to most runs",
            "compare-lost",
            side_figure(runs, against_mirror=True),
        ),
        _titled("From above", "compare-track", track_figure(runs)),
    ]


def _all_flown(ids: Sequence[str], names: Sequence[str], store: RunStore) -> list[Flown]:
    """The runs with these columns, each under its shortest distinct name."""
    records = [store.get(run_id) for run_id in ids]
    return [
        _flown(record, title, names, store)
        for record, title in zip(records, short_titles(records), strict=True)
    ]


def _flown(record: RunRecord, label: str, names: Sequence[str], store: RunStore) -> Flown:
    sides, fault = ("faulted.", "mirror."), record.first_fault
    columns = store.load_columns(
        record.id, ["time_s", *(side + name for side in sides for name in names)]
    )
    end_s = float(columns["time_s"][-1])
    is_whole = len(columns["time_s"]) >= record.plan.n_steps
    return Flown(
        label=label,
        duration_s=record.plan.duration_s if is_whole else end_s,
        onset_s=None if fault is None else fault.onset_s,
        time_s=columns["time_s"],
        faulted={name: columns[f"faulted.{name}"] for name in names},
        mirror={name: columns[f"mirror.{name}"] for name in names},
    )


def _in_space(runs: Sequence[Flown], rise: float) -> html.Figure:
    """The paths in 3D, described in words below them."""
    figure = paths_figure(runs, rise)
    words = described(runs)
    # The wheel scrolls the page: `compare/paths3d.js` zooms by keys.
    graph = _graph("compare-space", figure, {**GRAPH_CONFIG, "scrollZoom": False})
    heights = "to scale" if rise == 1.0 else f"heights drawn ×{rise:g}"
    return html.Figure(
        [
            html.Figcaption(f"In space, {heights}", className="chart-title"),
            html.Div(graph, className="space", tabIndex=0, role="img",
                     **attributes(aria_label=f"{words} Arrow keys turn it, + and - zoom.")),
            html.P(words, className="note", id="compare-apart"),
            html.P("Circle: start, cross: onset, diamond: end. Pale and dashed: the mirror of the "
                   "first run; rungs lead there at equal times. Drag or use the arrow keys to "
                   "turn it, + and − to zoom.", className="note"),
        ]
    )  # fmt: skip


def _titled(title: str, component_id: str, figure: Any) -> html.Figure:
    return html.Figure([html.Figcaption(title, className="chart-title"),
                        _graph(component_id, figure)])  # fmt: skip


def _graph(component_id: str, figure: Any, config: Any = GRAPH_CONFIG) -> dcc.Graph:
    return dcc.Graph(
        id=component_id,
        figure=figure,
        config=config,
        responsive=True,
        style={"height": figure["layout"]["height"]},
    )

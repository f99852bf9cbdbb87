"""The page *Compare*: several stored runs in one chart, and their differences."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import dash_mantine_components as dmc
from dash import dcc, html

from app.figures.comparison import COLOURS, DASHES, MAX_COMPARED
from app.figures.outcome_line import outcome_mark
from app.figures.paths_3d import RISES
from app.kit.addresses import compare_path, run_path
from app.kit.attributes import attributes
from app.kit.words import (
    STATUS_WORDS,
    flown_fault,
    mode_name,
    run_title,
    short_titles,
    takes_cylinder,
)
from core.channels import CHANNELS, unit_label
from core.clock import clock
from core.fmea.fault import Fault
from core.store.outcome import run_outcome
from core.store.records import RunRecord
from core.store.store import RunStore
from core.twin.plan import PLAN_RANGES, Plan
from core.units import percent

RUNS_ID, PICK_ID, VIEW_ID, KIND_ID, CHANNELS_ID, FIGURES_ID, FLY_ID, CLOCK_ID, RISE_ID = (
    "compare-runs", "compare-pick", "compare-view", "compare-kind", "compare-channels",
    "compare-figures", "compare-fly", "compare-clock", "compare-rise",
)  # fmt: skip

OFFERED = 200
"""Number of recent runs offered in the selector."""

MAX_CHANNELS = 8
"""Number of channels drawn at once."""

LANDING_POLL_MS = 1500

NOTHING = "–"


@dataclass(frozen=True, slots=True)
class Preset:
    """A set of flights with an address of its own, and the view that opens first."""

    title: str
    about: str
    view: str
    plan: Plan
    faults: tuple[Fault, ...]


def presets() -> dict[str, Preset]:
    """The paper's two comparisons by the name in their address."""
    # Here, because it brings Plotly's own classes along: half a second that no other page needs.
    from core.experiments.paper.fig7 import KEY_CHANNELS
    from core.experiments.paper.representative import (
        FIGURES_PLAN,
        FIGURES_SEVERITY,
        NOMINAL,
        REPRESENTATIVE,
        fault_of,
    )

    faults = tuple(map(fault_of, (NOMINAL, *REPRESENTATIVE)))
    same = (
        f"{len(REPRESENTATIVE)} faults of severity {FIGURES_SEVERITY:g} and the nominal flight, "
        "all on one plan and seed."
    )
    return {
        "fig6": Preset(
            "Fig. 6", f"{same} Where does each take the aircraft?", "paths", FIGURES_PLAN, faults
        ),
        "fig7": Preset(
            "Fig. 7",
            f"{same} How do {len(KEY_CHANNELS)} key channels respond?",
            "channels",
            FIGURES_PLAN,
            faults,
        ),
    }


def preset_runs(preset: Preset, store: RunStore) -> list[RunRecord | None]:
    """The newest stored run of each flight of a preset, None where there is none."""
    records = [
        record
        for record in store.records()
        if record.plan == preset.plan
        and record.status in ("queued", "running", "done")
        and not record.actions
    ]
    return [
        next((record for record in records if record.fault == fault), None)
        for fault in preset.faults
    ]


def layout(run_ids: Sequence[str], preset_name: str | None, store: RunStore) -> html.Div:
    """The page for these runs, or for a preset."""
    preset = presets()[preset_name] if preset_name else None
    if preset is not None:
        found = preset_runs(preset, store)
        shown = [record for record in found if record is not None]
        missing = len(found) - len(shown)
    else:
        shown, missing = [store.get(run_id) for run_id in run_ids], 0
    done = [record for record in shown if record.status == "done"]
    waiting = [record for record in shown if not record.finished]
    return html.Div(
        [
            _head(shown, preset, preset_name, store),
            _missing(preset, missing) if preset and missing else None,
            _waiting(waiting),
            *(_comparison(done, preset) if done else [_empty(store)] if not missing else []),
            dcc.Store(id=RUNS_ID, data=[record.id for record in done]),
            dcc.Interval(id=CLOCK_ID, interval=LANDING_POLL_MS, disabled=not waiting),
        ],
        className="compare-page",
    )


def differences(records: Sequence[RunRecord]) -> list[tuple[str, list[str]]]:
    """The settings in which the runs differ, each with its value in every run, with units."""
    rows = [(name, [value(record) for record in records]) for name, value in _FIELDS.items()]
    return [(name, values) for name, values in rows if len(set(values)) > 1]


def _plan_value(name: str) -> Callable[[RunRecord], str]:
    unit = unit_label(PLAN_RANGES[name][2])

    def value(record: RunRecord) -> str:
        holder = record.plan if hasattr(record.plan, name) else record.plan.weather
        number = getattr(holder, name)
        return f"{number:,g}°" if unit == "°" else f"{number:,g} {unit}".rstrip()

    return value


def _of_fault(value: Callable[[Fault], str]) -> Callable[[RunRecord], str]:
    """A setting of the fault; a dash for a healthy flight."""
    return lambda record: NOTHING if record.first_fault is None else value(record.first_fault)


def _cylinder(fault: Fault) -> str:
    return str(fault.target_cylinder) if takes_cylinder(fault.mode) else NOTHING


_FIELDS: dict[str, Callable[[RunRecord], str]] = {
    "Fault": lambda record: mode_name(flown_fault(record).mode),
    "Severity": _of_fault(lambda fault: f"{fault.severity:g}"),
    "Onset": _of_fault(lambda fault: clock(fault.onset_s)),
    "Cylinder": _of_fault(_cylinder),
    "Altitude": _plan_value("altitude_ft"),
    "Speed": _plan_value("speed_kt"),
    "Heading": _plan_value("heading_deg"),
    "Duration": lambda record: clock(record.plan.duration_s),
    "Seed": lambda record: str(record.plan.seed),
    "Throttle": lambda record: record.plan.power.replace("_", " "),
    "Conditions": lambda record: record.plan.conditions,
    "ISA deviation": _plan_value("isa_deviation_degc"),
    "Wind": _plan_value("wind_kt"),
    "Wind from": _plan_value("wind_from_deg"),
    "Turbulence": lambda record: f"{record.plan.weather.turbulence:g}",
    "Legs": lambda record: str(len(record.plan.legs)),
    "Code": lambda record: record.code_version,
}


def _head(
    shown: Sequence[RunRecord], preset: Preset | None, preset_name: str | None, store: RunStore
) -> html.Section:
    offered = [record for record in store.records() if record.status == "done"][:OFFERED]
    options = {record.id: record for record in (*shown, *offered)}
    links = [
        html.Span(item.title, className="chip", **attributes(aria_current="page"))
        if name == preset_name
        else dcc.Link(item.title, href=compare_path([name]), className="chip", id=f"preset-{name}")
        for name, item in presets().items()
    ]
    return html.Section(
        [
            html.Div(
                [
                    html.H1("Compare"),
                    html.Div([html.Span("From the paper:", className="note"), *links],
                             className="chips"),
                ],
                className="page-head",
            ),
            html.P(preset.about, className="note") if preset else None,
            dmc.MultiSelect(
                id=PICK_ID,
                label=f"Runs, up to {MAX_COMPARED}",
                placeholder="Add a run" if len(shown) < MAX_COMPARED else "",
                data=[{"value": item.id, "label": _option(item)} for item in options.values()],
                value=[record.id for record in shown],
                maxValues=MAX_COMPARED,
                searchable=True,
                hidePickedOptions=True,
                nothingFoundMessage="No such run",
                size="sm",
                maxDropdownHeight=320,
            ),
        ],
        className="panel compare-head",
    )  # fmt: skip


def _option(record: RunRecord) -> str:
    plan = record.plan
    return f"{run_title(record)} · {plan.altitude_ft:,.0f} ft, seed {plan.seed} · {record.id[9:15]}"


def _missing(preset: Preset, missing: int) -> html.Section:
    flights = "flight is" if missing == 1 else "flights are"
    return html.Section(
        [
            html.P(f"{missing} of its {len(preset.faults)} {flights} not in the store yet."),
            dmc.Button(f"Fly {missing}", id=FLY_ID, size="sm", loaderProps={"children": "Flying…"}),
        ],
        className="panel empty compare-missing",
    )


def _waiting(waiting: Sequence[RunRecord]) -> html.P | None:
    if not waiting:
        return None
    return html.P(
        f"{len(waiting)} flying or queued; each appears here when it is finished.",
        className="panel note",
        role="status",
    )


def _empty(store: RunStore) -> html.Section:
    any_done = any(record.status == "done" for record in store.records())
    first: list[Any] = (
        [
            f"Choose up to {MAX_COMPARED} runs above, or tick them in ",
            dcc.Link("Runs", href="/runs"),
            ".",
        ]
        if any_done
        else ["No finished run is stored yet: ", dcc.Link("fly one", href="/"), "."]
    )
    return html.Section(
        [
            html.P(
                "Runs in one chart: any channel, residual or flight path, and a table of their "
                "differences."
            ),
            html.P(
                [*first, " Or take one of the paper's comparisons: Fig. 6 shows where each fault "
                 "takes the aircraft, Fig. 7 what the key channels read. Missing runs are flown "
                 "for you."]
            ),
        ],
        className="panel empty",
    )  # fmt: skip


def _comparison(done: Sequence[RunRecord], preset: Preset | None) -> list[html.Section]:
    view = preset.view if preset else "channels"
    return [
        html.Section([html.H2("Differences", className="panel-title"), _table(done)],
                     className="panel"),
        html.Section(
            [
                html.Div(_controls(view, done), className="compare-controls"),
                html.P(
                    [
                        html.Span([_line_of(place), title])
                        for place, title in enumerate(short_titles(done))
                    ],
                    className="note compare-key",
                ),
                html.Div(id=FIGURES_ID, className="compare-figures"),
            ],
            className="panel",
        ),
    ]  # fmt: skip


def _controls(view: str, done: Sequence[RunRecord]) -> list[Any]:
    return [
        dmc.SegmentedControl(
            id=VIEW_ID,
            data=[{"value": "channels", "label": "Channels"}, {"value": "paths", "label": "Paths"}],
            value=view,
            size="xs",
            **attributes(aria_label="View"),
        ),
        _channel_controls(done),
        html.Div(
            dmc.SegmentedControl(
                id=RISE_ID,
                data=[{"value": str(rise), "label": _rise_words(rise)} for rise in RISES],
                value=str(RISES[0]),
                size="xs",
                **attributes(aria_label="Vertical scale"),
            ),
            id="compare-path-controls",
            className="compare-controls",
        ),
    ]


def _channel_controls(done: Sequence[RunRecord]) -> html.Div:
    from core.experiments.paper.fig7 import KEY_CHANNELS  # as in `presets`

    return html.Div(
        [
            dmc.SegmentedControl(
                id=KIND_ID,
                data=[
                    {"value": "reading", "label": "Readings"},
                    {"value": "residual", "label": "Residuals"},
                    {"value": "difference", "label": "Minus the first run"},
                ],
                value="reading" if len(done) > 1 else "residual",
                size="xs",
                **attributes(aria_label="Quantity"),
            ),
            dmc.MultiSelect(
                id=CHANNELS_ID,
                data=[
                    {"value": item.name, "label": f"{item.label}, {unit_label(item.unit)}"}
                    for item in CHANNELS
                ],
                value=list(KEY_CHANNELS),
                maxValues=MAX_CHANNELS,
                searchable=True,
                hidePickedOptions=True,
                size="xs",
                className="compare-channels",
                **attributes(aria_label=f"Channels, up to {MAX_CHANNELS}"),
            ),
        ],
        id="compare-channel-controls",
        className="compare-controls",
    )


def _rise_words(rise: float) -> str:
    return "True to scale" if rise == 1.0 else f"Heights ×{rise:g}"


def _table(done: Sequence[RunRecord]) -> html.Div:
    heads = [
        html.Th(
            [
                _line_of(place),
                dcc.Link(title, href=run_path(record.id)),
            ],
            scope="col",
        )
        for place, (record, title) in enumerate(zip(done, short_titles(done), strict=True))
    ]
    rows: list[tuple[str, Sequence[Any]]] = [*differences(done)]
    rows.append(("Diagnosis", [_verdict(record) for record in done]))
    return html.Div(
        html.Table(
            [
                html.Thead(html.Tr([html.Th("", scope="col"), *heads])),
                html.Tbody(
                    [
                        html.Tr([html.Th(name, scope="row"), *map(html.Td, values)])
                        for name, values in rows
                    ]
                ),
            ],
            className="plain differences",
        ),
        className="scroll-x",
        tabIndex=0,
        role="region",
        **attributes(aria_label="Differences between the runs"),
    )


def _line_of(place: int) -> html.I:
    """A piece of the line by which the run at that place is drawn."""
    style = {"solid": "solid", "dot": "dotted"}.get(DASHES[place], "dashed")
    return html.I(
        className="run-key", style={"borderTopColor": COLOURS[place], "borderTopStyle": style}
    )


def _verdict(record: RunRecord) -> list[Any]:
    outcome = run_outcome(record)
    if outcome is None or record.top_probability is None:
        return [STATUS_WORDS[record.status]]
    said = f"{mode_name(outcome.diagnosed)}, {percent(record.top_probability)} "
    return [said, outcome_mark(outcome)]

"""The page *Teach*: begin a mystery flight, mark its evidence, name its fault.

What a page shows of an open flight comes from `core.teach.attempt.Attempt` and the sensors alone;
`app.pages.teach_reveal` shows what it was.
"""

from collections.abc import Sequence
from datetime import datetime
from itertools import groupby
from typing import Any

import dash_mantine_components as dmc
from dash import dcc, html

from app.pages.attributes import attributes
from app.pages.fly import SUBSYSTEM_ORDER
from app.pages.words import mode_name
from app.panels.axes import clock
from app.panels.mystery import mark_words, shown_marks
from app.panels.terms import term
from core.channels import CHANNELS, Channel, unit_label
from core.teach.attempt import Attempt
from core.teach.challenge import ALL_MODES, LEVELS, mode_sets
from core.teach.scoring import RULES, Mark

TEACH_PREFIX = "/teach/"

START_ID, START_ERROR_ID, PAST_ID, LEARNER_ID = (
    "mystery-start",
    "mystery-start-error",
    "mystery-past",
    "learner",
)
FLIGHT_ID, MARKS_ID, MARK_ID, EVIDENCE_ID, DRAWN_ID = (
    "mystery-flight",
    "mystery-marks",
    "mystery-mark",
    "mystery-evidence",
    "mystery-drawn",
)
ANSWER_ID, SUBMIT_ID, GIVE_UP_ID, HINT_ID, NOTE_ID = (
    "mystery-answer",
    "mystery-submit",
    "mystery-give-up",
    "mystery-hint",
    "mystery-note",
)


def teach_path(attempt_id: str) -> str:
    """The address of a mystery flight."""
    return TEACH_PREFIX + attempt_id


def start_layout() -> html.Div:
    """How it goes, what it is worth, and the button that begins one."""
    return html.Div(
        [
            html.Section([*_introduction(), _start_form()], className="panel teach-start"),
            html.Section(
                [
                    html.H2("Your flights", className="panel-title"),
                    html.Div(past_list(()), id=PAST_ID),
                ],
                className="panel",
                **attributes(aria_label="Your mystery flights"),
            ),
            html.Section(
                [html.H2("What it is worth", className="panel-title"), _rules()], className="panel"
            ),
            dcc.Store(id=LEARNER_ID, storage_type="local"),
        ],
        className="teach-page",
    )


def attempt_layout(
    attempt: Attempt, altitude_ft: float, speed_kt: float, flight: dict[str, Any]
) -> html.Div:
    """An open mystery flight: the sensors, and what the learner makes of them."""
    return html.Div(
        [
            html.Aside(
                [
                    _head(attempt, altitude_ft, speed_kt),
                    _evidence_panel(attempt),
                    _answer_panel(attempt),
                ],
                className="mystery-side",
            ),
            html.Div(channel_panels(), className="mystery-charts"),
            *stores(attempt, flight),
            dcc.Store(id=MARK_ID, data=None),
        ],
        id="mystery",
        className="mystery",
        **attributes(data_over="no"),
    )


def stores(attempt: Attempt, flight: dict[str, Any]) -> list[dcc.Store]:
    """What `assets/teach.js` draws."""
    return [
        dcc.Store(id=FLIGHT_ID, data=flight),
        dcc.Store(id=MARKS_ID, data=shown_marks(attempt.marks)),
        dcc.Store(id=DRAWN_ID, data=None),
    ]


def evidence_list(marks: Sequence[Mark]) -> html.Ul | html.P:
    """What has been marked so far, in the order of time."""
    if not marks:
        return html.P(
            "Nothing marked yet. Click a chart where its line leaves its course, and say which way "
            "it goes.",
            className="note",
        )
    return html.Ul(
        [
            html.Li(
                [
                    html.Span(mark_words(mark)),
                    html.Span(f"from {clock(mark.time_s)}", className="note mono"),
                    html.Button(
                        "×",
                        type="button",
                        className="mark-remove",
                        **attributes(
                            data_channel=mark.channel, aria_label=f"Remove: {mark_words(mark)}"
                        ),
                    ),
                ]
            )
            for mark in sorted(marks, key=lambda mark: mark.time_s)
        ],
        className="marks",
    )


def past_list(attempts: Sequence[Attempt]) -> Any:
    """A learner's flights, newest first, each with what it came to."""
    if not attempts:
        return html.P(
            "None yet in this browser. Each one that you fly is kept here with its score.",
            className="note",
        )
    heads = ("Begun (UTC)", "Severity", "Your answer", "Score", "Time")
    return dmc.TableScrollContainer(
        html.Table(
            [
                html.Thead(html.Tr([html.Th(head, scope="col") for head in heads])),
                html.Tbody([_past_row(attempt) for attempt in attempts]),
            ],
            className="plain",
        ),
        minWidth=460,
    )


def channel_panels() -> html.Div:
    """The 23 charts, grouped by subsystem; each is a slider over the flight's time."""
    numbered = sorted(
        enumerate(CHANNELS), key=lambda item: SUBSYSTEM_ORDER.index(item[1].subsystem)
    )
    panels = [
        html.Section(
            [
                html.H2(subsystem.capitalize(), className="panel-title"),
                html.Div(
                    [_chart(index, channel) for index, channel in group],
                    className=f"tiles tiles-{subsystem}",
                ),
            ],
            className=f"panel panel-{subsystem}",
            **attributes(aria_label=f"{subsystem.capitalize()} sensors"),
        )
        for subsystem, group in groupby(numbered, key=lambda item: item[1].subsystem)
    ]
    return html.Div(panels, className="charts")


def _introduction() -> list[Any]:
    steps = (
        ("Watch", "One aircraft, 23 sensors, five minutes. Something may be wrong with it."),
        ("Mark", "Click a chart where its line leaves its course, and say which way it goes."),
        ("Name", "Name the fault. Then see it beside the healthy mirror, and what you missed."),
    )
    return [
        html.H1("Mystery flight"),
        html.Ol(
            [html.Li([html.B(name), html.Span(text)]) for name, text in steps],
            className="teach-steps",
        ),
    ]


def _start_form() -> html.Div:
    sets = mode_sets()
    names = {ALL_MODES: f"Any of the {len(sets[ALL_MODES])} classes"} | {
        name: f"{name.capitalize()} ({len(modes) - 1})"
        for name, modes in sets.items()
        if name != ALL_MODES
    }
    return html.Div(
        [
            dmc.InputWrapper(
                dmc.SegmentedControl(
                    id="mystery-level",
                    data=[{"value": level.id, "label": level.name} for level in LEVELS],
                    value=LEVELS[0].id,
                    fullWidth=True,
                    size="sm",
                ),
                label="How plain the fault is",
                labelElement="div",
                description="severity "
                + ", ".join(
                    f"{level.severity_low:g} to {level.severity_high:g}" for level in LEVELS
                ),
            ),
            dmc.Select(
                id="mystery-set",
                label="Drawn from",
                description="a healthy flight is always possible",
                data=[{"value": name, "label": label} for name, label in names.items()],
                value=ALL_MODES,
                allowDeselect=False,
                size="sm",
            ),
            dmc.TextInput(
                id="mystery-code",
                label="Code",
                description="optional: one code, one flight for a class",
                placeholder="e.g. monday-2",
                size="sm",
                inputProps={"maxLength": 20},
            ),
            dmc.Button(
                "Fly it", id=START_ID, size="sm", loaderProps={"children": "Flying…"}, n_clicks=0
            ),
            html.P(id=START_ERROR_ID, className="teach-error", role="alert"),
        ],
        className="teach-form",
    )


def _rules() -> html.Dl:
    entries = (
        (
            f"{RULES.answer} for the answer",
            f"all for the fault itself, {RULES.look_alike_share:.0%} for one of its look-alikes, "
            f"{RULES.subsystem_share:.0%} for another of the same subsystem".replace("%", " %"),
        ),
        (
            f"{RULES.evidence} for the evidence",
            f"{RULES.enough_marks} right marks are enough, wrong ones count against you; a mark is "
            f"right if the channel left its mirror, that way, by then or at most "
            f"{RULES.grace_s:g} s later",
        ),
        (
            f"{RULES.time} for time",
            f"within {clock(RULES.quick_s)}; none after {clock(RULES.slow_s)}, or for a wrong "
            "answer",
        ),
        (
            f"−{RULES.mirror_cost} for the mirror",
            "if you ask to see what the healthy aircraft did",
        ),
    )
    return html.Dl(
        [html.Div([html.Dt(name), html.Dd(text)]) for name, text in entries], className="rules"
    )


def _past_row(attempt: Attempt) -> html.Tr:
    begun = datetime.fromisoformat(attempt.begun)
    asked = attempt.challenge
    if attempt.over:
        answer = "gave up" if attempt.answer is None else mode_name(attempt.answer)
        points = f"{attempt.score.total} of 100" if attempt.score else "–"
        time = clock(attempt.elapsed_s)
    else:
        answer, points, time = "open", "", ""
    return html.Tr(
        [
            html.Td(
                dcc.Link(f"{begun:%Y-%m-%d %H:%M}", href=teach_path(attempt.id)), className="nowrap"
            ),
            html.Td(
                f"{asked.severity_low:g} to {asked.severity_high:g}"
                + (f", code {asked.code}" if asked.code else "")
            ),
            html.Td(answer),
            html.Td(points, className="nowrap"),
            html.Td(time, className="mono"),
        ]
    )


def _head(attempt: Attempt, altitude_ft: float, speed_kt: float) -> html.Section:
    asked = attempt.challenge
    return html.Section(
        [
            html.Div(
                [
                    html.H1("Mystery flight"),
                    html.Output(
                        clock(attempt.elapsed_s),
                        id="mystery-clock",
                        className="mono mystery-clock",
                        **attributes(
                            data_elapsed=f"{attempt.elapsed_s:.1f}", aria_label="Time taken"
                        ),
                    ),
                ],
                className="mystery-title",
            ),
            html.P(
                f"Cruise at {altitude_ft:,.0f} ft and {speed_kt:.0f} kt, throttle fixed. If there "
                f"is a fault, its severity is {asked.severity_low:g} to {asked.severity_high:g}.",
                className="note",
            ),
            html.Div(
                [
                    dmc.Button(
                        f"Show the mirror (−{RULES.mirror_cost})",
                        id=HINT_ID,
                        size="xs",
                        variant="default",
                        display="none" if attempt.mirror_seen else "block",
                    ),
                    html.Span(
                        [html.I(className="key faulted"), "this aircraft"], className="mystery-key"
                    ),
                    html.Span(
                        [html.I(className="key mirror"), "healthy mirror"],
                        className="mystery-key",
                        id="mystery-mirror-key",
                        hidden=not attempt.mirror_seen,
                    ),
                ],
                className="mystery-hint",
            ),
            html.Div(id=NOTE_ID, role="alert"),
        ],
        className="panel",
        **attributes(aria_label="Mystery flight"),
    )


def _evidence_panel(attempt: Attempt) -> html.Section:
    return html.Section(
        [
            html.H2(term("evidence"), className="panel-title"),
            html.Div(
                evidence_list(attempt.marks), id=EVIDENCE_ID, **attributes(aria_live="polite")
            ),
            html.P(
                [
                    "By keyboard: ", dmc.Kbd("Tab", size="xs"), " to a chart, ",
                    dmc.Kbd("←", size="xs"), " ", dmc.Kbd("→", size="xs"), " to the time, ",
                    dmc.Kbd("Enter", size="xs"), " to mark. Drag across a chart to zoom all, "
                    "double-click to see all again.",
                ],
                className="note keys-note",
            ),
        ],
        className="panel",
        **attributes(aria_label="Evidence"),
    )  # fmt: skip


def _answer_panel(attempt: Attempt) -> html.Section:
    return html.Section(
        [
            html.H2("Your answer", className="panel-title"),
            dmc.Select(
                id=ANSWER_ID,
                data=[
                    {"value": mode, "label": mode_name(mode)} for mode in attempt.challenge.modes
                ],
                placeholder="Name the fault",
                searchable=True,
                nothingFoundMessage="No such mode",
                maxDropdownHeight=300,
                size="sm",
                **attributes(aria_label="Failure mode"),
            ),
            html.Div(
                [
                    dmc.Button("Submit", id=SUBMIT_ID, size="sm", n_clicks=0,
                               loaderProps={"children": "Scoring…"}),
                    dcc.ConfirmDialogProvider(
                        dmc.Button("Give up", size="sm", variant="default"),
                        id=GIVE_UP_ID,
                        message="Give up and see what it was? That scores nothing.",
                    ),
                    html.A("What the faults look like", href="/faults", target="_blank",
                           className="note"),
                ],
                className="mystery-buttons",
            ),
        ],
        className="panel",
        **attributes(aria_label="Answer"),
    )  # fmt: skip


def _chart(index: int, channel: Channel) -> html.Figure:
    return html.Figure(
        [
            html.Figcaption(
                [
                    html.Span(channel.label, className="tile-name"),
                    html.Output("", id=f"mystery-readout-{index}", className="tile-readout mono"),
                    html.Span(unit_label(channel.unit), className="tile-unit"),
                ]
            ),
            html.Div(
                id=f"mystery-{index}",
                className="mystery-chart",
                role="slider",
                tabIndex=0,
                **attributes(
                    data_channel=channel.name,
                    data_label=channel.label,
                    aria_label=f"{channel.label} against time",
                    aria_valuemin="0",
                    aria_valuenow="0",
                ),
            ),
        ],
        className="tile",
    )

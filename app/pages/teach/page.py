"""One mystery flight: mark its evidence, name its fault.

What a page shows of an open flight comes from `core.teach.attempt.Attempt` and the sensors alone;
`app.pages.teach.reveal` shows what it was.
"""

from collections.abc import Sequence
from typing import Any

import dash_mantine_components as dmc
from dash import dcc, html

from app.figures.mystery import mark_words, shown_marks
from app.kit.attributes import attributes
from app.kit.channel_panels import channel_panels
from app.kit.terms import term
from app.kit.words import mode_name
from core.channels import Channel, unit_label
from core.clock import clock
from core.teach.attempt import Attempt
from core.teach.scoring import RULES, Mark

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


def attempt_layout(
    attempt: Attempt, altitude_ft: float, speed_kt: float, flight: dict[str, Any]
) -> html.Div:
    """An open mystery flight: the sensors, the marked evidence, and the answer."""
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
            html.Div(charts(), className="mystery-charts"),
            *stores(attempt, flight),
            dcc.Store(id=MARK_ID, data=None),
        ],
        id="mystery",
        className="mystery",
        **attributes(data_over="no"),
    )


def stores(attempt: Attempt, flight: dict[str, Any]) -> list[dcc.Store]:
    """The stores that `teach/teach.js` draws."""
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


def charts() -> html.Div:
    """A chart for each channel, grouped by subsystem; each is a slider over the flight's time."""
    return html.Div(channel_panels(_chart, "sensors"), className="charts")


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
                        message="Give up and see the fault? That scores nothing.",
                    ),
                    html.A("Signatures of the faults", href="/faults", target="_blank",
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

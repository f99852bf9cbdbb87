"""The start of *Teach*: the rules of a mystery flight, its form, and the flights so far."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

import dash_mantine_components as dmc
from dash import dcc, html

from app.kit.addresses import teach_path
from app.kit.attributes import attributes
from app.kit.words import mode_name
from core.channels import N_CHANNELS
from core.clock import clock
from core.teach.attempt import Attempt
from core.teach.challenge import ALL_MODES, LEVELS, mode_sets
from core.teach.scoring import RULES

START_ID, START_ERROR_ID, PAST_ID, LEARNER_ID = (
    "mystery-start",
    "mystery-start-error",
    "mystery-past",
    "learner",
)


def start_layout() -> html.Div:
    """The steps, the form, the flights so far, and the scoring."""
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
                [html.H2("Scoring", className="panel-title"), _rules()], className="panel"
            ),
            dcc.Store(id=LEARNER_ID, storage_type="local"),
        ],
        className="teach-page",
    )


def past_list(attempts: Sequence[Attempt]) -> Any:
    """A learner's flights, newest first, each with its score."""
    if not attempts:
        return html.P(
            "None yet in this browser. Your flights are kept here with their scores.",
            className="note",
        )
    heads = ("Started (UTC)", "Severity", "Your answer", "Score", "Time")
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


def _introduction() -> list[Any]:
    steps = (
        (
            "Watch",
            f"One aircraft, {N_CHANNELS} sensors, five minutes. Something may be wrong with it.",
        ),
        ("Mark", "Click a chart where its line leaves its course, and choose the direction."),
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
                label="Difficulty",
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
            "if you ask to see the healthy aircraft",
        ),
    )
    return html.Dl(
        [html.Div([html.Dt(name), html.Dd(text)]) for name, text in entries], className="rules"
    )


def _past_row(attempt: Attempt) -> html.Tr:
    started = datetime.fromisoformat(attempt.begun)
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
                dcc.Link(f"{started:%Y-%m-%d %H:%M}", href=teach_path(attempt.id)),
                className="nowrap",
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

"""A mystery flight that is over: the fault, the evidence for it, and the score."""

from typing import Any

from dash import dcc, html

from app.figures.mystery import DIRECTION_WORDS
from app.figures.signature import signed
from app.kit.addresses import fault_path, run_path
from app.kit.attributes import attributes
from app.kit.words import mode_name, takes_cylinder
from app.pages.teach.page import charts, stores
from core.channels import channel, unit_label
from core.clock import clock
from core.diagnosis.diagnosis import Evidence
from core.knowledge.knowledge import knowledge
from core.teach.attempt import Attempt
from core.teach.classroom import Truth
from core.teach.scoring import RULES, Score, Verdict
from core.units import percent

SHOWN_EVIDENCE = 8

VERDICT_WORDS: dict[Verdict, str] = {
    "right": "✓ found",
    "direction": "✗ other way",
    "early": "✗ too early",
    "still": "✗ did not move",
}


def reveal_layout(attempt: Attempt, truth: Truth, flight: dict[str, Any]) -> html.Div:
    """The fault, the evidence and the score, beside the charts with mirror and onset."""
    score = attempt.score
    return html.Div(
        [
            html.Div(
                [
                    _score_panel(attempt, score) if score else None,
                    _truth_panel(attempt, truth),
                    _evidence_panel(attempt, truth, score) if score else None,
                ],
                className="reveal",
            ),
            html.Div(charts(), className="mystery-charts"),
            *stores(attempt, flight),
        ],
        id="mystery",
        className="mystery-over",
        **attributes(data_over="yes"),
    )


def _score_panel(attempt: Attempt, score: Score) -> html.Section:
    rows = [
        ("Answer", score.answer, f"of {RULES.answer}"),
        ("Evidence", score.evidence, f"of {RULES.evidence}"),
        ("Time", score.time, f"of {RULES.time}, {clock(attempt.elapsed_s)} taken"),
    ]
    if score.mirror:
        rows.append(("Mirror", score.mirror, "for asking to see it"))
    return html.Section(
        [
            html.H2("Score", className="panel-title"),
            html.P(
                [html.B(str(score.total), id="mystery-score"), html.Span(" of 100")],
                className="score",
            ),
            html.Table(
                html.Tbody(
                    [
                        html.Tr(
                            [
                                html.Th(name, scope="row"),
                                html.Td(f"{points}".replace("-", "−"), className="number"),
                                html.Td(words, className="note"),
                            ]
                        )
                        for name, points, words in rows
                    ]
                ),
                className="plain score-rows",
            ),
            dcc.Link("Fly another", href="/teach", className="button-link"),
        ],
        className="panel reveal-score",
        **attributes(aria_label="Score"),
    )


def _truth_panel(attempt: Attempt, truth: Truth) -> html.Section:
    fault = truth.fault
    written = knowledge()[fault.mode]
    healthy = fault.mode == "nominal"
    where = f", cylinder {fault.target_cylinder}" if takes_cylinder(fault.mode) else ""
    facts = (
        "Both aircraft flew the same flight: nothing was wrong."
        if healthy
        else f"Severity {fault.severity:.2f}, from {clock(fault.onset_s)}{where}."
    )
    likely, share = truth.diagnosis.ranked(1)[0]
    links = [dcc.Link("All about this fault", href=fault_path(fault.mode))]
    if attempt.run_id is not None:
        links.insert(0, dcc.Link("Open the full run", href=run_path(attempt.run_id)))
    return html.Section(
        [
            html.P("The fault was", className="note"),
            html.H1(written.name, id="mystery-truth"),
            html.P([html.B(facts), " ", "" if healthy else written.mechanism], className="prose"),
            *_answered(attempt, fault.mode),
            html.P(
                f"The classifier, which has seen the mirror, says {mode_name(likely).lower()}, "
                f"{percent(share)}.",
                className="note",
            ),
            html.Div(links, className="link-row"),
        ],
        className="panel reveal-truth",
        **attributes(aria_label="The fault"),
    )


def _answered(attempt: Attempt, truth: str) -> list[html.P]:
    """The learner's answer, and how to distinguish it from the fault."""
    if attempt.answer is None:
        return [html.P("You gave up.")]
    if attempt.answer == truth:
        return [html.P("You named it.")]
    said = mode_name(attempt.answer)
    lines = [html.P(["You said ", html.B(said.lower()), "."])]
    for mine, other in ((truth, attempt.answer), (attempt.answer, truth)):
        for alike in knowledge()[mine].look_alikes:
            if alike.mode == other:
                between = f"{mode_name(mine)} and {mode_name(other).lower()}"
                return [*lines, html.P(f"{between} look alike. {alike.tell}", className="prose")]
    return lines


def _evidence_panel(attempt: Attempt, truth: Truth, score: Score) -> html.Section:
    evidence = truth.diagnosis.evidence
    marked = {mark.channel: mark for mark in attempt.marks}
    shown = [
        item for at, item in enumerate(evidence) if at < SHOWN_EVIDENCE or item.channel in marked
    ]
    moved = {item.channel for item in evidence}
    rows = [_evidence_row(item, score, attempt) for item in shown]
    rows += [
        html.Tr(
            [
                html.Th(channel(name).label, scope="row"),
                html.Td("did not move"),
                html.Td(""),
                html.Td(""),
                html.Td(VERDICT_WORDS["still"], className="verdict-wrong"),
            ]
        )
        for name in marked
        if name not in moved
    ]
    left = len(evidence) - len(shown)
    heads = ("Channel", "Moved", "From", "On average", "Your mark")
    body: Any = html.P(
        "No channel left its mirror, so there was nothing to mark.", className="note"
    )
    if rows:
        body = html.Table(
            [
                html.Thead(html.Tr([html.Th(head, scope="col") for head in heads])),
                html.Tbody(rows),
            ],
            className="plain",
        )
    return html.Section(
        [
            html.H2("The evidence", className="panel-title"),
            html.Div(body, className="scroll-x", tabIndex=0, role="group",
                     **attributes(aria_label="Evidence")),
            html.P(f"and {left} channels that moved less", className="note") if left > 0 else None,
        ],
        className="panel reveal-evidence",
        **attributes(aria_label="The evidence"),
    )  # fmt: skip


def _evidence_row(item: Evidence, score: Score, attempt: Attempt) -> html.Tr:
    shown = channel(item.channel)
    verdict = score.verdicts.get(item.channel)
    missed = item.channel in score.missed and verdict is None
    words = VERDICT_WORDS[verdict] if verdict else ("missed" if missed else "not marked")
    kind = {"right": "verdict-right", None: "note"}.get(verdict, "verdict-wrong")
    return html.Tr(
        [
            html.Th(shown.label, scope="row"),
            html.Td(DIRECTION_WORDS[item.direction]),
            html.Td(clock(item.onset_s), className="mono"),
            html.Td(f"{signed(round(item.value, shown.decimals))} {unit_label(item.unit)}",
                    className="mono nowrap"),
            html.Td(words, className=f"nowrap {kind}"),
        ]
    )  # fmt: skip

"""The panel *Report*: choice of writer, the text, how it was checked, questions, files."""

from typing import Any

import dash_mantine_components as dmc
from dash import dcc, html

from app.kit.attributes import attributes
from app.kit.nodes import Node, nodes
from app.pages.report.text import answer_text, how_checked, report_text
from app.report_desk import Job
from core.report.grounded import GroundedReport
from core.report.sections import SECTION_TITLES
from core.report.write.offers import offers

HINT = (
    f"{', '.join(SECTION_TITLES[:-1])} and {SECTION_TITLES[-1]} appear here once the flight is "
    "diagnosed, each sentence made from, or checked against, evidence and FMEA knowledge."
)

FILES = {"html": "HTML", "pdf": "PDF", "md": "Markdown"}

PANEL_ID = "report-panel"

REPORT_NODES_ID = "report-nodes"
ANSWER_NODES_ID = "answers-nodes"


def report_panel() -> html.Section:
    """The panel before any run. Its tools show once a run is done."""
    return html.Section(
        [
            html.Div(
                [html.H2("Report", className="panel-title"), _writer_choice()],
                className="report-head",
            ),
            html.P("", id="report-status", className="note", role="status"),
            html.Div(id="report", className="report"),
            _questions(),
            dcc.Store(id=REPORT_NODES_ID, data=hint()),
            dcc.Store(id=ANSWER_NODES_ID, data=[]),
        ],
        id=PANEL_ID,
        className="panel",
        **attributes(aria_label="Report", data_writing="no"),
    )


def hint() -> list[Node]:
    """The panel's text before any report."""
    return nodes(html.P(HINT, className="note"))


def whole_report(run_id: str, report: GroundedReport) -> list[Node]:
    """A complete report with its notes, how it was checked, and its files, to be drawn."""
    parts = [
        *_by(report),
        *report_text(report.sentences, is_trusted=report.is_trusted),
        *(html.P(note, className="note") for note in report.notes),
        how_checked(report),
        _files(run_id),
    ]
    return nodes(parts)


def answer(question: str, report: GroundedReport) -> list[Node]:
    """A question with its answer, to be drawn."""
    notes = [html.P(note, className="note") for note in report.notes]
    text = answer_text(report.sentences, is_trusted=report.is_trusted)
    return nodes(
        html.Div([html.P(question, className="question"), *text, *notes], className="answer")
    )


def unfinished(job: Job) -> list[Node]:
    """A report while it is written: what is checked so far, and the draft after it."""
    sentences, trusted = list(job.sentences), job.offer.is_trusted
    return nodes(report_text(sentences, is_trusted=trusted, draft=job.draft))


def watched(job: Job, stored: GroundedReport) -> tuple[list[Node] | None, list[Node] | None, str]:
    """The panel during a job and after it: report, newest answer, and status.

    None for a report that stays. ``stored`` is the report to show if the job makes none.
    """
    status = _status(job)
    if job.question is None:
        if not job.over:
            return unfinished(job), None, status
        return whole_report(job.run_id, job.outcome or stored), None, status
    if job.outcome is not None:
        return None, answer(job.question, job.outcome), status
    if job.over:
        return None, nodes(html.P(job.question, className="question")), status
    sentences, trusted = list(job.sentences), job.offer.is_trusted
    text = answer_text(sentences, is_trusted=trusted, draft=job.draft[1])
    return None, nodes([html.P(job.question, className="question"), *text]), status


def _status(job: Job) -> str:
    name = job.offer.name
    if job.problem is not None:
        return f"{name}: {job.problem}. The previous report is kept."
    if job.stopped.is_set():
        return f"{name} was stopped. The previous report is kept."
    if job.over:
        return ""
    doing = "answers" if job.question is not None else "writes"
    where = f": {job.draft[0]}" if job.draft[0] else ""
    return f"{name} {doing}{where} …"


def _by(report: GroundedReport) -> list[html.P]:
    if report.is_trusted:
        return []
    return [html.P(f"Written by {report.writer}.", className="note")]


def _writer_choice() -> html.Div:
    choice = [
        {
            "value": offer.kind,
            # A writer that is not available says why in the menu, and nowhere else.
            "label": f"{offer.name}: {offer.problem}" if offer.problem else offer.name,
            "disabled": offer.problem is not None,
        }
        for offer in offers()
    ]
    return html.Div(
        [
            dmc.Select(
                id="report-writer",
                data=choice,
                value=choice[0]["value"],
                size="xs",
                allowDeselect=False,
                comboboxProps={"width": 300, "position": "bottom-end"},
                **attributes(aria_label="Writer of the report"),
            ),
            dmc.Button("Rewrite", id="report-write", size="xs", variant="default"),
            dmc.Button("Stop", id="report-stop", size="xs", variant="default"),
        ],
        className="report-tools report-choice",
    )


def _files(run_id: str) -> html.P:
    links: list[Any] = ["Download as "]
    for kind, name in FILES.items():
        links += [html.A(name, href=f"/runs/{run_id}/report.{kind}", download=""), ", "]
    return html.P([*links[:-1], "."], className="note report-tools")


def _questions() -> html.Div:
    return html.Div(
        [
            html.Div(
                [
                    dmc.TextInput(
                        id="question",
                        label="Ask about this report",
                        placeholder="Why not the oil cooler?",
                        size="xs",
                        debounce=True,
                    ),
                    dmc.Button("Ask", id="report-ask", size="xs", variant="default"),
                ],
                className="question-row",
            ),
            html.Div(id="answers", className="report", **attributes(aria_live="polite")),
        ],
        className="report-tools",
    )

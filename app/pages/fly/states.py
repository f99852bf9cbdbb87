"""Updates for the states of the page *Fly*, whatever the run: empty, ready, with a report."""

from collections.abc import Sequence
from typing import Any

from dash import html

from app.figures.outcome_line import OUTCOME_ID
from app.figures.sensors import cleared
from app.kit.wiring import Update
from app.pages.fly import live_controls
from app.pages.fly import page as fly
from app.pages.fly.cursor_tools import LIMIT_MARKS_ID, TRACK_ID, VERDICT_MARKS_ID
from app.pages.fly.setup import DEFAULT_PLAN
from app.pages.report import panel as report_panel
from app.pages.report.panel import whole_report
from app.report_desk import Job
from core.report.grounded import GroundedReport


def idle() -> list[Update]:
    """The page with no run on it."""
    return [
        *status_updates("idle", "Ready"),
        *button_updates(live=False, finished=False, retryable=False),
        Update("run-title", "children", "No flight yet"),
        Update("run-subtitle", "children", fly.idle_hint()),
        *blank(),
        *resting_charts(cleared("", DEFAULT_PLAN.duration_s, None)),
    ]


def cautioned(notes: Sequence[str], *, unsure: bool) -> list[Update]:
    """Cautions about the ranking, which is greyed while it is unreliable."""
    return [
        Update(
            "diagnosis-notes", "children", [html.P(note, className="caution") for note in notes]
        ),
        Update("ranking", "className", "is-unsure" if unsure else ""),
    ]


def reported(run_id: str, report: GroundedReport) -> list[Update]:
    """The sections, each sentence with its verdict."""
    return [Update(report_panel.REPORT_NODES_ID, "data", whole_report(run_id, report))]


def watched(job: Job, stored: GroundedReport) -> list[Update]:
    """The updates of a job on the report of a finished run; see `report_panel.watched`."""
    report, newest, status = report_panel.watched(job, stored)
    return [
        Update("report-status", "children", status),
        Update(report_panel.PANEL_ID, "data-writing", "no" if job.over else "yes"),
        *([] if report is None else [Update(report_panel.REPORT_NODES_ID, "data", report)]),
        *([] if newest is None else [Update(report_panel.ANSWER_NODES_ID, "data", newest)]),
    ]


def blank() -> list[Update]:
    """Everything that a run writes besides its charts, empty."""
    return [
        Update("alert", "children", None),
        Update("flight-events", "children", None),
        Update(live_controls.ACTIONS_ID, "children", None),
        Update(live_controls.BAR_ID, "hidden", True),
        Update("progress", "value", 0),
        Update("stage", "children", ""),
        Update(fly.RANKING_NODES_ID, "data", fly.ranking_hint()),
        Update(OUTCOME_ID, "children", None),
        *cautioned([], unsure=False),
        Update(report_panel.REPORT_NODES_ID, "data", report_panel.hint()),
        Update("report-status", "children", ""),
        Update(report_panel.PANEL_ID, "data-writing", "no"),
        Update(report_panel.ANSWER_NODES_ID, "data", []),
    ]


def resting_charts(tiles: dict[str, Any]) -> list[Update]:
    """All charts empty, with the axes of the flight that ``tiles`` is for."""
    figures = fly.resting_figures(tiles["duration_s"], tiles["onset_s"])
    return [
        Update("flight", "data", tiles),
        *(Update(store, "data", None) for store in (VERDICT_MARKS_ID, LIMIT_MARKS_ID, TRACK_ID)),
        *(Update(graph, "figure", figure) for graph, figure in figures.items()),
    ]


def status_updates(status: str, words: str) -> list[Update]:
    """The state of the run, as a word and for the style sheet."""
    return [
        Update("fly", "data-status", status),
        Update("run-status", "children", words),
    ]


def button_updates(*, live: bool, finished: bool, retryable: bool) -> list[Update]:
    """The buttons that make sense in a state of the run."""
    shown = {"cancel": live, "again": finished and not retryable, "retry": retryable}
    return [
        Update("run", "disabled", live),
        *(Update(name, "display", "block" if on else "none") for name, on in shown.items()),
    ]

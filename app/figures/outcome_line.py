"""The line that says what was injected, what was diagnosed, and whether the two agree."""

from typing import Any

from dash import html

from app.kit.attributes import attributes
from core.diagnosis.outcome import Outcome

OUTCOME_ID = "outcome"


def outcome_line(outcome: Outcome | None) -> html.P | None:
    """The line, its answer as a mark and as a word; nothing where there is no verdict yet."""
    if outcome is None:
        return None
    return html.P(
        [
            html.Span(["Injected: ", html.B(outcome.injected_words), ". "]),
            html.Span(["Diagnosed: ", html.B(outcome.diagnosed_words), ". "]),
            outcome_mark(outcome),
        ],
        className="outcome-line",
    )


def outcome_mark(outcome: Outcome) -> html.Span:
    """The mark with its word."""
    return html.Span(
        [
            html.Span(outcome.mark, **attributes(aria_hidden="true")),
            f" {outcome.mark_words}",
        ],
        className="outcome-mark",
        **_right(outcome),
    )


def _right(outcome: Outcome) -> dict[str, Any]:
    words = {True: "true", False: "false", None: "none"}
    return attributes(data_right=words[outcome.right])

"""A shipped model on the page *Results*: its scores and its confusion matrix."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from dash import dcc, html

from app.figures.axes import GRAPH_CONFIG
from app.figures.scores import confusion_figure
from app.kit.addresses import fault_path
from app.kit.words import mode_name
from app.pages.results import cell_runs
from core.experiments.stored import with_onset_known
from core.knowledge.knowledge import tell_apart
from core.units import percent

Row = Mapping[str, Any]

SHOWN_MISTAKES = 10
"""Kinds of mistake that are listed at once; the rest unfolds."""


class Mistake(NamedTuple):
    """Windows of one mode diagnosed as another, and their share of that mode's windows."""

    windows: int
    true: str
    said: str
    share: float


def card_line(card: Row) -> str:
    """The accuracy of a shipped model in one line, with what the score was given."""
    scores = card["scores"]
    windows = f"{percent(scores['test_windows']['accuracy'])} of"
    known_onset = with_onset_known(card)
    if "test_runs" not in scores:  # a card of Tables 1 to 4, which score windows alone
        return f"right on {windows} the windows of its test flights{known_onset}"
    return (
        f"right on {percent(scores['test_runs']['accuracy'])} of "
        f"{scores['test_runs']['n']:,} test flights and {windows} their windows{known_onset}"
    )


def model_parts(card: Row) -> list[Any]:
    """The confusion matrix of a model, and its mistakes as a list."""
    line = card_line(card)
    scores = card["scores"]["test_windows"]
    names = [mode_name(mode) for mode in card["classes"]]
    figure = confusion_figure(names, scores["confusion"])
    return [
        html.H2(f"{card['title']}, {card['conditions']} conditions"),
        html.P(f"{line[:1].upper()}{line[1:]}.", className="headline"),
        *onset_note(card),
        html.P(
            f"Confusion matrix over {scores['n']:,} windows of 30 s ({card['name']}):",
            className="prose",
        ),
        html.Div(
            dcc.Graph(
                id=cell_runs.matrix_id(card), figure=figure, config=GRAPH_CONFIG, responsive=True,
                style={"height": figure["layout"]["height"]},
            ),
            className="confusion",
        ),
        cell_runs.place(card),
        *_confusions(card, scores["confusion"]),
    ]  # fmt: skip


def onset_note(content: Row) -> list[html.P]:
    """A caution on a field score whose windows were placed by the true onset; else nothing."""
    if not with_onset_known(content):
        return []
    return [
        html.P(
            "The scored windows were placed by the true onset. The onset of a flight in the app is "
            "not known: there the diagnosis has to find it first.",
            className="note",
        )
    ]


def _confusions(card: Row, counts: Sequence[Sequence[int]]) -> list[Any]:
    """The mistakes in words, most frequent first, each with what tells the two apart."""
    classes = card["classes"]
    mistakes = sorted(
        (
            Mistake(count, classes[i], classes[j], count / sum(row))
            for i, row in enumerate(counts)
            for j, count in enumerate(row)
            if i != j and count
        ),
        reverse=True,
    )
    if not mistakes:
        return [html.P("No window was classified wrongly.")]
    often, rarer = mistakes[:SHOWN_MISTAKES], mistakes[SHOWN_MISTAKES:]
    parts: list[Any] = [
        html.H3("Mistakes"),
        html.P(_alike(mistakes), className="prose"),
        _table(card, often),
    ]
    if rarer:
        summary = f"{len(rarer)} rarer kinds" if len(rarer) > 1 else "One rarer kind"
        parts.append(html.Details([html.Summary(summary), _table(card, rarer)], className="rarer"))
    return parts


def _alike(mistakes: Sequence[Mistake]) -> str:
    """The share of mistakes between look-alikes, which people might make too."""
    wrong = sum(each.windows for each in mistakes)
    alike = sum(each.windows for each in mistakes if tell_apart(each.true, each.said))
    return (
        f"{wrong:,} windows are classified wrongly, {alike:,} of them ({percent(alike / wrong)}) "
        "as a look-alike: the FMEA knowledge says how to distinguish them."
    )


def _table(card: Row, mistakes: Sequence[Mistake]) -> html.Table:
    heads = {"Windows": "number", "Injected": "", "Diagnosed": "", "Share of its class": "number"}
    cells = [html.Th(head, scope="col", className=side) for head, side in heads.items()]
    rows = [row for each in mistakes for row in _rows(card, each)]
    return html.Table([html.Thead(html.Tr(cells)), html.Tbody(rows)], className="plain mistakes")


def _rows(card: Row, mistake: Mistake) -> list[html.Tr]:
    windows, true, said, share = mistake
    cells = [
        html.Td(cell_runs.count_button(card, true, said, windows), className="number"),
        html.Td(dcc.Link(mode_name(true), href=fault_path(true))),
        html.Td(dcc.Link(mode_name(said), href=fault_path(said))),
        html.Td(percent(share), className="number"),
    ]
    tell = tell_apart(true, said)
    if tell is None:
        return [html.Tr(cells)]
    return [
        html.Tr(cells, className="explained"),
        html.Tr([html.Td(), html.Td(tell, colSpan=3, className="note")]),
    ]

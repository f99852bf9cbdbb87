"""A shipped model on the page *Results*: how good it is, and what it takes for what."""

from collections.abc import Mapping, Sequence
from typing import Any

from dash import dcc, html

from app.pages import cell_runs
from app.pages.faults import fault_path
from app.pages.fly import GRAPH_CONFIG
from app.pages.words import mode_name
from app.panels.scores import confusion_figure

Row = Mapping[str, Any]

SHOWN_MISTAKES = 10
"""Kinds of mistake that are listed at once; the rest unfolds."""


def card_line(card: Row) -> str:
    """How good a shipped model is, in one line."""
    scores = card["scores"]
    windows = f"{100 * scores['test_windows']['accuracy']:.1f} % of"
    if "test_runs" not in scores:  # a card of Tables 1 to 4, which score windows alone
        return f"right on {windows} the windows of its test flights ({card['name']})"
    return (
        f"right on {100 * scores['test_runs']['accuracy']:.1f} % of "
        f"{scores['test_runs']['n']:,} test flights and {windows} their windows ({card['name']})"
    )


def model_parts(card: Row) -> list[Any]:
    """Who is taken for whom, as a matrix and as a list."""
    line = card_line(card)
    scores = card["scores"]["test_windows"]
    names = [mode_name(mode) for mode in card["classes"]]
    figure = confusion_figure(names, scores["confusion"])
    return [
        html.P(f"{line[:1].upper()}{line[1:]}.", className="headline"),
        html.H2(f"Windows of 30 s, {scores['n']:,} of them"),
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


def _confusions(card: Row, counts: Sequence[Sequence[int]]) -> list[Any]:
    """The mistakes in words, most frequent first, each with what tells the two apart."""
    classes = card["classes"]
    mistakes = sorted(
        (
            (count, classes[i], classes[j], sum(row))
            for i, row in enumerate(counts)
            for j, count in enumerate(row)
            if i != j and count
        ),
        reverse=True,
    )
    if not mistakes:
        return [html.P("No window was taken for another class.")]
    rows = [
        html.Tr(
            [
                html.Td(cell_runs.count_button(card, true, said, count), className="number"),
                html.Td(dcc.Link(mode_name(true), href=fault_path(true))),
                html.Td(dcc.Link(mode_name(said), href=fault_path(said))),
                html.Td(f"{100 * count / total:.1f} %", className="number"),
            ]
        )
        for count, true, said, total in mistakes
    ]
    parts: list[Any] = [html.H2("What is taken for what"), _table(rows[:SHOWN_MISTAKES])]
    if rarer := rows[SHOWN_MISTAKES:]:
        told = f"{len(rarer)} rarer kinds" if len(rarer) > 1 else "One rarer kind"
        parts.append(html.Details([html.Summary(told), _table(rarer)], className="rarer"))
    return parts


def _table(rows: list[html.Tr]) -> html.Table:
    heads = {"Windows": "number", "Injected": "", "Taken for": "", "Share of its class": "number"}
    cells = [html.Th(head, scope="col", className=side) for head, side in heads.items()]
    return html.Table([html.Thead(html.Tr(cells)), html.Tbody(rows)], className="plain mistakes")

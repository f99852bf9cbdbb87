"""The page *Help*: the tour, the keys and the glossary."""

from itertools import groupby
from typing import Any

import dash_mantine_components as dmc
from dash import dcc, html

from app.kit.attributes import attributes
from app.kit.glossary import Term, glossary

KEYS: tuple[tuple[str, tuple[tuple[str, str], ...]], ...] = (
    (
        "Fly",
        (
            ("Ctrl + Enter", "fly what the form says"),
            ("P", "switch the presenter view on and off"),
            ("Tab, then ← →", "on the slider: move the time of all charts and 3D views"),
            ("A, B", "set cursor A or B at the time cursor; Esc clears them"),
            ("+ − 0", "zoom all charts in, out, back to the whole flight"),
            ("< >", "when zoomed in, move earlier or later"),
            (
                "↑ ↓ Enter Esc",
                "in the report: move through the sentences, show or hide the evidence",
            ),
        ),
    ),
    (
        "Presenter view",
        (
            ("Space", "play, pause"),
            ("← →", "five seconds back, five forward"),
            ("H", "hide fault and verdict, show them again"),
            ("F", "fill the screen"),
            ("Esc", "leave"),
        ),
    ),
    (
        "Teach",
        (
            ("Tab", "from chart to chart"),
            ("← → Page ↑ ↓", "move the time by 5 s, by 30 s"),
            ("Enter", "mark the channel at that time; ↑ ↓ choose the direction"),
        ),
    ),
    (
        "The tour",
        (("← →", "previous stop, next stop"), ("Esc", "leave it")),
    ),
)
"""What the keyboard does, page by page."""


def layout() -> html.Div:
    """The page: tour, glossary and keys."""
    return html.Div(
        [
            html.Section(
                [
                    html.H1("Help"),
                    html.P(
                        [
                            "MirrorTwin flies a Cessna 172P twice, once with an engine fault and "
                            "once without. Any difference is caused by the fault. It shows where "
                            "the two diverge, diagnoses the fault and explains why.",
                        ],
                        className="prose",
                    ),
                    html.Div(
                        [
                            dmc.Button("Take the tour", size="sm", **attributes(data_tour="start")),
                            dcc.Link("Find a hidden fault yourself", href="/teach"),
                            dcc.Link("Read about every fault", href="/faults"),
                        ],
                        className="help-start",
                    ),
                ],
                className="panel help-head",
            ),
            html.Section(
                [html.H2("Glossary", className="panel-title"), *_words()],
                className="panel",
                **attributes(aria_label="Glossary"),
            ),
            html.Section(
                [html.H2("Keys", className="panel-title"), *_keys()],
                className="panel",
                **attributes(aria_label="Keys"),
            ),
        ],
        className="help-page",
    )


def _words() -> list[Any]:
    groups = groupby(glossary().values(), key=lambda entry: entry.group)
    return [
        part
        for group, entries in groups
        for part in (
            html.H3(group, className="help-group"),
            html.Dl([_word(entry) for entry in entries], className="words"),
        )
    ]


def _word(entry: Term) -> html.Div:
    long = html.Span(f" {entry.long}", className="note") if entry.long else None
    return html.Div([html.Dt([entry.name, long]), html.Dd(entry.text)], id=f"word-{entry.id}")


def _keys() -> list[Any]:
    return [
        part
        for page, keys in KEYS
        for part in (
            html.H3(page, className="help-group"),
            html.Dl(
                [html.Div([html.Dt(dmc.Kbd(key, size="xs")), html.Dd(what)]) for key, what in keys],
                className="keys",
            ),
        )
    ]

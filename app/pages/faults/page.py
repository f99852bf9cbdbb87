"""The page *Faults*: the FMEA catalogue as a matrix of signatures, with a search."""

from collections.abc import Sequence
from itertools import groupby
from typing import Any

import dash_mantine_components as dmc
from dash import dcc, html

from app.figures.signature import COLUMNS, cells, head
from app.kit.addresses import fault_path, fly_path
from app.kit.attributes import attributes
from app.kit.terms import term
from app.kit.words import mode_name
from core.fmea.catalogue import Mode, catalogue
from core.knowledge.knowledge import knowledge
from core.knowledge.search import Hit

QUERY_ID, LIST_ID, HITS_ID = "fault-query", "fault-list", "fault-hits"

FIELD_WORDS = {
    "summary": "In short",
    "mechanism": "Mechanism",
    "ata": "ATA",
    "records": "Records",
    "chain": "Chain",
    "look-alike": "Look-alike",
    "action": "Action",
}


def catalogue_layout() -> html.Div:
    """All modes as one matrix of signatures, with a search over all knowledge about them."""
    return html.Div(
        [
            html.Div(
                [
                    html.Div(
                        [
                            html.H1("Faults"),
                            html.P(
                                "The failure modes of the FMEA catalogue and the direction in "
                                "which each moves the gauges, in steady cruise, on its usual "
                                "cylinder.",
                                className="note",
                            ),
                        ]
                    ),
                    dmc.TextInput(
                        id=QUERY_ID,
                        label="Search symptoms, mechanisms and actions",
                        placeholder="e.g. oil on the windscreen",
                        debounce=250,
                        size="sm",
                        className="fault-search",
                        inputProps={"maxLength": 200, "type": "search"},
                    ),
                ],
                className="page-head",
            ),
            html.Div(id=HITS_ID, role="status"),
            html.Div(matrix(list(knowledge())), id=LIST_ID),
            _key(),
        ],
        className="panel library-page",
    )


def matrix(modes: Sequence[str]) -> html.Table:
    """The modes named, grouped by subsystem in catalogue order, a row each."""
    entries = catalogue()
    wanted = [entries[mode] for mode in entries if mode in modes]
    bodies = [
        _group(subsystem, list(group))
        for subsystem, group in groupby(wanted, key=lambda mode: mode.subsystem)
    ]
    heads = [html.Th(head(name), className="sig-head", scope="col") for name in COLUMNS]
    columns = html.Tr(
        [
            html.Th("Failure mode", scope="col"),
            *heads,
            html.Th(
                term("rpn"),
                scope="col",
                className="number",
            ),
            html.Th("", scope="col"),
        ]
    )
    return html.Table([html.Thead(columns), *bodies], className="matrix")


def hit_list(query: str, hits: Sequence[Hit]) -> html.Div | None:
    """What a search found: the passages, best first, each leading to its mode."""
    if not query.strip():
        return None
    if not hits:
        return html.Div(
            [
                html.P([f"No match for “{query.strip()[:80]}”."]),
                html.P(
                    "Try what a pilot would notice: hot cylinder, rough idle, oil on the belly.",
                    className="note",
                ),
            ],
            className="hits-none",
        )
    return html.Div(
        html.Ol(
            [
                html.Li(
                    [
                        dcc.Link(mode_name(hit.mode), href=fault_path(hit.mode)),
                        html.Span(FIELD_WORDS.get(hit.field, hit.field), className="tag"),
                        html.Span(hit.text, className="hit-text"),
                    ]
                )
                for hit in hits
            ],
            className="hits",
        )
    )


def _group(subsystem: str, modes: Sequence[Mode]) -> html.Tbody:
    title = "Healthy" if subsystem == "nominal" else subsystem.capitalize()
    span: dict[str, Any] = {"colSpan": len(COLUMNS) + 3}
    return html.Tbody(
        [
            html.Tr(html.Th(title, scope="rowgroup", className="group", **span)),
            *(_row(mode) for mode in modes),
        ]
    )


def _row(mode: Mode) -> html.Tr:
    written = knowledge()[mode.id]
    return html.Tr(
        [
            html.Th(
                [
                    dcc.Link(mode.name, href=fault_path(mode.id)),
                    html.Span(written.summary, className="note row-summary"),
                ],
                scope="row",
            ),
            *cells(written),
            html.Td("" if mode.id == "nominal" else str(mode.rpn), className="number"),
            html.Td(
                dcc.Link(
                    "Fly", href=fly_path(mode.id), className="row-action",
                    title=f"Open Fly with {mode.name.lower()} filled in",
                )
            ),
        ]
    )  # fmt: skip


def _key() -> html.P:
    return html.P(
        [
            html.Span("↑", className="sig sig-3", **attributes(data_sign="+")), " rises   ",
            html.Span("↓", className="sig sig-3", **attributes(data_sign="-")), " falls   ",
            html.Span("~", className="sig sig-2", **attributes(data_sign="~")),
            " may move or oscillates   empty: holds. "
            "The darker the tint, the larger the shift at full severity, relative to the gauge's "
            "normal variation.",
        ],
        className="note matrix-key",
    )  # fmt: skip

"""A report as components of the page: every sentence with its verdict and what it cites.

``assets/web/report.js`` listens to the sentences that cite channels or a time: a click, or Enter,
moves the cursor of the tiles there and lights the channels.
"""

from collections.abc import Sequence
from itertools import groupby
from typing import Any

from dash import html

from app.kit.attributes import attributes
from app.kit.glossary import glossary
from core.channels import CHANNEL_INDEX
from core.report.blocks import Block, Item, Listing, Paragraph, Table, blocks
from core.report.check.metrics import CHECKED, HOW_CHECKED, MEASURES, PAPER
from core.report.grounded import GroundedReport, GroundedSentence, Origin
from core.report.sections import SECTION_TITLES
from core.report.statement import Run
from core.report.template.cross_check import TABLE_HEAD

MARKS: dict[str, tuple[str, str, str]] = {
    "supported": ("✓", "supported", "Agrees with the evidence and the FMEA knowledge"),
    "unsupported": (
        "?",
        "unsupported, struck",
        "Supported by neither evidence nor FMEA knowledge",
    ),
    "contradicted": (
        "✗",
        "contradicted, struck",
        "Contradicted by evidence or FMEA knowledge",
    ),
}
"""The mark after a sentence, how it is read out, and its help; none if it claims nothing."""

_STYLES = {"strong": html.Strong, "em": html.Em, "code": html.Code}


def report_text(
    sentences: Sequence[GroundedSentence], *, is_trusted: bool, draft: tuple[str, str] = ("", "")
) -> list[Any]:
    """The sections of a report, so far as there are any; ``is_trusted``: all of it the template's.

    ``draft``: a section's title and the text of it that is not checked yet.
    """
    parts: list[Any] = []
    section, text = draft
    for title in SECTION_TITLES:
        own = [item for item in sentences if item.checked.section == title]
        provisional = text.strip() if title == section else ""
        if not own and not provisional:
            continue
        parts.append(html.H2(title))
        parts += _written(own, is_trusted)
        if provisional:
            parts.append(html.P(provisional, className="draft"))
    _reach_first(parts)
    return parts


def answer_text(
    sentences: Sequence[GroundedSentence], *, is_trusted: bool, draft: str = ""
) -> list[Any]:
    """An answer to a question, as `report_text` shows a section."""
    parts = _written(sentences, is_trusted)
    if draft.strip():
        parts.append(html.P(draft.strip(), className="draft"))
    _reach_first(parts)
    return parts


def how_checked(report: GroundedReport) -> html.Details:
    """The measures of the shown report, folded away; of a model's also those of its raw text.

    It stands at the foot: figures near 1 at the head would read as seals on the diagnosis.
    """
    items = []
    for key, (name, best) in MEASURES.items():
        said = [html.Span(f"{getattr(report.final, key):.2f}", className="mono")]
        if not report.is_trusted:
            raw = f"raw {getattr(report.raw, key):.2f}"
            said.insert(0, html.Span(raw, className="note mono"))
        paper = getattr(PAPER["template" if report.is_trusted else "with_fmea"], key)
        title = f"{glossary()[key].text} The paper's mean: {paper:.3f}."
        items.append(html.Div([html.Dt(f"{name}, {best}"), html.Dd(said)], title=title))
    measured = html.Dl(items, className="measures", **attributes(aria_label="Measures"))
    return html.Details(
        [html.Summary(CHECKED), html.P(HOW_CHECKED, className="note"), measured],
        className="how-checked",
    )


def _written(sentences: Sequence[GroundedSentence], is_trusted: bool) -> list[Any]:
    """Sentences in their paragraphs, lists and tables; what the template added is framed."""
    if is_trusted:
        return list(map(_block, blocks(sentences)))
    parts: list[Any] = []
    for origin, group in groupby(sentences, key=_origin):
        shown = list(map(_block, blocks(list(group))))
        if origin == "template":
            note = html.P("Added by the template", className="note")
            shown = [html.Div([note, *shown], className="added")]
        parts += shown
    return parts


def _origin(item: GroundedSentence) -> Origin:
    return item.origin


def _block(block: Block) -> Any:
    match block:
        case Paragraph():
            return html.P(_joined(block.sentences))
        case Listing():
            items = [
                html.Li([*_joined(item.sentences), *map(_block, item.below)], value=_number(item))
                for item in block.items
            ]
            return html.Ol(items) if block.is_numbered else html.Ul(items)
        case Table():
            return _table(block)


def _number(item: Item) -> str | None:
    return None if item.number is None else str(item.number)


def _table(table: Table) -> html.Table:
    head = html.Tr([html.Th(cell) for cell in TABLE_HEAD])
    body = []
    for item in table.rows:
        *cells, last = item.checked.cells
        ends = html.Td([last, *_mark(item)])
        body.append(html.Tr([*([html.Td([cell]) for cell in cells]), ends], **_behaviour(item)))
    return html.Table([html.Thead(head), html.Tbody(body)])


def _joined(sentences: Sequence[GroundedSentence]) -> list[Any]:
    parts: list[Any] = []
    for item in sentences:
        parts += [_sentence(item), " "]
    return parts


def _sentence(item: GroundedSentence) -> html.Span:
    text = _styled(item.checked.runs)
    if item.kept:
        return html.Span([*text, *_mark(item)], **_behaviour(item))
    why = html.Span(f" {'; '.join(item.checked.reasons)}", className="why")
    return html.Span([html.Del(text), *_mark(item), why], **_behaviour(item))


def _mark(item: GroundedSentence) -> list[Any]:
    if item.checked.verdict not in MARKS:
        return []
    sign, words, help_text = MARKS[item.checked.verdict]
    return [
        html.Span(sign, className="mark", title=help_text, **attributes(aria_hidden="true")),
        html.Span(f" ({words})", className="read-out"),
    ]


def _behaviour(item: GroundedSentence) -> dict[str, Any]:
    """Attributes of a sentence: how it looks, what it says on hovering, what a click shows."""
    said = item.checked
    shared = {
        "className": "claim",
        "title": "; ".join(said.reasons) or None,
        **attributes(data_verdict=said.verdict),
    }
    if not said.channels and said.start_s is None:
        return shared
    tiles = " ".join(str(CHANNEL_INDEX[name]) for name in said.channels if name in CHANNEL_INDEX)
    start = "" if said.start_s is None else f"{said.start_s:.2f}"
    return shared | {
        "role": "button",
        "tabIndex": -1,
        **attributes(data_tiles=tiles, data_start_s=start),
    }


def _reach_first(parts: Any) -> bool:
    """Let Tab reach the first sentence that can be clicked; arrow keys move from there."""
    if isinstance(parts, list):
        return any(_reach_first(part) for part in parts)
    if getattr(parts, "role", None) == "button":
        parts.tabIndex = 0
        return True
    return hasattr(parts, "children") and _reach_first(_as_list(parts.children))


def _as_list(children: Any) -> list[Any]:
    return children if isinstance(children, list) else [children]


def _styled(runs: Sequence[Run]) -> list[Any]:
    """Text by its styles; HTML stays text."""
    return [_STYLES[run.style](run.text) if run.style in _STYLES else run.text for run in runs]

"""A checked report as it stands on the page: every sentence with its verdict and what it cites.

``assets/report.js`` listens to the sentences that cite channels or a time: a click, or Enter, moves
the cursor of the tiles there and lights the channels.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

from dash import html
from markdown_it import MarkdownIt

from app.kit.attributes import attributes
from app.kit.glossary import glossary
from core.channels import CHANNEL_INDEX
from core.report.check.metrics import CHECKED, HOW_CHECKED, MEASURES, PAPER, Metrics
from core.report.grounded import TABLE_HEADER, GroundedSentence, Origin
from core.report.report import SECTION_TITLES
from core.report.template.template import WRITER

MARKS: dict[str, tuple[str, str, str]] = {
    "supported": ("✓", "supported", "Agrees with the evidence and the FMEA knowledge"),
    "unsupported": ("?", "unsupported, struck", "Nothing in evidence or FMEA knowledge says so"),
    "contradicted": ("✗", "contradicted, struck", "Evidence or FMEA knowledge speaks against it"),
}
"""What stands behind a sentence, how it is read out, and its help; nothing if it claims nothing."""

_CELL = re.compile(r"(?<!\\)\|")
_INLINE = MarkdownIt("zero").enable(["emphasis", "escape", "backticks"])


@dataclass(slots=True)
class _Line:
    """The sentences of one paragraph, list item or table row."""

    sentences: list[GroundedSentence] = field(default_factory=list)

    @property
    def kind(self) -> str:
        return self.sentences[0].checked.kind

    @property
    def indent(self) -> int:
        return self.sentences[0].checked.indent

    @property
    def marker(self) -> str:
        return self.sentences[0].checked.marker


def report_text(
    sentences: Sequence[GroundedSentence], *, by: str, draft: tuple[str, str] = ("", "")
) -> list[Any]:
    """The sections of a report that ``by`` wrote, so far as there are any.

    ``draft``: a section and the text of it that has come and is not checked yet.
    """
    parts: list[Any] = []
    section, text = draft
    for title in SECTION_TITLES:
        own = [item for item in sentences if item.checked.section == title]
        provisional = text.strip() if title == section else ""
        if not own and not provisional:
            continue
        parts.append(html.H2(title))
        parts += _written(own, by)
        if provisional:
            parts.append(html.P(provisional, className="draft"))
    _reach_first(parts)
    return parts


def answer_text(sentences: Sequence[GroundedSentence], *, by: str, draft: str = "") -> list[Any]:
    """An answer to a question, as `report_text` shows a section."""
    parts = _written(sentences, by)
    if draft.strip():
        parts.append(html.P(draft.strip(), className="draft"))
    _reach_first(parts)
    return parts


def how_checked(raw: Metrics, final: Metrics, *, by: str) -> html.Details:
    """What the check of the shown report comes to, folded away; of a model's also its raw text's.

    It stands at the foot: figures near 1 at the head would read as seals on the diagnosis.
    """
    items = []
    for key, (name, best) in MEASURES.items():
        said = [html.Span(f"{getattr(final, key):.2f}", className="mono")]
        if by != WRITER:
            said.insert(0, html.Span(f"raw {getattr(raw, key):.2f}", className="note mono"))
        paper = getattr(PAPER[WRITER if by == WRITER else "with_fmea"], key)
        title = f"{glossary()[key].text} The paper's mean: {paper:.3f}."
        items.append(html.Div([html.Dt(f"{name}, {best}"), html.Dd(said)], title=title))
    measured = html.Dl(items, className="measures", **attributes(aria_label="Measures"))
    return html.Details(
        [html.Summary(CHECKED), html.P(HOW_CHECKED, className="note"), measured],
        className="how-checked",
    )


def _written(sentences: Sequence[GroundedSentence], by: str) -> list[Any]:
    """Sentences in their paragraphs, lists and tables; what the template added is framed."""
    if by == WRITER:
        return _blocks(list(_lines(sentences)))
    parts: list[Any] = []
    for origin, group in groupby(sentences, key=_origin):
        blocks = _blocks(list(_lines(list(group))))
        if origin == "template":
            blocks = [html.Div([html.P("Added by the template", className="note"), *blocks],
                               className="added")]  # fmt: skip
        parts += blocks
    return parts


def _origin(item: GroundedSentence) -> Origin:
    return item.origin


def _lines(sentences: Sequence[GroundedSentence]) -> Iterator[_Line]:
    line = _Line()
    for item in sentences:
        if line.sentences and (item.checked.first or item.checked.kind == "row"):
            yield line
            line = _Line()
        line.sentences.append(item)
    if line.sentences:
        yield line


def _blocks(lines: Sequence[_Line]) -> list[Any]:
    parts: list[Any] = []
    for kind, group in groupby(lines, key=lambda line: line.kind):
        own = list(group)
        if kind == "item":
            parts += _lists(own)
        elif kind == "row" and all(item.kept for line in own for item in line.sentences):
            parts.append(_table(own))
        else:
            parts += [html.P(_joined(line.sentences)) for line in own]
    return parts


def _lists(lines: Sequence[_Line]) -> list[Any]:
    """Items as lists, what is indented deeper inside the item before it."""
    parts: list[Any] = []
    start = 0
    while start < len(lines):
        head = lines[start]
        end = start + 1
        while end < len(lines) and lines[end].indent > head.indent:
            end += 1
        inner = _lists(lines[start + 1 : end])
        numbered = head.marker[:1].isdigit()
        item = html.Li(
            [*_joined(head.sentences), *inner], value=head.marker[:-1] if numbered else None
        )
        kind = html.Ol if numbered else html.Ul
        if parts and isinstance(parts[-1], kind):
            parts[-1].children.append(item)
        else:
            parts.append(kind([item]))
        start = end
    return parts


def _table(lines: Sequence[_Line]) -> html.Table:
    rows = [item for line in lines for item in line.sentences if item.checked.text != TABLE_HEADER]
    head = html.Tr([html.Th(cell) for cell in _cells(TABLE_HEADER)])
    body = []
    for item in rows:
        *cells, last = (html.Td(_inline(cell)) for cell in _cells(item.checked.text))
        last.children = [*last.children, *_mark(item)]
        body.append(html.Tr([*cells, last], **_behaviour(item)))
    return html.Table([html.Thead(head), html.Tbody(body)])


def _cells(row: str) -> list[str]:
    return [cell.strip() for cell in _CELL.split(row.strip().strip("|"))]


def _joined(sentences: Sequence[GroundedSentence]) -> list[Any]:
    parts: list[Any] = []
    for item in sentences:
        parts += [_sentence(item), " "]
    return parts


def _sentence(item: GroundedSentence) -> html.Span:
    text = _inline(item.checked.text)
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
    """Let Tab reach the first sentence that can be clicked; the arrow keys go on from there."""
    if isinstance(parts, list):
        return any(_reach_first(part) for part in parts)
    if getattr(parts, "role", None) == "button":
        parts.tabIndex = 0
        return True
    return hasattr(parts, "children") and _reach_first(_as_list(parts.children))


def _as_list(children: Any) -> list[Any]:
    return children if isinstance(children, list) else [children]


def _inline(markdown: str) -> list[Any]:
    """Markdown within a line as components. Nothing but emphasis and code; HTML stays text."""
    stack: list[list[Any]] = [[]]
    for token in _INLINE.parseInline(markdown)[0].children or ():
        if token.nesting == 1:
            stack.append([])
        elif token.nesting == -1:
            inner = stack.pop()
            stack[-1].append(html.Strong(inner) if token.tag == "strong" else html.Em(inner))
        elif token.type == "code_inline":
            stack[-1].append(html.Code(token.content))
        elif token.content:
            stack[-1].append(token.content)
    return stack[0]

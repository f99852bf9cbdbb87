"""Statements: what a report says, a sentence or a table row each, with the facts it is made from.

The template makes them once. Markdown, HTML, PDF, JSON and the page are renderings of them, and
what a report lacks is found by their facts, never by their wording.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from markdown_it import MarkdownIt

from core.report.case.wording import escaped
from core.report.sentences import LineKind, split

StatementKind = Literal[
    "verdict", "confidence", "doubt", "candidate", "onset", "intervention", "rating", "classifier",
    "mechanism", "step", "introduction", "evidence", "absence", "rival", "caution", "action",
    "answer", "text",
]  # fmt: skip
"""What a statement is; ``text`` is a language model's sentence, of which only the text is there."""

Basis = Literal["sensor", "verdict", "knowledge", "flight"]
"""What makes a statement true: evidence, diagnosis, knowledge base, what was done in flight."""

Style = Literal["plain", "strong", "em", "code"]

_INLINE = MarkdownIt("zero").enable(["emphasis", "escape", "backticks"])
_MARKS: dict[Style, str] = {"plain": "", "strong": "**", "em": "*", "code": "`"}


@dataclass(frozen=True, slots=True)
class Run:
    """A stretch of text in one style."""

    text: str
    style: Style = "plain"


@dataclass(frozen=True, slots=True)
class Statement:
    """One sentence or table row: what it says, where it stands, and what it is about.

    ``runs``: its text; ``cells``: that of a table row, which has no runs. ``line``, ``marker`` (of
    a list item), ``indent`` and ``first`` (of its line): where it stands. ``rests_on``: what makes
    it true; empty where it claims nothing. ``channels``, ``mode``: what it speaks of. ``step``: the
    causal step or the action, counted from 1. ``concludes``: whether it states the verdict.
    """

    kind: StatementKind
    runs: tuple[Run, ...] = ()
    cells: tuple[str, ...] = ()
    line: LineKind = "paragraph"
    marker: str = ""
    indent: int = 0
    first: bool = True
    rests_on: tuple[Basis, ...] = ()
    channels: tuple[str, ...] = ()
    mode: str = ""
    step: int = 0
    concludes: bool = False

    @property
    def text(self) -> str:
        """The text without any markup."""
        return " ".join(self.cells) if self.cells else "".join(run.text for run in self.runs)

    @property
    def markdown(self) -> str:
        """The text in Markdown, in which nothing but the styles acts as markup."""
        if self.cells:
            return f"| {' | '.join(map(escaped, self.cells))} |"
        return "".join(_as_markdown(run) for run in self.runs)


def say(kind: StatementKind, text: str, *, strong: str = "", **facts: Any) -> Statement:
    """One sentence; ``strong`` are words in bold that come before ``text``."""
    runs: tuple[Run, ...] = (Run(strong, "strong"),) if strong else ()
    if text:
        runs += (Run(f" {text}" if strong else text),)
    return Statement(kind, runs, **facts)


def prose(kind: StatementKind, text: str, **facts: Any) -> Iterator[Statement]:
    """Each sentence of a text."""
    for sentence in split(text):
        yield say(kind, sentence, **facts)


def paragraph(*statements: Statement) -> tuple[Statement, ...]:
    """Statements as one paragraph."""
    return _line(statements)


def item(marker: str, *statements: Statement, indent: int = 0) -> tuple[Statement, ...]:
    """Statements as one item of a list, with its ``marker`` (``-`` or ``1.``)."""
    return _line(statements, line="item", marker=marker, indent=indent)


def row(kind: StatementKind, cells: Sequence[str], **facts: Any) -> Statement:
    """One row of the table."""
    return Statement(kind, cells=tuple(cells), line="row", **facts)


def lines(statements: Sequence[Statement]) -> list[tuple[Statement, ...]]:
    """The statements of each paragraph, list item and table row."""
    found: list[tuple[Statement, ...]] = []
    for statement in statements:
        if statement.first or not found:
            found.append((statement,))
        else:
            found[-1] += (statement,)
    return found


def inline(markdown: str) -> tuple[Run, ...]:
    """The runs of a language model's sentence: emphasis and code count, all else is text."""
    found: list[Run] = []
    styles: list[Style] = ["plain"]
    for token in _INLINE.parseInline(markdown)[0].children or ():
        if token.nesting == 1:
            styles.append("strong" if token.tag == "strong" else "em")
        elif token.nesting == -1:
            styles.pop()
        elif token.content:
            style = "code" if token.type == "code_inline" else styles[-1]
            if found and found[-1].style == style:
                found[-1] = Run(found[-1].text + token.content, style)
            else:
                found.append(Run(token.content, style))
    return tuple(found)


def _as_markdown(run: Run) -> str:
    mark = _MARKS[run.style]
    return f"{mark}{run.text if run.style == 'code' else escaped(run.text)}{mark}"


def _line(statements: Sequence[Statement], **layout: Any) -> tuple[Statement, ...]:
    return tuple(
        replace(statement, first=index == 0, **layout) for index, statement in enumerate(statements)
    )

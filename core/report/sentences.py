"""Sentences: text cut into the units that are checked one by one, whole or while it streams.

The unit is what a reader would accept or strike as a whole: a sentence of a paragraph or list item,
or a row of a table.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

LineKind = Literal["heading", "paragraph", "item", "row"]

MAX_LINE_CHARS = 4000
"""The longest line of a report; a longer one, which only a faulty endpoint sends, is cut."""

_HEADING = re.compile(r"^#{1,6}\s+(.*?)\s*#*$")
_ITEM = re.compile(r"^(?P<indent>\s*)(?P<marker>[-*+•]|\d{1,2}[.)])\s+(?P<text>.*)$")
_RULE = re.compile(r"^\s*\|?[\s:|-]*-{2,}[\s:|-]*$")
_EMPHASIS = re.compile(r"\*\*|__|(?<!\w)[*_](?=\S)|(?<=\S)[*_](?!\w)|`")
_ESCAPE = re.compile(r"\\([\\`*_{}\[\]<>#|~])")
_ABBREVIATIONS = ("No", "e.g", "i.e", "approx", "vs", "Fig", "St", "Dr", "etc", "cyl", "Cyl", "min")
_END = re.compile(r"[.!?][\"')\]*_]*(?=\s+(?:\(|[\"'\[*_]*[A-Z0-9]))")


@dataclass(frozen=True, slots=True)
class Sentence:
    """One sentence as written (``text``, Markdown) and where it stands.

    ``first`` marks the first of its line; ``marker`` is the line's list marker ("" outside lists).
    """

    text: str
    kind: LineKind
    marker: str
    indent: int
    first: bool

    @property
    def plain(self) -> str:
        """The text without emphasis and escapes, in single spaces."""
        return plain_text(self.text)


def plain_text(markdown: str) -> str:
    """Markdown without emphasis, code marks and escapes, in single spaces."""
    bare = _EMPHASIS.sub("", markdown)
    return " ".join(_ESCAPE.sub(r"\1", bare).split())


def sentences(markdown: str) -> list[Sentence]:
    """All sentences of a Markdown text, headings and table rows included, in order."""
    splitter = SentenceSplitter()
    return [*splitter.push(markdown), *splitter.finish()]


@dataclass(slots=True)
class SentenceSplitter:
    """Takes text in pieces of any size and gives each sentence as soon as it is complete.

    A sentence is complete once the next one begins or its line ends, so that cutting the text
    elsewhere gives the same sentences.
    """

    _line: str = ""
    _given: int = field(default=0)

    def push(self, piece: str) -> list[Sentence]:
        """Take the next piece; returns the sentences that it completes."""
        done: list[Sentence] = []
        while piece:
            head, newline, piece = piece.partition("\n")
            self._line += head
            if newline or len(self._line) > MAX_LINE_CHARS:
                done += self._complete(last=True)
                self._line, self._given = "", 0
        return done + self._complete(last=False)

    def finish(self) -> list[Sentence]:
        """The sentences of the last, unfinished line."""
        done = self._complete(last=True)
        self._line, self._given = "", 0
        return done

    def _complete(self, *, last: bool) -> list[Sentence]:
        found = list(_of_line(self._line[:MAX_LINE_CHARS]))
        ready = found if last else found[:-1]
        if not last and ready and ready[0].kind == "row":
            ready = []
        fresh = ready[self._given :]
        self._given = max(self._given, len(ready))
        return fresh


def _of_line(line: str) -> Iterator[Sentence]:
    """The sentences of one line of Markdown."""
    text = line.strip()
    if not text or _RULE.match(text):
        return
    if heading := _HEADING.match(text):
        yield Sentence(heading[1], "heading", "", 0, first=True)
        return
    if text.startswith("|"):
        yield Sentence(text, "row", "", 0, first=True)
        return
    kind: LineKind = "paragraph"
    marker, indent = "", 0
    if item := _ITEM.match(line.rstrip()):
        kind, marker, indent, text = "item", item["marker"], len(item["indent"]), item["text"]
    for index, part in enumerate(split(text)):
        yield Sentence(part, kind, marker, indent, first=index == 0)


def split(text: str) -> Iterator[str]:
    """The sentences of a text without line breaks."""
    start = 0
    for end in _END.finditer(text):
        before = text[start : end.start()]
        word = before.rsplit(" ", 1)[-1].lstrip("(*_\"'")
        if text[end.start()] == "." and (
            word in _ABBREVIATIONS or re.fullmatch(r"\d{1,2}", before)
        ):
            continue
        yield text[start : end.end()].strip()
        start = end.end()
    if rest := text[start:].strip():
        yield rest

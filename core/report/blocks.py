"""Blocks: the sentences of a report in paragraphs, lists and tables, for whatever shows it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from core.report.grounded import GroundedSentence

Sentences = tuple[GroundedSentence, ...]


@dataclass(frozen=True, slots=True)
class Paragraph:
    """Sentences that follow each other."""

    sentences: Sentences


@dataclass(frozen=True, slots=True)
class Item:
    """One item of a list, with the lists below it. ``number``: None in a list with bullets."""

    sentences: Sentences
    number: int | None
    below: "tuple[Listing, ...]"


@dataclass(slots=True)
class Listing:
    """A list, numbered or with bullets."""

    is_numbered: bool
    items: list[Item] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of evidence."""

    rows: Sentences


Block = Paragraph | Listing | Table


def blocks(sentences: Sequence[GroundedSentence]) -> list[Block]:
    """The blocks that these sentences make, in order. Struck rows are paragraphs."""
    found: list[Block] = []
    for shape, group in groupby(_lines(sentences), key=_shape):
        lines = list(group)
        if shape == "item":
            found += _listings(lines)
        elif shape == "row":
            found.append(Table(tuple(row for line in lines for row in line)))
        else:
            found += map(Paragraph, lines)
    return found


def _lines(sentences: Sequence[GroundedSentence]) -> Iterator[Sentences]:
    line: Sentences = ()
    for item in sentences:
        if line and (item.checked.first or item.checked.kind != line[0].checked.kind):
            yield line
            line = ()
        line += (item,)
    if line:
        yield line


def _shape(line: Sentences) -> str:
    kind = line[0].checked.kind
    return "paragraph" if kind == "row" and not line[0].checked.cells else kind


def _listings(lines: Sequence[Sentences]) -> list[Listing]:
    """Lists of these items; items that are indented farther lie below the one before."""
    found: list[Listing] = []
    start = 0
    while start < len(lines):
        head = lines[start][0].checked
        end = start + 1
        while end < len(lines) and lines[end][0].checked.indent > head.indent:
            end += 1
        digits = head.marker.rstrip(".)")
        number = int(digits) if digits.isdecimal() else None
        if not found or found[-1].is_numbered != (number is not None):
            found.append(Listing(number is not None))
        below = tuple(_listings(lines[start + 1 : end]))
        found[-1].items.append(Item(lines[start], number, below))
        start = end
    return found

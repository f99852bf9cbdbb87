"""A sentence as read in the context of its case, and the result of one check of it."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

from core.knowledge.lexicon import is_covered, lexicon, stems, terms
from core.report.case.case import Candidate, Case
from core.report.check.known import KnownSentence, known_quantities, known_sentences
from core.report.check.mentions import (
    ChannelMention,
    CylinderMention,
    ModeMention,
    Quantity,
    TimeMention,
)
from core.report.sections import Section

Failure = Literal["contradicted", "unsupported"]
Kind = Literal["sensor", "verdict", "knowledge"]


@dataclass(frozen=True, slots=True)
class Checked:
    """One claim: whether it holds and why.

    ``kind``: about a sensor, about the verdict, or traced to the knowledge base.
    """

    holds: bool
    kind: Kind
    reason: str
    failure: Failure = "contradicted"
    channels: tuple[str, ...] = ()
    quote: KnownSentence | None = None
    concludes: bool = False

    @property
    def kind_of_failure(self) -> Failure | None:
        """How it fails, None where it holds."""
        return None if self.holds else self.failure


@dataclass(frozen=True, slots=True)
class Reading:
    """A sentence as read, with the case it belongs to. ``subject``: the mode that "it" means."""

    case: Case
    text: str
    section: Section
    kind: str
    subject: str
    channels: Sequence[ChannelMention]
    cylinders: Sequence[CylinderMention]
    modes: Sequence[ModeMention]
    quantities: Sequence[Quantity]
    times: Sequence[TimeMention]
    is_action: bool
    _words: list[frozenset[str]] = field(default_factory=list)

    @property
    def focus(self) -> list[Candidate]:
        """The modes that the sentence is about: those it names, its subject, the verdict."""
        case = self.case
        if self.section.quotable == "work order" or (self.is_action and not self.modes):
            return list(case.work_order)
        named = [item.mode for item in self.modes if item.mode in case.weighed]
        order = dict.fromkeys([*named, self.subject, *(c.mode.id for c in case.open_verdicts)])
        if self.section.quotable == "any" or lexicon().rival.search(self.text):
            order |= dict.fromkeys(case.weighed)
        return [case.weighed[mode] for mode in order]

    @property
    def stems(self) -> frozenset[str]:
        """The stems of all its words."""
        if not self._words:
            self._words.append(frozenset(stems(self.text)))
        return self._words[0]

    def covers(self, text: str) -> bool:
        """Whether the sentence states a sentence of the knowledge base in its own words."""
        telling = terms(text)
        return bool(telling) and is_covered(telling, self.stems)

    @property
    def measured(self) -> bool:
        """Whether its present tense speaks of this flight, not of engines at large."""
        return self.section.measured or self.kind == "row"

    def names(self, words: str) -> bool:
        """Whether the knowledge of the modes in question has these words."""
        return any(
            words.casefold() in item.text.casefold()
            for mode in self.focus
            for item in known_sentences(mode.mode.id)
        )


def is_known(item: Quantity, focus: Iterable[Candidate]) -> bool:
    """Whether the knowledge of one of these modes has this number in this unit."""
    return any(
        _same(item, other) and (item.unit == other.unit or not item.unit)
        for candidate in focus
        for other in known_quantities(candidate.mode.id)
    )


def _same(item: Quantity, other: Quantity) -> bool:
    """Whether a number is a known one, or one end of a known range ("between 0.95 and 0.85")."""
    if math.isclose(item.low, item.high):
        return any(math.isclose(item.low, end, abs_tol=1e-9) for end in (other.low, other.high))
    return math.isclose(item.low, other.low) and math.isclose(item.high, other.high)

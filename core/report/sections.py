"""The five sections of a report (paper section 5.2): the one table of what each of them is."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

from core.knowledge.knowledge import knowledge
from core.knowledge.lexicon import is_covered, terms
from core.report.case.case import Case
from core.report.statement import Statement, lines
from core.report.template.conclusion import conclusion
from core.report.template.cross_check import cross_check
from core.report.template.differential import differential
from core.report.template.maintenance import maintenance
from core.report.template.mechanism import mechanism

SectionId = Literal[
    "conclusion", "mechanism", "cross_check", "differential", "maintenance", "answer"
]

Line = tuple[Statement, ...]
"""The statements of one paragraph, list item or table row."""

Quotable = Literal["verdict", "work order", "any"]
"""Whose knowledge a section may quote: the verdict's, that of the modes acted on, any weighed."""


@dataclass(frozen=True, slots=True)
class Content:
    """What a section already has: its kept sentences by what they state.

    ``concludes``: the verdict; ``steps``: these causal steps; ``channels``: these are cited.
    ``text``: all of it in lower case; ``terms``: the stems of its words that say something.
    """

    concludes: bool
    steps: frozenset[int]
    channels: frozenset[str]
    text: str
    terms: frozenset[str]


@dataclass(frozen=True, slots=True)
class Section:
    """One section. ``write``: how the template writes it.

    ``lacks``: whether a section with such content lacks a line of the template's. ``measured``:
    whether its present tense speaks of this flight, not of engines at large. ``quotable``: whose
    knowledge it may quote.
    """

    id: SectionId
    title: str
    write: Callable[[Case], tuple[Statement, ...]]
    lacks: Callable[[Line, Content], bool]
    measured: bool
    quotable: Quotable


def _lacks_conclusion(line: Line, content: Content) -> bool:
    """The confidence always: it is what a reader acts on. All of it where the verdict is absent."""
    return not content.concludes or line[0].kind == "confidence"


def _lacks_step(line: Line, content: Content) -> bool:
    return line[0].kind == "step" and line[0].step not in content.steps


def _lacks_evidence(line: Line, content: Content) -> bool:
    """The evidence that is not cited, and always what is missing or rightly quiet."""
    row = line[0]
    return row.kind == "absence" or (
        row.kind == "evidence" and not content.channels.issuperset(row.channels)
    )


def _lacks_rival(line: Line, content: Content) -> bool:
    return knowledge()[line[0].mode].name.casefold() not in content.text


def _lacks_action(line: Line, content: Content) -> bool:
    """The actions that are absent, and always what is said around them."""
    telling = terms(" ".join(statement.text for statement in line))
    return line[0].kind != "action" or not is_covered(telling, content.terms)


SECTIONS: tuple[Section, ...] = (
    Section("conclusion", "Conclusion", conclusion, _lacks_conclusion, True, "verdict"),
    Section("mechanism", "Mechanism", mechanism, _lacks_step, False, "verdict"),
    Section("cross_check", "Evidence cross-check", cross_check, _lacks_evidence, True, "verdict"),
    Section("differential", "Differential diagnosis", differential, _lacks_rival, False, "any"),
    Section("maintenance", "Maintenance", maintenance, _lacks_action, False, "work order"),
)

ANSWER = Section("answer", "", lambda case: (), lambda line, content: False, False, "any")
"""An answer to a question: checked like a section, but part of no report."""

SECTION_TITLES: tuple[str, ...] = tuple(section.title for section in SECTIONS)


def supplement(case: Case, section: Section, content: Content) -> Iterable[Statement]:
    """The template's statements that a section with this content lacks."""
    for line in lines(section.write(case)):
        if section.lacks(line, content):
            yield from line

"""Writers of reports behind one interface: the template, and a language model at an endpoint."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

from core.report.answers import offline_answer
from core.report.case.case import Case
from core.report.sections import Section
from core.report.statement import Statement
from core.report.write.endpoint import Endpoint
from core.report.write.prompts import ANSWER_TOKENS, prompts

TEMPLATE = "template"
"""The name of the template as a writer."""


class Writer(Protocol):
    """Writes the sections of a report one after the other.

    ``name``: the name on the report. ``is_trusted``: whether its text is true by construction, so
    that nothing is checked or added. It gives statements, or text in pieces of any size, which is
    checked. A writer that cannot go on raises `core.report.write.endpoint.WriterError`.
    """

    @property
    def name(self) -> str:
        """The name on the report."""

    @property
    def is_trusted(self) -> bool:
        """Whether its text is true by construction."""

    def section(self, case: Case, section: Section) -> Iterator[Statement | str]:
        """One section, text in Markdown."""

    def answer(self, case: Case, question: str) -> Iterator[Statement | str]:
        """An answer to a question about the case."""


@dataclass(frozen=True, slots=True)
class TemplateWriter:
    """The offline writer: needs nothing, never fails."""

    name: str = TEMPLATE
    is_trusted: bool = True

    def section(self, case: Case, section: Section) -> Iterator[Statement]:
        """The statements of one section."""
        yield from section.write(case)

    def answer(self, case: Case, question: str) -> Iterator[Statement]:
        """An answer from the knowledge base."""
        yield from offline_answer(case, question)


@dataclass(frozen=True, slots=True)
class ModelWriter:
    """A language model. ``knowledge``: whether it is given the FMEA entries of the candidates."""

    endpoint: Endpoint
    knowledge: bool = True

    @property
    def name(self) -> str:
        """The name of the model."""
        return self.endpoint.model

    @property
    def is_trusted(self) -> bool:
        """Never."""
        return False

    def section(self, case: Case, section: Section) -> Iterator[str]:
        """The text of one section; raises `WriterError`."""
        messages = prompts().section(case, section, knowledge=self.knowledge)
        return self.endpoint.stream(messages, prompts().tasks[section.id][1])

    def answer(self, case: Case, question: str) -> Iterator[str]:
        """An answer; raises `WriterError`, and `InputError` for an invalid question."""
        messages = prompts().question(case, question, knowledge=self.knowledge)
        return self.endpoint.stream(messages, ANSWER_TOKENS)


def with_grammar(endpoint: Endpoint) -> Endpoint:
    """An endpoint of llama.cpp held to a grammar: sentences of bounded length, no headings."""
    return replace(
        endpoint, extra={**endpoint.extra, "grammar": prompts().grammar}, constrained=False
    )

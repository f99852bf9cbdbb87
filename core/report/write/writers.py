"""Who writes a report: the template, or a language model behind an endpoint. One interface."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Protocol

from core.report.case.case import Case
from core.report.report import SECTION_TITLES
from core.report.template.answers import offline_answer
from core.report.template.conclusion import conclusion
from core.report.template.cross_check import cross_check
from core.report.template.differential import differential
from core.report.template.template import WRITER, maintenance, mechanism
from core.report.write.endpoint import Endpoint
from core.report.write.prompts import ANSWER_TOKENS, prompts


class Writer(Protocol):
    """Writes the sections of a report one after the other.

    ``name`` says who on the report. Texts come in pieces of any size; a writer that cannot go on
    raises `core.report.write.endpoint.WriterError`.
    """

    @property
    def name(self) -> str:
        """Who writes."""

    def section(self, case: Case, title: str) -> Iterator[str]:
        """The text of one section, in Markdown."""

    def answer(self, case: Case, question: str) -> Iterator[str]:
        """An answer to a question about the case."""


_SECTIONS: dict[str, Callable[[Case], str]] = dict(
    zip(
        SECTION_TITLES,
        (conclusion, mechanism, cross_check, differential, maintenance),
        strict=True,
    )
)


def template_section(case: Case, title: str) -> str:
    """A section as the template writes it."""
    return _SECTIONS[title](case)


@dataclass(frozen=True, slots=True)
class TemplateWriter:
    """The offline writer: needs nothing, never fails."""

    name: str = WRITER

    def section(self, case: Case, title: str) -> Iterator[str]:
        """The text of one section."""
        yield template_section(case, title)

    def answer(self, case: Case, question: str) -> Iterator[str]:
        """An answer from the knowledge base."""
        yield offline_answer(case, question)


@dataclass(frozen=True, slots=True)
class ModelWriter:
    """A language model. ``knowledge``: whether it is given the FMEA entries of the candidates."""

    endpoint: Endpoint
    knowledge: bool = True

    @property
    def name(self) -> str:
        """The name of the model."""
        return self.endpoint.model

    def section(self, case: Case, title: str) -> Iterator[str]:
        """The text of one section; raises `WriterError`."""
        messages = prompts().section(case, title, knowledge=self.knowledge)
        return self.endpoint.stream(messages, prompts().tasks[title][1])

    def answer(self, case: Case, question: str) -> Iterator[str]:
        """An answer; raises `WriterError`, and `InputError` for a question that is none."""
        messages = prompts().question(case, question, knowledge=self.knowledge)
        return self.endpoint.stream(messages, ANSWER_TOKENS)


def with_grammar(endpoint: Endpoint) -> Endpoint:
    """An endpoint of llama.cpp held to a grammar: sentences of bounded length, no headings."""
    return replace(
        endpoint, extra={**endpoint.extra, "grammar": prompts().grammar}, constrained=False
    )

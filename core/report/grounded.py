"""A report in which every sentence is true by construction or checked, whoever wrote it.

The template makes statements out of facts. A language model's text is checked sentence by sentence
as it streams: what is contradicted or unsupported is struck, visibly, and what the report then
lacks (the verdict, causal steps, evidence, rivals, actions) the template adds, marked as such.
However the model fails, the result is a complete report, with a note of what happened.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from core.knowledge.lexicon import terms
from core.report.case.case import Case
from core.report.check.checker import CheckedSentence, Checker
from core.report.check.known import normal
from core.report.check.metrics import Metrics, measure
from core.report.check.vouched import vouched
from core.report.sections import SECTIONS, Content, Section, supplement
from core.report.sentences import Sentence, SentenceSplitter
from core.report.statement import Statement
from core.report.stored import upgraded
from core.report.template.cross_check import TABLE_HEAD
from core.report.write.endpoint import WriterError
from core.report.write.writers import TEMPLATE, TemplateWriter, Writer

MAX_FAILURES = 2
"""After this many failed sections a model is not asked again."""

MAX_SENTENCES = 60
"""The most sentences of one section that are taken from a model."""

MAX_REPEATS = 2
"""A model that has repeated itself this often in one section is stopped: it is stuck."""

Origin = Literal["writer", "template"]


@dataclass(frozen=True, slots=True)
class GroundedSentence:
    """A checked sentence of the report; ``kept`` is False where it is shown struck."""

    checked: CheckedSentence
    origin: Origin
    kept: bool

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return {"checked": self.checked.to_dict(), "origin": self.origin, "kept": self.kept}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "GroundedSentence":
        """Read what `to_dict` wrote."""
        checked = CheckedSentence.from_dict(values["checked"])
        return cls(checked, values["origin"], values["kept"])


@dataclass(frozen=True, slots=True)
class GroundedReport:
    """A complete report. ``raw``: measures of what the writer wrote; ``final``: of what was kept.

    ``notes``: what happened on the way, in sentences for the reader; empty without incident.
    """

    writer: str
    sentences: tuple[GroundedSentence, ...]
    notes: tuple[str, ...]
    raw: Metrics
    final: Metrics

    @property
    def is_trusted(self) -> bool:
        """Whether all of it is the template's: true by construction."""
        return self.writer == TEMPLATE

    def section(self, title: str) -> tuple[GroundedSentence, ...]:
        """The sentences of one section that were kept."""
        return tuple(item for item in self.sentences if item.kept and item.checked.section == title)

    @property
    def markdown(self) -> str:
        """The sections as one Markdown text."""
        return "\n\n".join(
            f"## {section.title}\n\n{as_markdown(self.section(section.title))}"
            for section in SECTIONS
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values; `from_dict` reads them back."""
        return {
            "writer": self.writer,
            "sentences": [item.to_dict() for item in self.sentences],
            "notes": list(self.notes),
            "raw": asdict(self.raw),
            "final": asdict(self.final),
        }

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "GroundedReport":
        """Read what `to_dict` wrote, now or in an earlier version."""
        return cls(
            writer=values["writer"],
            sentences=tuple(map(GroundedSentence.from_dict, upgraded(values["sentences"]))),
            notes=tuple(values["notes"]),
            raw=Metrics(**values["raw"]),
            final=Metrics(**values["final"]),
        )


@dataclass(frozen=True, slots=True)
class Draft:
    """Text of a section as it arrives, not yet checked; it is shown as provisional."""

    section: str
    text: str


@dataclass(frozen=True, slots=True)
class Written:
    """The next sentence of the report, checked. It replaces the draft text shown so far."""

    sentence: GroundedSentence


@dataclass(frozen=True, slots=True)
class Note:
    """A note for the reader on how the report was written."""

    text: str


@dataclass(frozen=True, slots=True)
class Done:
    """The report is complete; always the last event, and always there."""

    report: GroundedReport


GroundingEvent = Draft | Written | Note | Done


def write_grounded(case: Case, writer: Writer) -> Iterator[GroundingEvent]:
    """Let ``writer`` write about ``case`` and check as it writes. Never raises; ends with `Done`.

    Closing the iterator early closes the connection to the writer.
    """
    session = _Session(case, writer)
    for section in SECTIONS:
        yield from session.section(section)
    yield Done(session.outcome())


def grounded_template(case: Case) -> GroundedReport:
    """The template's report."""
    *_, done = write_grounded(case, TemplateWriter())
    assert isinstance(done, Done)
    return done.report


class StuckError(WriterError):
    """A model repeats itself. The next section may go better."""


def by_template(
    case: Case, statements: Iterable[Statement], section: Section
) -> Iterator[GroundedSentence]:
    """Statements of the template in a section: they need no check."""
    for statement in statements:
        yield GroundedSentence(vouched(case, statement, section.title), "template", kept=True)


class Checking:
    """Takes what a writer gives: statements as they are, text sentence by sentence, checked."""

    def __init__(self, case: Case, writer: Writer) -> None:
        """Check against the facts of ``case``."""
        self._case = case
        self._writer = writer
        self._checker = Checker(case)

    def take(
        self, pieces: Iterable[Statement | str], section: Section
    ) -> Iterator[Draft | Written]:
        """The sentences of a section; one that was broken off is left out.

        Raises `WriterError` where the writer fails, repeats itself or does not end.
        """
        splitter, said = SentenceSplitter(), list[str]()
        for piece in pieces:
            if isinstance(piece, Statement):
                yield from map(Written, by_template(self._case, [piece], section))
                continue
            yield Draft(section.title, piece)
            for found in splitter.push(piece):
                yield from self._check(found, section, said)
            if len(said) - len(set(said)) >= MAX_REPEATS:
                raise StuckError(f"{self._writer.name} repeated itself")
            if len(said) >= MAX_SENTENCES:
                raise WriterError(f"{self._writer.name} wrote more than {MAX_SENTENCES} sentences")
        for found in splitter.finish():
            yield from self._check(found, section, said)

    def _check(self, found: Sentence, section: Section, said: list[str]) -> Iterator[Written]:
        if found.kind == "heading":
            return  # models repeat the title, whatever the prompt says
        checked = self._checker.check(found, section)
        if found.kind == "row":
            why = ("a table of the model's own",)
            checked = replace(checked, verdict="unsupported", reasons=why)
        if normal(found.text) in said:
            checked = replace(checked, verdict="unsupported", reasons=("said before",))
        said.append(normal(found.text))
        yield Written(GroundedSentence(checked, "writer", not checked.struck))


class _Session:
    """One report while it is written."""

    def __init__(self, case: Case, writer: Writer) -> None:
        self._case = case
        self._writer = writer
        self._checking = Checking(case, writer)
        self._sentences: list[GroundedSentence] = []
        self._notes: list[str] = []
        self._failures = 0

    def section(self, section: Section) -> Iterator[GroundingEvent]:
        """One section: the writer's, and what the template has to add."""
        written: list[GroundedSentence] = []
        if self._failures < MAX_FAILURES:
            try:
                pieces = self._writer.section(self._case, section)
                for event in self._checking.take(pieces, section):
                    if isinstance(event, Written):
                        written.append(event.sentence)
                        self._sentences.append(event.sentence)
                    yield event
            except StuckError as error:
                yield self._note(f"{section.title}: {error} and was stopped.")
            except WriterError as error:
                self._failures = MAX_FAILURES if error.final else self._failures + 1
                yield self._note(f"{section.title}: {error}. The template wrote what was missing.")
        if self._writer.is_trusted:
            return
        for item in self._added(section, [item.checked for item in written if item.kept]):
            self._sentences.append(item)
            yield Written(item)

    def _added(
        self, section: Section, kept: Sequence[CheckedSentence]
    ) -> Iterator[GroundedSentence]:
        """What the template adds to a section."""
        statements = (
            supplement(self._case, section, _content(kept)) if kept else section.write(self._case)
        )
        yield from by_template(self._case, statements, section)

    def _note(self, text: str) -> Note:
        self._notes.append(text)
        return Note(text)

    def outcome(self) -> GroundedReport:
        """The report, measured before and after."""
        by_writer = [
            item.checked
            for item in self._sentences
            if item.origin == "writer" or self._writer.is_trusted
        ]
        struck = sum(not item.kept for item in self._sentences)
        if struck:
            self._note(
                f"{struck} of {len(by_writer)} sentences by {self._writer.name} were struck: "
                "contradicted by the evidence or the FMEA knowledge, or supported by neither."
            )
        return GroundedReport(
            writer=self._writer.name,
            sentences=tuple(self._sentences),
            notes=tuple(self._notes),
            raw=measure(self._case, by_writer),
            final=measure(self._case, [item.checked for item in self._sentences if item.kept]),
        )


def _content(kept: Sequence[CheckedSentence]) -> Content:
    """What the kept sentences of a section state."""
    text = " ".join(item.plain for item in kept)
    return Content(
        concludes=any(item.concludes for item in kept),
        steps=frozenset(step for item in kept for step in item.steps),
        channels=frozenset(name for item in kept for name in item.channels),
        text=text.casefold(),
        terms=terms(text),
    )


_TABLE_HEAD = (f"| {' | '.join(TABLE_HEAD)} |", f"|{' --- |' * len(TABLE_HEAD)}")


def as_markdown(items: Sequence[GroundedSentence]) -> str:
    """The kept sentences of one section as Markdown, in their lines and lists."""
    lines: list[str] = []
    previous = ""
    for item in items:
        said = item.checked
        if not item.kept:
            continue
        if said.kind == "row":
            if previous != "row":
                lines += ["", *_TABLE_HEAD]
            lines.append(said.text)
        elif said.first or not lines or previous in ("row", ""):
            if said.kind != "item" or previous != "item":
                lines.append("")
            mark = f"{' ' * said.indent}{said.marker} " if said.kind == "item" else ""
            lines.append(f"{mark}{said.text}")
        else:
            lines[-1] += f" {said.text}"
        previous = said.kind
    return "\n".join(lines).strip()

"""A report whose every sentence was checked before it counts, whoever wrote it.

A language model's text is checked sentence by sentence as it streams. What is contradicted or comes
from nowhere is struck, visibly; what the report then lacks (the verdict, causal steps, evidence,
rivals, actions) the template adds, marked as such. However the model fails, a complete report
comes out, with a note of what happened.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from core.report.case.case import Case
from core.report.check.checker import CheckedSentence, Checker
from core.report.check.metrics import Metrics, measure
from core.report.check.sentences import Sentence, SentenceSplitter, sentences
from core.report.check.statements import normal
from core.report.report import SECTION_TITLES, Report, Section
from core.report.template.supplement import supplement
from core.report.template.template import WRITER
from core.report.write.endpoint import WriterError
from core.report.write.writers import TemplateWriter, Writer, template_section

MAX_FAILURES = 2
"""After this many failed sections a model is not asked again."""

MAX_SENTENCES = 60
"""The most sentences of one section that are taken from a model."""

MAX_REPEATS = 2
"""A model that has said this many things again in one section is stopped: it has got stuck."""

Origin = Literal["writer", "template"]

TABLE_HEADER = "| Channel | Interval | Shift | Size | Verdict |"
_RULE = "| --- | --- | --- | --- | --- |"


@dataclass(frozen=True, slots=True)
class GroundedSentence:
    """A checked sentence of the report; ``kept`` is False where it is shown struck."""

    checked: CheckedSentence
    origin: Origin
    kept: bool

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "GroundedSentence":
        """Read what `to_dict` wrote."""
        checked = CheckedSentence.from_dict(values["checked"])
        return cls(checked, values["origin"], values["kept"])


@dataclass(frozen=True, slots=True)
class GroundedReport:
    """The outcome. ``raw``: measures of what the writer wrote; ``final``: of what is left of it.

    ``notes``: what happened on the way, in sentences for the reader; empty if all went well.
    """

    writer: str
    sentences: tuple[GroundedSentence, ...]
    notes: tuple[str, ...]
    raw: Metrics
    final: Metrics

    @property
    def report(self) -> Report:
        """The sentences that were kept, as a report."""
        return Report(
            tuple(
                Section(
                    title, as_markdown([s for s in self.sentences if s.checked.section == title])
                )
                for title in SECTION_TITLES
            ),
            self.writer,
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values; `from_dict` reads them back."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "GroundedReport":
        """Read what `to_dict` wrote."""
        return cls(
            writer=values["writer"],
            sentences=tuple(map(GroundedSentence.from_dict, values["sentences"])),
            notes=tuple(values["notes"]),
            raw=Metrics(**values["raw"]),
            final=Metrics(**values["final"]),
        )


@dataclass(frozen=True, slots=True)
class Draft:
    """Text of a section as it arrives, not yet checked: to be shown as provisional."""

    section: str
    text: str


@dataclass(frozen=True, slots=True)
class Written:
    """The next sentence of the report, checked. It replaces the draft text shown so far."""

    sentence: GroundedSentence


@dataclass(frozen=True, slots=True)
class Note:
    """Something that the reader should know of how this report came about."""

    text: str


@dataclass(frozen=True, slots=True)
class Done:
    """The report is complete; always the last event, and always there."""

    report: GroundedReport


GroundingEvent = Draft | Written | Note | Done


def write_grounded(case: Case, writer: Writer) -> Iterator[GroundingEvent]:
    """Let ``writer`` write about ``case`` and check as it writes. Never raises; ends with `Done`.

    Closing the iterator early hangs up on the writer.
    """
    session = _Session(case, writer)
    for title in SECTION_TITLES:
        yield from session.section(title)
    yield Done(session.outcome())


def grounded_template(case: Case) -> GroundedReport:
    """The template's report, checked like any other."""
    *_, done = write_grounded(case, TemplateWriter())
    assert isinstance(done, Done)
    return done.report


class _StuckError(WriterError):
    """A model says the same over and over. The next section may go better."""


class _Session:
    """One report in the making."""

    def __init__(self, case: Case, writer: Writer) -> None:
        self._case = case
        self._writer = writer
        self._sentences: list[GroundedSentence] = []
        self._notes: list[str] = []
        self._failures = 0
        self._checker = Checker(case)

    def section(self, title: str) -> Iterator[GroundingEvent]:
        """One section: the writer's, and what the template has to add."""
        written: list[GroundedSentence] = []
        if self._failures < MAX_FAILURES:
            try:
                for event in self._written(title):
                    if isinstance(event, Written):
                        written.append(event.sentence)
                    yield event
            except _StuckError as error:
                yield self._note(f"{title}: {error} and was stopped.")
            except WriterError as error:
                self._failures = MAX_FAILURES if error.final else self._failures + 1
                yield self._note(f"{title}: {error}. The template wrote what was missing.")
        if self._writer.name == WRITER:
            return
        for item in self._added(title, written):
            self._sentences.append(item)
            yield Written(item)

    def _written(self, title: str) -> Iterator[Draft | Written]:
        """The writer's sentences; one that was broken off is left out."""
        splitter, said = SentenceSplitter(), list[str]()
        for piece in self._writer.section(self._case, title):
            yield Draft(title, piece)
            for found in splitter.push(piece):
                yield from self._check(found, title, said)
            if self._writer.name == WRITER:
                continue
            if len(said) - len(set(said)) >= MAX_REPEATS:
                raise _StuckError(f"{self._writer.name} began to repeat itself")
            if len(said) >= MAX_SENTENCES:
                raise WriterError(f"more than {MAX_SENTENCES} sentences came")
        for found in splitter.finish():
            yield from self._check(found, title, said)

    def _check(self, found: Sentence, title: str, said: list[str]) -> Iterator[Written]:
        origin: Origin = "template" if self._writer.name == WRITER else "writer"
        if origin == "writer" and found.kind == "heading":
            return  # models repeat the title, however often they are told not to
        checked = self._checker.check(found, title)
        if origin == "writer" and found.kind == "row":
            why = ("a table of the model's own",)
            checked = replace(checked, verdict="unsupported", reasons=why)
        if origin == "writer" and normal(found.text) in said:
            checked = replace(checked, verdict="unsupported", reasons=("said before",))
        said.append(normal(found.text))
        item = GroundedSentence(checked, origin, not checked.struck)
        self._sentences.append(item)
        yield Written(item)

    def _added(self, title: str, written: Sequence[GroundedSentence]) -> Iterator[GroundedSentence]:
        """What the template adds to a section, checked too."""
        kept = [item.checked for item in written if item.kept]
        text = supplement(self._case, title, kept) if kept else template_section(self._case, title)
        checker = Checker(self._case)
        for found in sentences(text):
            checked = checker.check(found, title)
            yield GroundedSentence(checked, "template", not checked.struck)

    def _note(self, text: str) -> Note:
        self._notes.append(text)
        return Note(text)

    def outcome(self) -> GroundedReport:
        """The report, measured before and after."""
        by_writer = [
            item.checked
            for item in self._sentences
            if item.origin == "writer" or self._writer.name == WRITER
        ]
        struck = sum(not item.kept for item in self._sentences)
        if struck:
            self._note(
                f"{struck} of {len(by_writer)} sentences by {self._writer.name} were struck: "
                "evidence or knowledge speak against them, or nothing supports them."
            )
        return GroundedReport(
            writer=self._writer.name,
            sentences=tuple(self._sentences),
            notes=tuple(self._notes),
            raw=measure(self._case, by_writer),
            final=measure(self._case, [item.checked for item in self._sentences if item.kept]),
        )


def as_markdown(items: Sequence[GroundedSentence]) -> str:
    """The kept sentences of one section as Markdown, in their lines and lists."""
    lines: list[str] = []
    previous = ""
    for item in items:
        said = item.checked
        if not item.kept:
            continue
        if said.kind == "row":
            if previous != "row" and said.text != TABLE_HEADER:
                lines += ["", TABLE_HEADER, _RULE]
            elif previous != "row":
                lines.append("")
            lines.append(said.text)
            if said.text == TABLE_HEADER:
                lines.append(_RULE)
        elif said.first or not lines or previous in ("row", ""):
            if said.kind != "item" or previous != "item":
                lines.append("")
            mark = f"{' ' * said.indent}{said.marker} " if said.kind == "item" else ""
            lines.append(f"{mark}{said.text}")
        else:
            lines[-1] += f" {said.text}"
        previous = said.kind
    return "\n".join(lines).strip()

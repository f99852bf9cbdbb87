"""Questions about a report: answered from evidence and knowledge, with or without a model.

Offline the answer is put together from the same sentences as the report; a model's answer is
checked sentence by sentence like everything it writes.
"""

from collections.abc import Iterator

from core.diagnosis.diagnosis import Diagnosis
from core.report.case.case import open_case
from core.report.check.checker import Checker
from core.report.check.metrics import measure
from core.report.check.sentences import SentenceSplitter, sentences
from core.report.grounded import (
    Done,
    Draft,
    GroundedReport,
    GroundedSentence,
    GroundingEvent,
    Note,
    Written,
)
from core.report.template.answers import modes_meant, offline_answer
from core.report.template.template import WRITER
from core.report.write.endpoint import WriterError
from core.report.write.prompts import checked_question
from core.report.write.writers import Writer


def ask(
    diagnosis: Diagnosis, question: str, writer: Writer | None = None
) -> Iterator[GroundingEvent]:
    """Answer a question about a diagnosis; ends with `Done`, whose section title is "".

    Without a writer, or where it fails or nothing it says stands, the knowledge base answers.
    Raises `InputError` if the question is empty or too long.
    """
    asked = checked_question(question)
    case = open_case(diagnosis, also=modes_meant(asked))
    checker = Checker(case)
    found: list[GroundedSentence] = []
    notes: list[str] = []
    if writer is not None and writer.name != WRITER:
        splitter = SentenceSplitter()
        try:
            for piece in writer.answer(case, asked):
                yield Draft("", piece)
                for item in splitter.push(piece):
                    checked = checker.check(item, "")
                    found.append(GroundedSentence(checked, "writer", not checked.struck))
                    yield Written(found[-1])
        except WriterError as error:
            notes.append(f"{error}. The knowledge base answers instead.")
            yield Note(notes[-1])
        for item in splitter.finish():
            checked = checker.check(item, "")
            found.append(GroundedSentence(checked, "writer", not checked.struck))
            yield Written(found[-1])
    by_writer = [item.checked for item in found]
    if not any(item.kept and item.checked.verdict == "supported" for item in found):
        for item in sentences(offline_answer(case, asked)):
            checked = checker.check(item, "")
            found.append(GroundedSentence(checked, "template", not checked.struck))
            yield Written(found[-1])
    kept = [item.checked for item in found if item.kept]
    name = writer.name if writer is not None else WRITER
    raw, final = measure(case, by_writer), measure(case, kept)
    yield Done(GroundedReport(name, tuple(found), tuple(notes), raw, final))

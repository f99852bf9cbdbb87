"""Questions about a report, answered from evidence and knowledge, with or without a model.

The offline answer is made of statements like the report; a model's answer is checked sentence by
sentence.
"""

from collections.abc import Iterator

from core.diagnosis.diagnosis import Diagnosis
from core.report.answers import modes_meant, offline_answer
from core.report.case.case import open_case
from core.report.check.metrics import measure
from core.report.grounded import (
    Checking,
    Done,
    GroundedReport,
    GroundedSentence,
    GroundingEvent,
    Note,
    Written,
    by_template,
)
from core.report.sections import ANSWER
from core.report.write.endpoint import WriterError
from core.report.write.prompts import checked_question
from core.report.write.writers import TemplateWriter, Writer


def ask(
    diagnosis: Diagnosis, question: str, writer: Writer | None = None
) -> Iterator[GroundingEvent]:
    """Answer a question about a diagnosis; ends with `Done`, whose section title is "".

    Without a writer, or where it fails or none of its sentences is supported, the knowledge base
    answers.
    Raises `InputError` if the question is empty or too long.
    """
    asked = checked_question(question)
    case = open_case(diagnosis, also=modes_meant(asked))
    writer = writer or TemplateWriter()
    found: list[GroundedSentence] = []
    notes: list[str] = []
    try:
        for event in Checking(case, writer).take(writer.answer(case, asked), ANSWER):
            if isinstance(event, Written):
                found.append(event.sentence)
            yield event
    except WriterError as error:
        notes.append(f"{error}. The knowledge base answers instead.")
        yield Note(notes[-1])
    by_writer = [item.checked for item in found]
    answered = any(item.kept and item.checked.verdict == "supported" for item in found)
    if not (answered or writer.is_trusted):
        for item in by_template(case, offline_answer(case, asked), ANSWER):
            found.append(item)
            yield Written(item)
    kept = [item.checked for item in found if item.kept]
    raw, final = measure(case, by_writer), measure(case, kept)
    yield Done(GroundedReport(writer.name, tuple(found), tuple(notes), raw, final))

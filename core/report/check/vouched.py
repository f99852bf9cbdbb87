"""Statements of the template as checked sentences: true by what they are made from.

Nothing is read here but the knowledge base's own sentences, for the channels that they name. That
the checker of free text agrees with every statement is a test.
"""

from collections.abc import Iterator
from functools import lru_cache

from core.report.case.case import Case
from core.report.case.findings import strongest
from core.report.check.channel_checks import fact
from core.report.check.checker import CheckedSentence, interval_of
from core.report.check.mentions import channel_mentions
from core.report.statement import Statement
from core.units import percent

MAX_FACTS = 4
"""How many channels a reason names."""


def vouched(case: Case, statement: Statement, section: str) -> CheckedSentence:
    """A statement of the template about ``case``, in the section of that title."""
    cited = _cited(case, statement)
    start_s, end_s = interval_of(case, cited)
    about_sensors = int("sensor" in statement.rests_on)
    about_verdict = int("verdict" in statement.rests_on)
    is_step = statement.kind == "step" and "knowledge" in statement.rests_on
    return CheckedSentence(
        text=statement.markdown,
        section=section,
        kind=statement.line,
        marker=statement.marker,
        indent=statement.indent,
        first=statement.first,
        verdict="supported" if statement.rests_on else "plain",
        reasons=tuple(_reasons(case, statement, cited)),
        channels=cited,
        start_s=start_s,
        end_s=end_s,
        about_sensors=about_sensors,
        sensors_right=about_sensors,
        about_verdict=about_verdict,
        verdict_right=about_verdict,
        steps=(statement.step,) if is_step else (),
        concludes=statement.concludes,
        states=statement.kind,
        runs=statement.runs,
        cells=statement.cells,
    )


def _cited(case: Case, statement: Statement) -> tuple[str, ...]:
    """The channels of a statement that moved, or all of them where none did."""
    names = statement.channels
    if statement.rests_on == ("knowledge",) and not names and statement.kind != "step":
        return _named(statement.text)
    moved = strongest(case.evidence)
    return tuple(dict.fromkeys([name for name in names if name in moved] or names))


@lru_cache(4096)
def _named(text: str) -> tuple[str, ...]:
    """The channels that a sentence of the knowledge base names; there are few such sentences."""
    mentions = channel_mentions(text)
    return tuple(dict.fromkeys(name for mention in mentions for name in mention.channels))


def _reasons(case: Case, statement: Statement, cited: tuple[str, ...]) -> Iterator[str]:
    moved = strongest(case.evidence)
    for basis in statement.rests_on:
        match basis:
            case "sensor":
                facts = [fact(name, moved.get(name)) for name in cited[:MAX_FACTS]]
                yield "; ".join(facts) or "the evidence of this flight"
            case "verdict" if statement.mode in case.weighed:
                candidate = case.weighed[statement.mode]
                odds = percent(candidate.probability)
                yield f"the classifier gives {candidate.mode.name} {odds}"
            case "verdict":
                yield f"the diagnosis is {case.top.mode.name}"
            case "flight":
                yield "as it was flown"
            case "knowledge":
                step = f" {statement.step}" if statement.step else ""
                yield f"knowledge of {statement.mode or case.top.mode.id}, {statement.kind}{step}"

"""The second section: how the verdict's fault works, step by step, and what was seen of it."""

from collections.abc import Iterable, Iterator

from core.clock import clock
from core.report.case.case import Case
from core.report.case.findings import ChannelCheck, StepCheck, StepVerdict
from core.report.case.wording import labels, moves, with_cylinder
from core.report.statement import Statement, item, paragraph, prose, say

_STEP_MARKS: dict[StepVerdict, str] = {
    "seen": "Seen.",
    "not seen": "Not seen.",
    "contradicted": "Contradicted by evidence.",
    "no sensor": "No sensor sees this.",
}


def mechanism(case: Case) -> tuple[Statement, ...]:
    """How the first candidate works, and its causal chain with what was seen of each step."""
    mode, cylinder = case.top.mode, case.cylinder_of(case.top.mode)
    works = with_cylinder(mode.mechanism, cylinder)
    return (
        *paragraph(*prose("mechanism", works, rests_on=("knowledge",), mode=mode.id)),
        *paragraph(say("introduction", "From defect to sensor:")),
        *(
            statement
            for number, check in enumerate(case.top.finding.chain, start=1)
            for statement in item(f"{number}.", *_step(number, check, cylinder))
        ),
    )


def _step(number: int, check: StepCheck, cylinder: int | None) -> Iterator[Statement]:
    """Whether a step was seen, the step, and what its channels did."""
    yield say("step", "", strong=_STEP_MARKS[check.verdict], step=number)
    moved = tuple(each.channel for each in check.checks if each.evidence is not None)
    yield from prose(
        "step",
        with_cylinder(check.step.text, cylinder),
        rests_on=("knowledge",),
        channels=moved,
        step=number,
    )
    if evidence := _step_evidence(check):
        names = tuple(each.channel for each in check.checks)
        yield say("step", evidence, rests_on=("sensor",), channels=names, step=number)


def _step_evidence(step: StepCheck) -> str:
    """What the channels of a step did, in brackets."""
    agreeing = [check for check in step.checks if check.verdict == "agrees"]
    traces = [check for check in agreeing if check.expected and check.expected.sign == "0"]
    words = {
        "": _timed(check for check in agreeing if check not in traces),
        "against it: ": _timed(check for check in step.checks if check.verdict == "conflicts"),
        "too faint to count: ": _timed(check for check in step.checks if check.verdict == "faint"),
        "only a trace in ": _timed(traces),
        "no shift in ": labels(check.channel for check in step.checks if check.evidence is None),
    }
    said = "; ".join(f"{lead}{text}" for lead, text in words.items() if text)
    return f"({said})" if said else ""


def _timed(checks: Iterable[ChannelCheck]) -> str:
    """The moves of these channels, and when the first of them began."""
    items = [check.evidence for check in checks if check.evidence is not None]
    if not items:
        return ""
    return f"{', '.join(moves(items))} from {clock(min(item.onset_s for item in items))}"

"""The offline report: five sections written from the case alone, without a language model.

Every number comes from the diagnosis or the knowledge base, and every statement about a sensor
from `core.report.case.findings`. The injected fault is not an input and cannot leak.
"""

from collections.abc import Iterable

from core.clock import clock
from core.diagnosis.diagnosis import Diagnosis
from core.report.case.case import Candidate, Case, open_case
from core.report.case.findings import ChannelCheck, StepCheck, StepVerdict
from core.report.case.wording import labels, moves, with_cylinder
from core.report.report import SECTION_TITLES, Report, Section
from core.report.template.conclusion import conclusion
from core.report.template.cross_check import cross_check
from core.report.template.differential import differential

WRITER = "template"

_STEP_MARKS: dict[StepVerdict, str] = {
    "seen": "Seen.",
    "not seen": "Not seen.",
    "contradicted": "Contradicted by evidence.",
    "no sensor": "No sensor sees this.",
}


def write_report(diagnosis: Diagnosis) -> Report:
    """The report on a diagnosis (paper section 5.2); raises `InputError` if it is malformed."""
    case = open_case(diagnosis)
    texts = (
        conclusion(case),
        mechanism(case),
        cross_check(case),
        differential(case),
        maintenance(case),
    )
    return Report(tuple(map(Section, SECTION_TITLES, texts)), WRITER)


def mechanism(case: Case) -> str:
    """How the first candidate works, and its causal chain with what was seen of each step."""
    mode, cylinder = case.top.mode, case.cylinder_of(case.top.mode)
    steps = "\n".join(
        f"{number}. **{_STEP_MARKS[check.verdict]}** {with_cylinder(check.step.text, cylinder)}"
        f"{_step_evidence(check)}"
        for number, check in enumerate(case.top.finding.chain, start=1)
    )
    return f"{with_cylinder(mode.mechanism, cylinder)}\n\nFrom defect to sensor:\n\n{steps}"


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
    return f" ({said})" if said else ""


def _timed(checks: Iterable[ChannelCheck]) -> str:
    """The moves of these channels, and when the first of them began."""
    items = [check.evidence for check in checks if check.evidence is not None]
    if not items:
        return ""
    return f"{', '.join(moves(items))} from {clock(min(item.onset_s for item in items))}"


def maintenance(case: Case) -> str:
    """What to do, numbered; where the first candidate is not firm, the second's actions follow."""
    order = case.work_order
    parts = []
    if case.confidence == "low" and order[0].mode.id != "nominal":
        parts.append("The diagnosis is not firm: inspect first, change parts only on a finding.")
    done = 0
    for candidate in order:
        if len(order) > 1 or case.doubts_nominal:
            parts.append(
                f"{'If that settles nothing, for' if done else 'For'} {candidate.mode.name}:"
            )
        actions = _actions(case, candidate)
        parts.append(_numbered(actions, first=done + 1))
        done += len(actions)
    parts.append("The makers' current manuals and airworthiness directives come before this text.")
    return "\n\n".join(parts)


def _actions(case: Case, candidate: Candidate) -> list[str]:
    cylinder = case.cylinder_of(candidate.mode)
    return [with_cylinder(action, cylinder) for action in candidate.mode.actions]


def _numbered(lines: list[str], first: int) -> str:
    return "\n".join(f"{number}. {line}" for number, line in enumerate(lines, start=first))

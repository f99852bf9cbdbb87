"""The third section: every item of evidence against the verdict, and what is absent."""

from core.clock import clock
from core.diagnosis.diagnosis import Evidence
from core.report.case.case import Case
from core.report.case.findings import ChannelCheck
from core.report.case.wording import expectation, interval, label, labels, shift, sigma


def cross_check(case: Case) -> str:
    """A table of the evidence with a verdict each, then what is missing and what kept still."""
    finding = case.top.finding
    absences = "\n".join(f"- {line}" for line in _absences(case))
    if not case.evidence:
        return f"No channel left its noise during the flight.\n\n{absences}".strip()
    rows = [
        f"| {label(item.channel)} | {_interval(item)} | {shift(item)} | {sigma(item.sigma)} "
        f"| {_verdict(finding.check_of(item))} |"
        for item in sorted(case.evidence, key=lambda item: (item.onset_s, -abs(item.sigma)))
    ]
    table = "\n".join(
        [
            "| Channel | Interval | Shift | Size | Verdict |",
            "| --- | --- | --- | --- | --- |",
            *rows,
        ]
    )
    lead = (
        "Shift from the healthy mirror at the end of each interval, in the order in which "
        f"the channels left it, against {finding.mode.name}. Predicted are settled amounts."
    )
    return f"{lead}\n\n{table}\n\n{absences}".strip()


def _interval(item: Evidence) -> str:
    if item.settled_s is None:
        return interval(item)
    return f"{interval(item)}, settled from {clock(item.settled_s)}"


def _verdict(check: ChannelCheck) -> str:
    """One of agrees, conflicts and unexplained, and why."""
    expected = check.expected
    if expected is None:
        return "unexplained: outside this mode's signature"
    should = f"should {expectation(expected, check.channel)}"
    if check.verdict == "faint":
        lead = "agrees, but faint" if check.progress > 0.0 else "unexplained, faint"
        return f"{lead}: {should}"
    if check.verdict == "conflicts":
        return f"conflicts: {should}"
    match expected.sign:
        case "0":
            return "agrees: a trace where it should stay put"
        case "~":
            return "agrees: it may move with this mode"
        case _ if check.shortfall:
            return f"right way, but less so far: {should}"
        case _ if check.excess:
            return f"right way, but more: {should}"
        case _:
            return f"agrees: {should}"


def _absences(case: Case) -> list[str]:
    """What should have moved and did not, and what rightly kept still."""
    finding = case.top.finding
    missing: dict[str, list[str]] = {}
    for check in finding.having("missing"):
        if check.expected is not None:
            words = expectation(check.expected, check.channel)
            missing.setdefault(words, []).append(check.channel)
    lines = [
        f"**Missing:** {labels(names)} should {words} but stayed within noise."
        for words, names in missing.items()
    ]
    quiet = [
        check.channel
        for check in finding.having("quiet")
        if check.expected is not None and check.expected.sign == "0"
    ]
    if quiet:
        lines.append(f"**Quiet, as it should be:** {labels(quiet)}.")
    return lines

"""The third section: every item of evidence against the verdict, and what is absent."""

from collections.abc import Iterator, Sequence

from core.clock import clock
from core.diagnosis.diagnosis import Evidence
from core.report.case.case import Case
from core.report.case.findings import ChannelCheck
from core.report.case.wording import expectation, interval, label, labels, shift, sigma
from core.report.statement import Statement, item, paragraph, prose, row, say

TABLE_HEAD = ("Channel", "Interval", "Shift", "Size", "Verdict")
"""What the cells of a row of evidence are."""


def cross_check(case: Case) -> tuple[Statement, ...]:
    """A table of the evidence with a verdict each, then what is missing and what kept still."""
    if not case.evidence:
        none = say("introduction", "No channel left its noise during the flight.")
        return (*paragraph(none), *_absences(case))
    lead = (
        "Shift from the healthy mirror at the end of each interval, in the order in which "
        f"the channels left it, compared with {case.top.finding.mode.name}. Predictions are "
        "settled values."
    )
    return (
        *paragraph(*prose("introduction", lead)),
        *(
            _row(case, each)
            for each in sorted(case.evidence, key=lambda each: (each.onset_s, -abs(each.sigma)))
        ),
        *_absences(case),
    )


def _row(case: Case, evidence: Evidence) -> Statement:
    cells = (
        label(evidence.channel),
        _interval(evidence),
        shift(evidence),
        sigma(evidence.sigma),
        _verdict(case.top.finding.check_of(evidence)),
    )
    return row("evidence", cells, rests_on=("sensor",), channels=(evidence.channel,))


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


def _absences(case: Case) -> Iterator[Statement]:
    """What should have moved and did not, and what rightly kept still."""
    finding = case.top.finding
    missing: dict[str, list[str]] = {}
    for check in finding.having("missing"):
        if check.expected is not None:
            words = expectation(check.expected, check.channel)
            missing.setdefault(words, []).append(check.channel)
    for words, names in missing.items():
        text = f"{labels(names)} should {words} but stayed within noise."
        yield from _absence("Missing:", text, names)
    quiet = [
        check.channel
        for check in finding.having("quiet")
        if check.expected is not None and check.expected.sign == "0"
    ]
    if quiet:
        yield from _absence("Quiet, as it should be:", f"{labels(quiet)}.", quiet)


def _absence(lead: str, text: str, names: Sequence[str]) -> tuple[Statement, ...]:
    said = say("absence", text, strong=lead, rests_on=("sensor",), channels=tuple(names))
    return item("-", said)

"""The fourth section: what speaks for and against each mode that could be taken for the verdict."""

from collections.abc import Iterable

from core.knowledge.knowledge import resolve
from core.report.case.case import Candidate, Case
from core.report.case.findings import ChannelCheck, Finding, strongest
from core.report.case.wording import expectation, labels, moves, percent

MAX_LISTED = 3
"""How many shifts a clause names, and clauses a line, before the rest is only counted."""


def differential(case: Case) -> str:
    """The other candidates, then the look-alikes of the first, each weighed on the evidence."""
    rivals = (*case.candidates[1:], *case.look_alikes)
    return "\n".join(weigh(case, rival) for rival in rivals)


def weigh(case: Case, rival: Candidate) -> str:
    """One rival with what speaks for and against it, as a list item."""
    lines = [
        f"- **{rival.mode.name}** ({percent(rival.probability)})",
        f"  - For: {_for(rival)}.",
        f"  - Against: {_against(rival)}.",
        *(f"  - Tell: {text}" for text in _tells(case, rival)),
    ]
    return "\n".join(lines)


def _for(rival: Candidate) -> str:
    """The evidence that the rival would explain."""
    finding = rival.finding
    if not finding.predicted:
        quiet = len(finding.having("quiet"))
        return f"{quiet} channels stayed within noise" if quiet else "nothing in the evidence"
    agreeing = _listed(finding.confirmed)
    return f"{agreeing}, as it predicts" if agreeing else "nothing in the evidence"


def _against(rival: Candidate) -> str:
    """The evidence that the rival would leave open, and what it needs and is not there."""
    finding = rival.finding
    reasons = [f"{_listed(group)} should {words}" for words, group in _conflicts(finding)]
    if missing := labels(check.channel for check in finding.having("missing")):
        reasons.append(f"no shift in {missing}")
    if faint := _listed(finding.having("faint")):
        reasons.append(f"{faint}: too faint")
    if large := _listed(check for check in finding.checks if check.oversize):
        reasons.append(f"{large}: too large")
    if unexplained := labels(check.channel for check in finding.having("unexplained")):
        reasons.append(f"leaves {unexplained} unexplained")
    if not reasons:
        return "nothing in the evidence; only the odds put it behind"
    return "; ".join(reasons[:MAX_LISTED]) + ("; and more" if len(reasons) > MAX_LISTED else "")


def _conflicts(finding: Finding) -> list[tuple[str, list[ChannelCheck]]]:
    """The conflicting channels by what they should have done."""
    groups: dict[str, list[ChannelCheck]] = {}
    for check in finding.having("conflicts"):
        if check.expected is not None:
            words = expectation(check.expected, check.channel)
            groups.setdefault(words, []).append(check)
    return list(groups.items())


def _listed(checks: Iterable[ChannelCheck]) -> str:
    """The first few moves of these channels, and how many more there are."""
    said = moves(check.evidence for check in checks if check.evidence)
    more = len(said) - MAX_LISTED
    return ", ".join(said[:MAX_LISTED]) + (f" and {more} more" if more > 0 else "")


def _tells(case: Case, rival: Candidate) -> list[str]:
    """What sets the rival apart from the first candidate, with what was measured there."""
    top = case.top.mode
    pairs = [item for item in top.look_alikes if item.mode == rival.mode.id] or [
        item for item in rival.mode.look_alikes if item.mode == top.id
    ]
    return [f"{pair.tell} {_readings(case, pair.channels)}" for pair in pairs]


def _readings(case: Case, channels: Iterable[str]) -> str:
    """What the channels of a tell showed in this flight."""
    cylinder = case.top.finding.cylinder
    names = [name for item in channels for name in resolve(item, cylinder)]
    seen = strongest(case.evidence)
    shifts = moves(seen[name] for name in names if name in seen)
    still = labels(name for name in names if name not in seen)
    said = [*shifts, f"{still} within noise"] if still else shifts
    return f"Here: {', '.join(said)}."

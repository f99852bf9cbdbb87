"""The fourth section: what speaks for and against each mode that could be taken for the verdict."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from core.knowledge.knowledge import LookAlike, resolve
from core.report.case.case import Candidate, Case
from core.report.case.findings import ChannelCheck, Finding, strongest
from core.report.case.wording import expectation, labels, moves
from core.report.statement import Basis, Statement, item, prose, say
from core.units import percent

MAX_LISTED = 3
"""How many shifts a clause names, and clauses a line, before the rest is only counted."""


@dataclass(frozen=True, slots=True)
class _Clause:
    """One reason, and the channels that it names."""

    text: str
    channels: tuple[str, ...]


def differential(case: Case) -> tuple[Statement, ...]:
    """The other candidates, then the look-alikes of the first, each weighed on the evidence."""
    rivals = (*case.candidates[1:], *case.look_alikes)
    return tuple(statement for rival in rivals for statement in weigh(case, rival))


def weigh(case: Case, rival: Candidate) -> Iterator[Statement]:
    """One rival with what speaks for and against it, as a list item with items below it."""
    odds = f"({percent(rival.probability)})"
    name = rival.mode.name
    yield from item("-", say("rival", odds, strong=name, rests_on=("verdict",), mode=rival.mode.id))
    for words, clauses, none in (
        ("For", _for(rival), "nothing in the evidence"),
        ("Against", _against(rival), "nothing in the evidence; only its probability is lower"),
    ):
        yield from _below(rival, _weighed(words, clauses, none))
    for pair in _tells(case, rival):
        yield from _below(
            rival,
            *prose("rival", f"Difference: {pair.tell}", rests_on=("knowledge",)),
            _readings(case, pair.channels),
        )


def _weighed(words: str, clauses: Sequence[_Clause], none: str) -> Statement:
    """The first few clauses behind ``words``, or ``none``."""
    listed = clauses[:MAX_LISTED]
    text = "; ".join(clause.text for clause in listed) or none
    more = "; and more" if len(clauses) > MAX_LISTED else ""
    channels = tuple(name for clause in listed for name in clause.channels)
    basis: tuple[Basis, ...] = ("sensor",) if channels else ()
    return say("rival", f"{words}: {text}{more}.", rests_on=basis, channels=channels)


def _below(rival: Candidate, *statements: Statement) -> Iterator[Statement]:
    for statement in item("-", *statements, indent=2):
        yield replace(statement, mode=rival.mode.id)


def _for(rival: Candidate) -> list[_Clause]:
    """The evidence that the rival would explain."""
    finding = rival.finding
    if not finding.predicted:
        quiet = len(finding.having("quiet"))
        return [_Clause(f"{quiet} channels stayed within noise", ())] if quiet else []
    agreeing = _listed(finding.confirmed)
    return [_Clause(f"{agreeing}, as it predicts", _names(finding.confirmed))] if agreeing else []


def _against(rival: Candidate) -> list[_Clause]:
    """The evidence that the rival would leave open, and what it needs and is not there."""
    finding = rival.finding
    reasons = [
        _Clause(f"{_listed(group)} should {words}", _names(group))
        for words, group in _conflicts(finding)
    ]
    missing, faint = finding.having("missing"), finding.having("faint")
    large = tuple(check for check in finding.checks if check.oversize)
    unexplained = finding.having("unexplained")
    reasons += [
        _Clause(text, _names(checks))
        for checks, text in (
            (missing, f"no shift in {_labels(missing)}"),
            (faint, f"{_listed(faint)}: too faint"),
            (large, f"{_listed(large)}: too large"),
            (unexplained, f"leaves {_labels(unexplained)} unexplained"),
        )
        if checks
    ]
    return reasons


def _names(checks: Iterable[ChannelCheck]) -> tuple[str, ...]:
    return tuple(check.channel for check in checks)


def _labels(checks: Iterable[ChannelCheck]) -> str:
    return labels(_names(checks))


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


def _tells(case: Case, rival: Candidate) -> list[LookAlike]:
    """The differences between the rival and the first candidate."""
    top = case.top.mode
    return [pair for pair in top.look_alikes if pair.mode == rival.mode.id] or [
        pair for pair in rival.mode.look_alikes if pair.mode == top.id
    ]


def _readings(case: Case, channels: Iterable[str]) -> Statement:
    """The shifts of these channels in this flight."""
    cylinder = case.top.finding.cylinder
    names = [name for each in channels for name in resolve(each, cylinder)]
    seen = strongest(case.evidence)
    shifts = moves(seen[name] for name in names if name in seen)
    still = labels(name for name in names if name not in seen)
    said = [*shifts, f"{still} within noise"] if still else shifts
    return say("rival", f"Here: {', '.join(said)}.", rests_on=("sensor",), channels=tuple(names))

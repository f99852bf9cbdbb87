"""Checks of claims about sensors: is the channel logged, did it move, which way, how far, when."""

import re
from collections.abc import Iterable, Iterator

from core.diagnosis.diagnosis import Evidence
from core.knowledge.knowledge import ExpectedShift
from core.knowledge.lexicon import lexicon
from core.report.case.case import Candidate
from core.report.case.findings import Verdict as ChannelVerdict
from core.report.case.findings import strongest
from core.report.case.wording import label, shift
from core.report.check.claims import ChannelClaim, Move, Predicate
from core.report.check.mentions import Quantity
from core.report.check.reading import Checked, Reading, is_known

VALUE_TOLERANCE = 0.05
"""A number is right within this share of the measured one, or within its own rounding."""

TIME_TOLERANCE_S = 2.0
"""A time is right within this many seconds of one that the evidence has."""

_BEGINS = re.compile(r"\b(?:parts?|departs?|onset|began|begins?|started)\b")
_AT_ODDS = re.compile(r"\b(?:does not fit|conflicts?|contradicts?|unexplained)\b", re.IGNORECASE)
_ODD: tuple[ChannelVerdict, ...] = ("conflicts", "unexplained", "missing", "faint")


def check_channels(reading: Reading, claims: Iterable[ChannelClaim]) -> Iterator[Checked]:
    """Whether the named channels did what is said, and are logged at all."""
    for hit in lexicon().unlogged.finditer(reading.text):
        if not reading.names(hit[0]):
            yield Checked(False, "sensor", f"{hit[0]} is not logged", "unsupported")
    for claim in claims:
        if not claim.predicates:
            yield _bare_mention(reading, claim)
        for predicate in claim.predicates:
            yield _predicate(reading, claim, predicate)


def _bare_mention(reading: Reading, claim: ChannelClaim) -> Checked:
    moved = strongest(reading.case.evidence)
    signatures = {name for item in reading.focus for name in _signature(item)}
    known = [name for name in claim.channels if name in moved or name in signatures]
    if reading.section.id == "conclusion" and _AT_ODDS.search(reading.text):
        odd = {check.channel for check in reading.case.top.finding.having(*_ODD)}
        known = [name for name in known if name in odd]
    said = ", ".join(label(name) for name in claim.channels)
    if known:
        cited = tuple(name for name in claim.channels if name in moved)
        return Checked(True, "sensor", f"{said}: of this case", channels=cited)
    return Checked(False, "sensor", f"{said} did not move and says nothing here", "unsupported")


def _signature(candidate: Candidate) -> dict[str, ExpectedShift]:
    return candidate.mode.signature(candidate.finding.cylinder)


def _predicate(reading: Reading, claim: ChannelClaim, predicate: Predicate) -> Checked:
    if predicate.expected:
        return _expectation(reading, claim, predicate)
    measured = _measurement(reading, claim, predicate)
    figured = any(item.signed or item.unit == "sigma" for item in predicate.quantities)
    if measured.holds or figured or (reading.measured and not reading.is_action):
        return measured
    general = _expectation(reading, claim, predicate)
    return general if general.holds else measured


def _measurement(reading: Reading, claim: ChannelClaim, predicate: Predicate) -> Checked:
    """What is said against what was measured."""
    moved = strongest(reading.case.evidence)
    judged = [_measured(reading, name, moved.get(name), predicate) for name in claim.channels]
    right = [name for name, problem in zip(claim.channels, judged, strict=True) if not problem]
    holds = len(right) == len(judged) if claim.exact else bool(right)
    problem = "" if holds else next(text for text in judged if text)
    if holds and not _range_fits(claim, predicate, moved):
        holds, problem = False, "the range is not what was measured"
    cited = tuple(name for name in (right or claim.channels) if name in moved)
    reason = "; ".join(fact(name, moved.get(name)) for name in (right or claim.channels)[:4])
    return Checked(holds, "sensor", problem or reason, channels=cited)


def fact(name: str, item: Evidence | None) -> str:
    """What a channel did: ``CHT 3 +18.3 °F``, or that it stayed within its noise."""
    return f"{label(name)} {shift(item) if item else 'within noise'}"


def _measured(reading: Reading, name: str, item: Evidence | None, predicate: Predicate) -> str:
    """What is wrong with a predicate said of one channel; "" if nothing is."""
    if predicate.move == "still":
        return "" if _kept_still(reading, name, item) else f"{fact(name, item)}: it moved"
    if item is None:
        return f"{label(name)} stayed within its noise"
    if predicate.move and predicate.move != ("up" if item.direction == "+" else "down"):
        return f"{fact(name, item)}: the other way"
    for quantity in predicate.quantities:
        if not _fits(quantity, item, predicate.move):
            return f"{fact(name, item)}: another number"
    return ""


def _kept_still(reading: Reading, name: str, item: Evidence | None) -> bool:
    """Within noise, or a trace so small that the verdict allows or overlooks it."""
    if item is None:
        return True
    check = next((c for c in reading.case.top.finding.checks if c.channel == name), None)
    if check is None or check.expected is None or reading.kind == "row":
        return False
    return check.verdict == "faint" or (check.verdict == "agrees" and check.expected.sign == "0")


def _fits(quantity: Quantity, item: Evidence, move: Move | None) -> bool:
    """Whether a number is the size of an item of evidence, in its unit or in σ."""
    value = item.sigma if quantity.unit == "sigma" else item.value
    if quantity.low != quantity.high:
        low, high = sorted((quantity.low, quantity.high))
        if not quantity.signed and low >= 0.0:
            value = abs(value)
        slack = max(quantity.step, VALUE_TOLERANCE * abs(value))
        return low - slack <= value <= high + slack
    written = quantity.low
    if quantity.unit == "sigma" or not quantity.signed:
        written, value = abs(written), abs(value)
    return abs(written - value) <= max(quantity.step, VALUE_TOLERANCE * abs(value)) * (1 + 1e-9)


def _range_fits(claim: ChannelClaim, predicate: Predicate, moved: dict[str, Evidence]) -> bool:
    """Whether the ends of a measured range are the least and the most of its channels."""
    items = [moved[name] for name in claim.channels if name in moved]
    for quantity in predicate.quantities:
        if quantity.low == quantity.high or not items:
            continue
        values = [item.sigma if quantity.unit == "sigma" else item.value for item in items]
        if not quantity.signed and min(quantity.low, quantity.high) >= 0.0:
            values = [abs(value) for value in values]
        for written, value in zip(
            sorted((quantity.low, quantity.high)), (min(values), max(values)), strict=True
        ):
            if abs(written - value) > max(quantity.step, VALUE_TOLERANCE * abs(value)) * (1 + 1e-9):
                return False
    return True


def _expectation(reading: Reading, claim: ChannelClaim, predicate: Predicate) -> Checked:
    """What is said against what the modes in question predict."""
    subject = _subject_of(reading)
    failures = []
    for candidate in subject:
        signature = _signature(candidate)
        judged = [
            _expected(reading, candidate, name, signature.get(name), predicate)
            for name in claim.channels
        ]
        if all(not text for text in judged) or (not claim.exact and not all(judged)):
            moved = strongest(reading.case.evidence)
            cited = tuple(name for name in claim.channels if name in moved)
            return Checked(True, "sensor", f"{candidate.mode.name} predicts it", channels=cited)
        failures += [text for text in judged if text]
    return Checked(False, "sensor", failures[0])


def _subject_of(reading: Reading) -> list[Candidate]:
    """Whose predictions a sentence quotes: the modes it names, else its subject."""
    case = reading.case
    named = [item.mode for item in reading.modes if item.mode in case.weighed]
    if reading.section.quotable == "work order":
        return list(case.work_order)
    chosen = named or [reading.subject]
    if reading.section.quotable == "verdict" and not named:
        chosen = [item.mode.id for item in case.open_verdicts]
    return [case.weighed[mode] for mode in chosen]


def _expected(
    reading: Reading,
    candidate: Candidate,
    name: str,
    expected: ExpectedShift | None,
    predicate: Predicate,
) -> str:
    mode = candidate.mode
    if expected is None:
        return "" if predicate.move == "still" else f"{mode.name} says nothing of {label(name)}"
    if predicate.move == "still" and expected.sign in ("+", "-"):
        return f"{mode.name} moves {label(name)}"
    up, down = expected.high > 0.0, expected.low < 0.0
    if expected.sign == "0" and predicate.move in ("up", "down"):
        return f"{mode.name} leaves {label(name)} alone"
    if (predicate.move == "up" and not up) or (predicate.move == "down" and not down):
        return f"{mode.name} moves {label(name)} the other way"
    for quantity in predicate.quantities:
        if not (_within(quantity, expected) or is_known(quantity, [candidate])):
            return f"{mode.name} takes {label(name)} from {expected.low:g} to {expected.high:g}"
    return ""


def _within(quantity: Quantity, expected: ExpectedShift) -> bool:
    """Whether a predicted number, or both ends of a range, are those of the knowledge base."""
    if quantity.unit == "sigma":
        return False
    ends = {round(abs(expected.low), 6), round(abs(expected.high), 6)}
    low, high = (round(abs(value), 6) for value in (quantity.low, quantity.high))
    if quantity.low != quantity.high:
        return {low, high} == ends
    return min(ends) <= low <= max(ends)


def times_of(item: Evidence) -> list[float]:
    """Every moment that an item of evidence holds."""
    return [
        time_s
        for time_s in (item.start_s, item.end_s, item.onset_s, item.settled_s)
        if time_s is not None
    ]


def check_times(reading: Reading) -> Iterator[Checked]:
    """Whether the times named are those of the onset, the evidence or the verdict."""
    case = reading.case
    named = {name for mention in reading.channels for name in mention.channels}
    items = [item for item in case.evidence if item.channel in named] or list(case.evidence)
    known = [time_s for item in items for time_s in times_of(item)]
    known += [case.diagnosis.onset_s] if case.diagnosis.onset_s is not None else []
    done = [item.time_s for item in case.diagnosis.interventions]
    if re.search(r"\bwindows?\b", reading.text, re.IGNORECASE):
        known = [case.stands_since_s] if case.stands_since_s is not None else []
        known += [item.first_s for item in case.later]
    elif re.search(r"\b(?:repair\w*|targets?|ground)\b", reading.text, re.IGNORECASE) and not named:
        known = done
    elif (
        re.search(r"\b(?:parts?|departs?|onset|began|begins?|started)\b", reading.text)
        and not named
    ):
        known = [case.diagnosis.onset_s] if case.diagnosis.onset_s is not None else []
    for mention in reading.times:
        right = any(abs(mention.time_s - time_s) <= TIME_TOLERANCE_S for time_s in known)
        yield Checked(right, "sensor", f"{reading.text[mention.start : mention.end]} of the flight")

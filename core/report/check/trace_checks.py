"""Checks that every number and every technical word of a sentence has a source."""

import re
from collections.abc import Iterator, Sequence

from core.knowledge.lexicon import COVERED, known_terms, stems, terms
from core.report.check.channel_checks import TIME_TOLERANCE_S, times_of
from core.report.check.claims import ChannelClaim
from core.report.check.known import passages, vocabulary
from core.report.check.mentions import Quantity, quantities
from core.report.check.reading import Checked, Reading, is_known
from core.report.check.verdict_checks import owner_of

_RATING = re.compile(
    r"\b(severity|occurrence|detection|RPN)\s*(?:of|is|:|=)?\s*(\d+)", re.IGNORECASE
)
_FOUND_OF = re.compile(r"\b(\d+)\s+of\s+(?:the\s+)?(\d+)\b")
_COUNTED = re.compile(
    r"\s*(?:more\b|others?\b|of\b|channels?\b|sensors?\b|flights?\b|cylinders?\b|steps?\b|"
    r"candidates?\b|conflicts?\b|sections?\b|heads?\b|probes?\b|items?\b)",
    re.IGNORECASE,
)


def check_numbers(reading: Reading, claims: Sequence[ChannelClaim]) -> Iterator[Checked]:
    """Whether every other number can be traced: ratings, counts, times in seconds, knowledge."""
    spoken = {
        (item.start, item.end)
        for claim in claims
        for predicate in claim.predicates
        for item in predicate.quantities
    }
    rated = list(_ratings(reading))
    yield from (checked for checked, _ in rated)
    spoken |= {span for _, spans in rated for span in spans}
    for item in reading.quantities:
        inside = any(start <= item.start and item.end <= end for start, end in spoken)
        if inside or _is_probability(reading, item) or _counts(reading, item):
            continue
        if _counts_windows(reading, item) or _is_target(reading, item):
            yield Checked(True, "verdict", "as it was flown")
            continue
        said = reading.text[item.start : item.end].strip()
        if is_known(item, reading.focus):
            yield Checked(True, "knowledge", f"{said} is known")
        elif item.unit in ("s", "min") and _is_time(reading, item):
            yield Checked(True, "sensor", "a time of this flight")
        else:
            yield Checked(False, "knowledge", f"{said} has no source", "unsupported")


def _ratings(reading: Reading) -> Iterator[tuple[Checked, list[tuple[int, int]]]]:
    """FMEA ratings and counts of confirmed shifts, with the places of their numbers."""
    mode = reading.case.weighed[reading.subject].mode
    named = [item.mode for item in reading.modes if item.mode in reading.case.weighed]
    if named:
        mode = reading.case.weighed[named[0]].mode
    for hit in _RATING.finditer(reading.text):
        if hit[1].casefold() == "severity" and "rating" not in reading.text.casefold():
            continue
        actual = getattr(mode, hit[1].casefold())
        said = f"{hit[1].casefold()} of {mode.name} is rated {actual}"
        yield Checked(int(hit[2]) == actual, "knowledge", said), [hit.span(2)]
    finding = reading.case.top.finding
    for hit in _FOUND_OF.finditer(reading.text):
        if not re.search(r"\b(?:shifts?|channels?|expected|predicted)\b", reading.text):
            continue
        confirmed, predicted = len(finding.confirmed), len(finding.predicted)
        right = (int(hit[1]), int(hit[2])) == (confirmed, predicted)
        said = f"{confirmed} of {predicted} expected shifts found"
        yield Checked(right, "sensor", said), [hit.span(1), hit.span(2)]
    if "FMEA rating (1-10)" in reading.text:
        place = reading.text.index("1-10")
        yield Checked(True, "knowledge", "the scale of the ratings"), [(place, place + 4)]


def _is_probability(reading: Reading, item: Quantity) -> bool:
    if item.unit == "points":
        return bool(re.match(r"\s*ahead", reading.text[item.end :]))
    return item.unit == "%" and owner_of(reading, item) is not None


def _counts(reading: Reading, item: Quantity) -> bool:
    """Whether a bare whole number merely counts things."""
    whole = not item.unit and item.low == item.high and item.low in range(24)
    return whole and bool(_COUNTED.match(reading.text[item.end :]))


def _counts_windows(reading: Reading, item: Quantity) -> bool:
    """Whether a number counts later windows, all of them or those that name a class."""
    if item.unit or not re.search(r"\bwindows?\b", reading.text):
        return False
    return any(item.low in (each.windows, each.of) for each in reading.case.later)


def _is_target(reading: Reading, item: Quantity) -> bool:
    """Whether a number is one that the crew was given on the way."""
    return any(
        item.low == target.low and item.unit == target.unit
        for done in reading.case.diagnosis.interventions
        for target in quantities(done.targets, ())
    )


def _is_time(reading: Reading, item: Quantity) -> bool:
    scale = 60.0 if item.unit == "min" else 1.0
    known = [value for evidence in reading.case.evidence for value in times_of(evidence)]
    if reading.case.diagnosis.onset_s is not None:
        known.append(reading.case.diagnosis.onset_s)
    return all(
        any(abs(scale * end - value) <= TIME_TOLERANCE_S for value in known)
        for end in (item.low, item.high)
    )


def check_terms(reading: Reading, *, traced: bool) -> Iterator[Checked]:
    """Whether the technical words are those of the modes in question, and of one passage."""
    said = terms(_without(reading).replace(reading.case.diagnosis.model, ""))
    if not said:
        return
    focus = reading.focus
    known = frozenset[str]().union(*(vocabulary(item.mode.id) for item in focus))
    if strange := sorted(said - known_terms(said, known)):
        words = _as_written(reading.text, strange)
        where = ", ".join(item.mode.name for item in focus[:3])
        reason = f"{words}: nothing in the evidence or in the knowledge of {where}"
        yield Checked(False, "knowledge", reason, "unsupported")
        return
    best = max(
        (item for mode in focus for item in passages(mode.mode.id)),
        key=lambda item: len(known_terms(said, item.terms)),
    )
    share = len(known_terms(said, best.terms)) / len(said)
    if share > COVERED or (traced and len(said) <= 2):
        yield Checked(True, "knowledge", f"knowledge of {best.mode}, {best.kind}", quote=None)
    else:
        yield Checked(
            False, "knowledge", "no single statement of the knowledge base says this", "unsupported"
        )


def _without(reading: Reading) -> str:
    """The text without the names that were read as channels, cylinders and modes."""
    text = reading.text
    spans = [(item.start, item.end) for item in reading.channels]
    spans += [(item.start, item.end) for item in reading.cylinders]
    spans += [(item.start, item.end) for item in reading.modes]
    spans += [(item.start, item.end) for item in reading.quantities]
    for start, end in spans:
        text = f"{text[:start]}{' ' * (end - start)}{text[end:]}"
    return text


def _as_written(text: str, strange: Sequence[str]) -> str:
    words = [word.strip(".,;:()\"'") for word in text.split()]
    chosen = [word for word in words if set(stems(word)) & set(strange)]
    return ", ".join(f"'{word}'" for word in dict.fromkeys(chosen))

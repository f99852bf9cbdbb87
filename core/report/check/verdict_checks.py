"""Checks of claims about the verdict: which mode, how probable, at which cylinder."""

import re
from collections.abc import Iterator

from core.knowledge.lexicon import lexicon
from core.report.check.mentions import Quantity
from core.report.check.reading import Checked, Reading, is_known
from core.units import percent

_MEASURE_WORD = re.compile(
    r"\b(?:probabilit\w+|confidence|likelihood|classifier|gives|certain\w*|chance)\b", re.IGNORECASE
)
_ELSEWHERE = re.compile(r"\b(?:records|unlike|others?|neighbour\w*)\b[^.;]{0,60}$", re.IGNORECASE)


def check_modes(reading: Reading) -> Iterator[Checked]:
    """Whether the modes named are candidates, as probable as said, and the verdict is it."""
    case = reading.case
    for mention in reading.modes:
        if mention.mode not in case.weighed and not reading.names(
            reading.text[mention.start : mention.end]
        ):
            yield Checked(False, "verdict", f"{mention.mode} is not a candidate here")
    yield from _probabilities(reading)
    if reading.section.id != "conclusion" or not reading.modes or _has_percent(reading):
        return
    verdicts = {item.mode.id for item in case.open_verdicts}
    named = {item.mode for item in reading.modes} & set(case.weighed)
    if lexicon().rival.search(reading.text):
        return
    if named and not named & verdicts:
        yield Checked(False, "verdict", f"the diagnosis is {case.top.mode.name}", concludes=True)
    elif named and case.top.mode.id in named:
        yield Checked(True, "verdict", f"the diagnosis is {case.top.mode.name}", concludes=True)


def _has_percent(reading: Reading) -> bool:
    return any(item.unit == "%" for item in reading.quantities)


def _probabilities(reading: Reading) -> Iterator[Checked]:
    case = reading.case
    for item in reading.quantities:
        if item.unit == "points" and re.match(r"\s*ahead", reading.text[item.end :]):
            right = abs(item.low - 100.0 * case.margin) <= 1.0 + 1e-6
            yield Checked(right, "verdict", f"the lead is {100.0 * case.margin:.0f} points")
        if item.unit != "%":
            continue
        mode = owner_of(reading, item)
        if mode is None:
            continue
        actual = case.weighed[mode].probability
        if _probability_fits(reading.text, item, actual):
            concludes = mode == case.top.mode.id and reading.section.id == "conclusion"
            said = f"the classifier gives {mode} {percent(actual)}"
            yield Checked(True, "verdict", said, concludes=concludes)
        elif not is_known(item, reading.focus) or _MEASURE_WORD.search(reading.text):
            said = f"the classifier gives {mode} {percent(actual)}"
            yield Checked(False, "verdict", said, concludes=mode == case.top.mode.id)


def owner_of(reading: Reading, item: Quantity) -> str | None:
    """The mode whose probability a percentage claims to be; None if it is something else."""
    text = reading.text
    start = max(text.rfind(mark, 0, item.start) for mark in (",", ";", ". ")) + 1
    stops = [place for mark in (",", ";") if (place := text.find(mark, item.end)) >= 0]
    end = min([*stops, len(text)])
    known = [mention for mention in reading.modes if mention.mode in reading.case.weighed]
    before = [mention for mention in known if mention.start < item.start]
    after = [mention for mention in known if item.end <= mention.start < end]
    if before and (before[-1].start >= start or not after):
        return before[-1].mode
    if after:
        return after[0].mode
    return reading.subject if _MEASURE_WORD.search(text) else None


def _probability_fits(text: str, item: Quantity, actual: float) -> bool:
    lead = text[max(0, item.start - 12) : item.start].casefold()
    value = item.low / 100.0
    if re.search(r"(?:under|below|less than|<)\s*$", lead):
        return actual <= value
    if re.search(r"(?:over|above|more than|at least|>)\s*$", lead):
        return actual >= value
    return abs(actual - value) <= 0.01 + 1e-6 or (value <= 0.01 and actual < 0.015)


def check_cylinders(reading: Reading) -> Iterator[Checked]:
    """Whether a fault is put where the evidence has it."""
    case = reading.case
    allowed = case.cylinders
    for mention in reading.cylinders:
        wrong = [cylinder for cylinder in mention.cylinders if cylinder not in allowed]
        if not wrong:
            yield Checked(True, "verdict", f"cylinder {mention.cylinders[0]} by the evidence")
            continue
        before = reading.text[: mention.start]
        if _ELSEWHERE.search(before) or lexicon().still.search(reading.text):
            continue
        said = f"cylinder {min(allowed)}" if allowed else "no cylinder"
        yield Checked(False, "verdict", f"the evidence points to {said}")

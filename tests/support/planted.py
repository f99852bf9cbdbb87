"""True sentences about a case in many words, and the errors that a bad writer would plant in them.

The true ones are the template's own and paraphrases as language models write them, filled in from
the evidence. `plant` changes one fact of a true sentence so that it is false.
"""

import random
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from core.channels import CHANNEL_NAMES, channel, unit_label
from core.clock import clock
from core.cylinders import CYLINDERS
from core.diagnosis.diagnosis import Evidence
from core.fmea.catalogue import class_ids
from core.knowledge.knowledge import knowledge
from core.report.case.case import Case
from core.report.case.findings import strongest
from core.report.case.wording import expectation, label, shift, with_cylinder
from core.report.check.mentions import channel_mentions, quantities, time_mentions
from core.report.sections import SECTIONS
from core.report.sentences import Sentence, sentences
from core.units import percent

KINDS = ("channel", "direction", "number", "mode", "part", "cylinder")

INVENTED_PARTS = (
    "turbocharger", "wastegate", "alternator", "camshaft", "propeller governor", "fuel injector",
    "intercooler", "starter motor", "vacuum pump", "landing gear strut", "radiator", "thermostat",
    "fuel pump diaphragm", "timing belt", "catalytic converter", "gearbox", "flywheel", "wing spar",
    "hydraulic actuator", "compressor blade", "turbine disc", "ignition coil pack", "water pump",
    "aileron hinge", "spinner bulkhead", "clutch", "transponder", "pitot mast", "brake caliper",
    "supercharger", "coolant hose", "glow plug", "elevator trim tab", "firewall grommet",
    "crank sensor", "knock sensor", "throttle body", "mass airflow meter", "EGR solenoid",
    "muffler",
)  # fmt: skip

_UP = ("rose by", "increased by", "climbed by", "was up by")
_DOWN = ("fell by", "dropped by", "decreased by", "was down by")
_FLIP = {
    "rose": "fell", "fell": "rose", "increased": "decreased", "decreased": "increased",
    "climbed": "dropped", "dropped": "climbed", "rise": "fall", "fall": "rise",
    "rising": "falling", "falling": "rising", "up": "down", "down": "up", "higher": "lower",
    "lower": "higher", "increase": "decrease", "decrease": "increase", "rises": "falls",
    "falls": "rises", "warms": "cools", "climbs": "drops", "warm": "cool", "drops": "climbs",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Line:
    """A true sentence of ``section``."""

    section: str
    text: str


def template_lines(case: Case) -> list[Line]:
    """Every statement of the template's report."""
    return [
        Line(part.title, item.markdown if item.cells else item.text)
        for part in SECTIONS
        for item in part.write(case)
    ]


def paraphrases(case: Case, rng: random.Random) -> list[Line]:
    """The facts of a case in the words of language models."""
    lines = [Line("Conclusion", text) for text in _conclusions(case)]
    moved = list(strongest(case.evidence).values())
    for item in rng.sample(moved, min(6, len(moved))):
        lines += [Line("Evidence cross-check", text) for text in _measured(case, item, rng)]
    still = [name for name in CHANNEL_NAMES if name not in strongest(case.evidence)]
    for name in rng.sample(still, min(2, len(still))):
        lines += [Line("Evidence cross-check", text) for text in _quiet(name)]
    lines += [Line("Differential diagnosis", text) for text in _rivals(case)]
    lines += [Line("Mechanism", text) for text in _mechanics(case)]
    lines += [Line("Maintenance", text) for text in _actions(case)]
    return lines


def _conclusions(case: Case) -> Iterator[str]:
    name, odds = case.top.mode.name, percent(case.top.probability)
    yield f"The most likely diagnosis is {name.lower()}, with a probability of {odds}."
    yield f"The classifier assigns {odds} to {name}."
    yield f"Based on the evidence, the primary fault is {name.lower()}."
    if case.diagnosis.onset_s is not None:
        yield f"The deviation began at about {clock(case.diagnosis.onset_s)} into the flight."
        yield f"The onset is estimated at {case.diagnosis.onset_s:.0f} s."
    if case.hit and case.hit.clear and case.top.mode.names_cylinder:
        yield f"The evidence points to cylinder {case.hit.cylinder} as the location of the fault."


def _measured(case: Case, item: Evidence, rng: random.Random) -> Iterator[str]:
    unit = unit_label(item.unit)
    verb = rng.choice(_UP if item.value > 0 else _DOWN)
    noun = "rise" if item.value > 0 else "fall"
    digits = channel(item.channel).decimals
    size = f"{abs(item.value):.{digits}f} {unit}"
    if float(size.split()[0]) == 0.0:
        size = shift(item).lstrip("+-")
    name = label(item.channel)
    yield f"{name} {verb} {size} relative to the healthy mirror."
    yield f"Between {clock(item.start_s)} and {clock(item.end_s)}, {name} {verb} {size}."
    yield f"We observed a {noun} of {size} in {name}, which is {abs(item.sigma):.1f} σ."
    yield f"{name} shows a clear {noun}, starting at {clock(item.onset_s)}."
    if probe := re.fullmatch(r"E1 (CHT|EGT)(\d)", item.channel):
        long = "cylinder head" if probe[1] == "CHT" else "exhaust gas"
        yield f"The {long} temperature of cylinder {probe[2]} {verb} {size}."
    expected = case.top.mode.signature(case.top.finding.cylinder).get(item.channel)
    if expected is not None and expected.sign in ("+", "-"):
        words = expectation(expected, item.channel)
        yield f"With {case.top.mode.name}, {name} should {words}."


def _quiet(name: str) -> Iterator[str]:
    yield f"{label(name)} stayed within its noise throughout the flight."
    yield f"There was no change in {label(name)}."
    yield f"{label(name)} remained stable and shows no anomaly."


def _rivals(case: Case) -> Iterator[str]:
    for rival in case.candidates[1:]:
        odds = percent(rival.probability)
        yield f"{rival.mode.name} is less likely, with a probability of {odds}."
        for check in rival.finding.having("missing")[:2]:
            assert check.expected is not None
            words = expectation(check.expected, check.channel)
            yield (
                f"If it were {rival.mode.name}, {label(check.channel)} should {words}, "
                "but it stayed within noise."
            )


def _mechanics(case: Case) -> Iterator[str]:
    cylinder = case.cylinder_of(case.top.mode)
    for step in case.top.mode.chain:
        text = with_cylinder(step.text, cylinder)
        yield f"According to the causal chain, {text[0].lower()}{text[1:]}"
    for name, expected in case.top.mode.signature(case.top.finding.cylinder).items():
        if expected.sign in ("+", "-"):
            yield f"As a result, {label(name)} {'rises' if expected.sign == '+' else 'falls'}."


def _actions(case: Case) -> Iterator[str]:
    for candidate in case.work_order:
        for action in candidate.mode.actions:
            text = with_cylinder(action, case.cylinder_of(candidate.mode))
            first = sentences(text)[0].plain.rstrip(".")
            yield f"We recommend the following: {first[0].lower()}{first[1:]}."


def plant(kind: str, line: Line, case: Case, rng: random.Random) -> str | None:
    """``line`` with one error of a kind (of `KINDS`), or None where it has nothing to falsify."""
    planters: dict[str, Callable[[Line, Case, random.Random], str | None]] = {
        "channel": _wrong_channel,
        "direction": _wrong_direction,
        "number": _wrong_number,
        "mode": _wrong_mode,
        "part": _invented_part,
        "cylinder": _wrong_cylinder,
    }
    text = planters[kind](line, case, rng)
    return None if text == line.text else text


def _is_measured(line: Line) -> bool:
    return line.section in ("Conclusion", "Evidence cross-check") and "should" not in line.text


def _wrong_channel(line: Line, case: Case, rng: random.Random) -> str | None:
    """Something measured said of a channel that never moved."""
    if not _is_measured(line) and not line.text.startswith("|"):
        return None
    moved = strongest(case.evidence)
    still = [name for name in CHANNEL_NAMES if name not in moved]
    mentions = [item for item in channel_mentions(line.text) if set(item.channels) <= set(moved)]
    if not mentions or not still:
        return None
    victim = rng.choice(mentions)
    return line.text[: victim.start] + label(rng.choice(still)) + line.text[victim.end :]


def _wrong_direction(line: Line, case: Case, rng: random.Random) -> str | None:
    """A move turned round, in words or by its sign."""
    if not channel_mentions(line.text):
        return None
    words = [hit for hit in re.finditer(r"[A-Za-z]+", line.text) if hit[0] in _FLIP]
    if words and _is_measured(line):
        victim = rng.choice(words)
        return line.text[: victim.start()] + _FLIP[victim[0]] + line.text[victim.end() :]
    signs = list(re.finditer(r"(?<=[ (])[+-](?=\d)", line.text.split("should")[0].split("keep")[0]))
    if not signs or line.section == "Differential diagnosis":
        return None
    sign = rng.choice(signs)
    return line.text[: sign.start()] + ("-" if sign[0] == "+" else "+") + line.text[sign.end() :]


def _wrong_number(line: Line, case: Case, rng: random.Random) -> str | None:
    """A number or time moved by a quarter or more."""
    channels = channel_mentions(line.text)
    numbers = [
        item
        for item in quantities(line.text, channels)
        if item.unit not in ("", "%") and item.low == item.high and item.low
    ]
    times = time_mentions(line.text)
    if not numbers and not times:
        return None
    pick = rng.choice([*numbers, *times])
    text = line.text[pick.start : pick.end]
    if pick in times:
        wrong = clock(pick.time_s + rng.uniform(12.0, 90.0))
        return line.text[: pick.start] + wrong + line.text[pick.end :]
    digits = re.search(r"\d+(?:\.\d+)?", text)
    assert digits is not None
    places = len(digits[0].partition(".")[2])
    value = float(digits[0]) * rng.choice((0.5, 0.7, 1.4, 2.0, 3.0))
    wrong = f"{value:.{places}f}"
    if abs(float(wrong) - float(digits[0])) < max(0.25 * float(digits[0]), 1.1 * 10.0**-places):
        return None
    start = pick.start + digits.start()
    return line.text[:start] + wrong + line.text[start + len(digits[0]) :]


def _wrong_mode(line: Line, case: Case, rng: random.Random) -> str | None:
    """Another mode: one that is no candidate, or in the conclusion any but the verdict."""
    present = [
        mode
        for mode in case.weighed.values()
        if re.search(rf"{re.escape(mode.mode.name)}\b", line.text)
    ]
    if not present or case.is_close:
        return None
    victim = rng.choice(present).mode.name
    others = [mode for mode in class_ids() if mode not in case.weighed and mode != "nominal"]
    return line.text.replace(victim, knowledge()[rng.choice(others)].name)


def _invented_part(line: Line, case: Case, rng: random.Random) -> str | None:
    """A part that no such engine has, or that has nothing to do with the fault."""
    known = " ".join(
        text
        for item in case.weighed.values()
        for text in (item.mode.summary, item.mode.mechanism, *item.mode.actions)
    ).lower()
    part = rng.choice([name for name in INVENTED_PARTS if name.split()[0] not in known])
    if line.section == "Maintenance":
        nouns = list(re.finditer(r"\b(?:the|a|an|each|every) ([a-z-]+)", line.text))
        if nouns:
            victim = rng.choice(nouns)
            return line.text[: victim.start(1)] + part + line.text[victim.end(1) :]
        return f"Replace the {part} before further flight."
    if line.section == "Mechanism" and not line.text.startswith("("):
        return f"{line.text.rstrip('. ')} because the {part} has failed."
    if line.section == "Evidence cross-check" and not line.text.startswith("|"):
        return f"{line.text.rstrip('. ')}, which points to the {part}."
    return None


def _wrong_cylinder(line: Line, case: Case, rng: random.Random) -> str | None:
    """A true sentence moved to a cylinder that the fault spares."""
    if case.hit is None or not case.hit.clear or not case.top.mode.names_cylinder:
        return None
    hit = re.search(rf"\b(?P<lead>[Cc]ylinder|CHT|EGT) {case.hit.cylinder}\b(?!-)", line.text)
    wrong = [cylinder for cylinder in CYLINDERS if cylinder not in case.cylinders]
    if hit is None or not wrong or "should" in line.text[: hit.start()]:
        return None
    if hit["lead"] in ("CHT", "EGT") and not (_is_measured(line) or line.text.startswith("|")):
        return None
    cylinder = rng.choice(wrong)
    other = f"E1 {hit['lead']}{cylinder}"
    moved = strongest(case.evidence)
    if hit["lead"] in ("CHT", "EGT"):
        if other in moved and not re.search(r"\d [°σ]", line.text):
            return None  # that head moved too: the sentence might stay true
        own, twin = moved.get(f"E1 {hit['lead']}{case.hit.cylinder}"), moved.get(other)
        if own and twin and abs(twin.value - own.value) < 0.25 * abs(own.value):
            return None
    text = line.text[: hit.end() - 1] + str(cylinder) + line.text[hit.end() :]
    return re.sub(r" \((?:right|left) (?:front|rear)\)", "", text)


def as_sentence(line: Line, text: str) -> Sentence:
    """A planted text as the checker takes it."""
    kind = "row" if text.startswith("|") else "paragraph"
    return Sentence(text, kind, "", 0, first=False)  # type: ignore[arg-type]

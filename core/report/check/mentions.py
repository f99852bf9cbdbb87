"""Mentions of channels, cylinders, modes, quantities and times in a text, with their positions.

Nothing here knows what was measured.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from core.channels import CHANNEL_NAMES, cht_name, egt_name
from core.cylinders import CYLINDERS, LAYOUT, row
from core.errors import InputError
from core.knowledge.lexicon import Pattern, lexicon


@dataclass(frozen=True, slots=True)
class ChannelMention:
    """Channels named at ``start`` to ``end``.

    ``exact``: the text names these channels. Otherwise it names a kind of probe ("its EGT", "CHT"),
    and what it says holds if it holds for one of them.
    """

    channels: tuple[str, ...]
    exact: bool
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class CylinderMention:
    """Cylinders named outside any channel."""

    cylinders: tuple[int, ...]
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class ModeMention:
    """A failure mode named by its name or one of its other names."""

    mode: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number, or a range from ``low`` to ``high``, with its unit as the channels write it.

    ``unit`` is "" where none is written; ``signed`` whether a sign is; ``step`` is half of the last
    digit written, the least by which rounding may move the number.
    """

    low: float
    high: float
    unit: str
    signed: bool
    step: float
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class TimeMention:
    """A time of flight, in seconds; ``step`` is what rounding may move it by."""

    time_s: float
    step: float
    start: int
    end: int


_PLACES = {place.name: cylinder for cylinder, place in LAYOUT.items()}
_DIGIT = f"[{''.join(map(str, CYLINDERS))}]"
_DIGITS = (
    rf"{_DIGIT}(?!\d|\.\d|:\d)(?:[-–]{_DIGIT}(?!\d|\.\d|:\d)|\s(?:to|through)\s{_DIGIT}(?!\d|\.\d)"
    rf"|(?:\s*,\s*(?:and\s+)?|\s+(?:and|or|&)\s+|\s*/\s*){_DIGIT}"
    r"(?!\d|\.\d|:\d|\s*(?:°|psi|rpm|gph|gal)))*"
)
_KIND = (
    r"(?P<kind>(?:E1 )?CHTs?|(?:E1 )?EGTs?|(?:cylinder[- ])?head temperatures?|"
    r"exhaust(?:[- ]gas)? temperatures?)"
)
_OF_CYLINDER = (
    r"(?:(?:of|for|at|on|in|from)\s+)?(?:the\s+)?(?:cylinders?\s*|cyl\.?\s*|No\.?\s*|#\s*)*"
)
_NUMBERED = re.compile(
    rf"{_KIND}s?\s*(?:readings?\s*)?\(?{_OF_CYLINDER}(?P<digits>{_DIGITS})(?![\d])\)?",
    re.IGNORECASE,
)
_CYLINDER_FIRST = re.compile(
    rf"(?:cylinders?\s*|No\.?\s*|#\s*)+(?P<digits>{_DIGITS})(?:'s|’s)?\s*(?:\([a-z ]+\)\s*)?"
    rf"{_KIND}",
    re.IGNORECASE,
)
_UNNUMBERED = re.compile(
    rf"(?P<quantifier>(?:all|every|each|both|other|others'|four|front|rear|remaining|the)\s+)*{_KIND}",
    re.IGNORECASE,
)
_WORDY_PROBES = re.compile(
    r"(?P<quantifier>\b(?:all|every|each|both|other|four|front|rear|that|its|one|the other)\s+)+"
    r"(?P<kind>heads?|exhausts?)\b",
    re.IGNORECASE,
)
_CYLINDERS = re.compile(
    rf"\b(?:cylinders?|cyl\.?|No\.)\s*#?\s*(?P<digits>{_DIGITS})(?!\d)|#(?P<hash>{_DIGIT})\b",
    re.IGNORECASE,
)
_PLACE = re.compile(rf"\b(?:{'|'.join(_PLACES)})\b", re.IGNORECASE)

CHANNEL_WORDS: dict[str, str] = {
    "volt1": r"main bus(?: voltage)?|volt1",
    "volt2": r"essential bus(?: voltage)?|volt2",
    "amp2": r"standby battery current|amp2",
    "amp1": r"(?:main )?battery current|amp1",
    "FQtyL": r"(?:fuel left|left (?:fuel )?(?:tank|quantity)|FQtyL)",
    "FQtyR": r"(?:fuel right|right (?:fuel )?(?:tank|quantity)|FQtyR)",
    "E1 FFlow": r"(?:E1 )?FFlow|fuel[- ]flow",
    "E1 OilT": r"(?:E1 )?OilT|oil[- ]temp(?:erature|\.)?s?",
    "E1 OilP": r"(?:E1 )?OilP|oil[- ]pressures?",
    "E1 RPM": r"(?<!\d )(?<!\d)(?:E1 )?RPM|engine speed",
    "OAT": r"OAT|outside air(?: temperature)?",
    "IAS": r"IAS|(?:indicated )?airspeed",
    "VSpd": r"VSpd|vertical speed|(?:climb|descent) rate",
    "NormAc": r"NormAc|normal acceleration|load factor",
    "AltMSL": r"AltMSL|altitude(?! hold)",
}
"""How a text names each channel but the temperature probes, which are named by cylinder."""


_UNITS: dict[str, str] = {
    "degF": r"°\s?F|deg\.?\s?F|degrees?(?: F(?:ahrenheit)?)?|F\b",
    "degC": r"°\s?C|deg\.?\s?C|C\b",
    "psi": r"psi",
    "rpm": r"rpm",
    "gph": r"gph|gal/h|gallons per hour",
    "kt": r"kts?\b|knots?|KIAS",
    "fpm": r"fpm|ft/min|feet per minute",
    "ft": r"ft\b|feet",
    "%": r"%|percent\b|per cent\b",
    "sigma": r"σ|sigmas?|standard deviations?",
    "s": r"s\b|sec(?:onds?)?\b",
    "min": r"min(?:utes?)?\b",
    "V": r"V\b|volts?\b",
    "A": r"A\b(?= *[.,;)]| *$)|amps?\b",
    "gal": r"gal(?:lons?)?\b",
    "g": r"g\b",
    "points": r"(?:percentage )?points?\b",
}
_UNIT = "|".join(f"(?P<u{index}>{pattern})" for index, pattern in enumerate(_UNITS.values()))
_NUMBER = r"\d+(?:,\d{3})*(?:\.\d+)?(?:e[-+]?\d+)?"
_QUANTITY = re.compile(
    rf"(?<![\w.:/#-])(?P<sign>[+\-−–]\s?)?(?P<low>{_NUMBER})"
    rf"(?:(?:\s?(?:to|through)\s|(?<=\d)[-–](?=\d)|(?<=\d)\sand\s(?=\d[^a-z]*°))"
    rf"(?P<high_sign>[+\-−])?(?P<high>{_NUMBER}))?(?![\d:])(?:\s?-?(?:{_UNIT}))?",
    re.IGNORECASE,
)
_CLOCK = re.compile(
    r"(?<![\d:])(?:(?P<hours>\d):)?(?P<minutes>\d{1,3}):(?P<seconds>[0-5]\d)(?!\d|:\d)"
)


def channel_patterns(words: Mapping[str, str]) -> tuple[tuple[str, Pattern], ...]:
    """The pattern of each channel, from `CHANNEL_WORDS`.

    Raises `InputError` unless words and probes are together all channels.
    """
    probes = {name_of(cylinder) for name_of in (cht_name, egt_name) for cylinder in CYLINDERS}
    needed = set(CHANNEL_NAMES) - probes
    if missing := sorted(needed - words.keys()):
        raise InputError("CHANNEL_WORDS", f"has no words for {', '.join(missing)}")
    if unknown := sorted(words.keys() - needed):
        raise InputError("CHANNEL_WORDS", f"has words for {', '.join(unknown)}: no such channel")
    return tuple(
        (name, re.compile(rf"(?<![\w-])(?:{pattern})(?![\w])", re.IGNORECASE))
        for name, pattern in words.items()
    )


_CHANNEL_PATTERNS = channel_patterns(CHANNEL_WORDS)
"""Made at import, so that a channel without words stops the program and not a report."""


def cylinders_of(digits: str) -> tuple[int, ...]:
    """``"1-4"``, ``"1, 3 and 4"`` or ``"2"`` as cylinders."""
    found = [int(digit) for digit in re.findall(_DIGIT, digits)]
    if len(found) == 2 and re.search(r"[-–]|to|through", digits):
        return tuple(range(found[0], found[1] + 1))
    return tuple(dict.fromkeys(found))


def channel_mentions(text: str) -> list[ChannelMention]:
    """All channels that a text names, in order; overlapping readings resolve to the longest."""
    found = [*_numbered_probes(text), *_other_channels(text), *_unnumbered_probes(text)]
    taken: list[ChannelMention] = []
    for mention in sorted(found, key=lambda item: (not item.exact, item.start - item.end)):
        if all(mention.end <= other.start or mention.start >= other.end for other in taken):
            taken.append(mention)
    return sorted(taken, key=lambda item: item.start)


def _probe_names(kind: str, cylinders: tuple[int, ...]) -> tuple[str, ...]:
    name = egt_name if re.search(r"EGT|exhaust", kind, re.IGNORECASE) else cht_name
    return tuple(name(cylinder) for cylinder in cylinders)


def _numbered_probes(text: str) -> Iterator[ChannelMention]:
    for pattern in (_NUMBERED, _CYLINDER_FIRST):
        for hit in pattern.finditer(text):
            names = _probe_names(hit["kind"], cylinders_of(hit["digits"]))
            yield ChannelMention(names, True, hit.start(), hit.end())


def _other_channels(text: str) -> Iterator[ChannelMention]:
    for name, pattern in _CHANNEL_PATTERNS:
        for hit in pattern.finditer(text):
            yield ChannelMention((name,), True, hit.start(), hit.end())


def _unnumbered_probes(text: str) -> Iterator[ChannelMention]:
    for pattern in (_UNNUMBERED, _WORDY_PROBES):
        for hit in pattern.finditer(text):
            lead = text[hit.start() : hit.start("kind")].lower()
            cylinders = next((row(name) for name in ("front", "rear") if name in lead), CYLINDERS)
            exact = bool(re.search(r"\b(?:all|every|each|four|front|rear)\b", lead))
            exact = exact and "other" not in lead
            yield ChannelMention(
                _probe_names(hit["kind"], cylinders), exact, hit.start(), hit.end()
            )


def cylinder_mentions(text: str, channels: Sequence[ChannelMention]) -> list[CylinderMention]:
    """Cylinders named by number or place, apart from those that belong to a channel."""
    found = [
        CylinderMention(cylinders_of(hit["digits"] or hit["hash"]), hit.start(), hit.end())
        for hit in _CYLINDERS.finditer(text)
    ]
    found += [
        CylinderMention((_PLACES[hit[0].lower()],), hit.start(), hit.end())
        for hit in _PLACE.finditer(text)
    ]
    return sorted(
        (item for item in found if not _inside(item.start, item.end, channels)),
        key=lambda item: item.start,
    )


def mode_mentions(text: str) -> list[ModeMention]:
    """Failure modes that a text names; of overlapping readings the longest."""
    found = [
        ModeMention(mode, hit.start(), hit.end())
        for mode, pattern in lexicon().modes.items()
        for hit in pattern.finditer(text)
    ]
    taken: list[ModeMention] = []
    for mention in sorted(found, key=lambda item: item.start - item.end):
        if not _inside(mention.start, mention.end, taken):
            taken.append(mention)
    return sorted(taken, key=lambda item: item.start)


def quantities(text: str, skip: Sequence[ChannelMention | CylinderMention]) -> list[Quantity]:
    """The numbers of a text with their units, apart from those inside ``skip`` and clock times."""
    clocks = [hit.span() for hit in _CLOCK.finditer(text)]
    return [
        _quantity(hit)
        for hit in _QUANTITY.finditer(text)
        if not _inside(hit.start("low"), hit.end("low"), skip)
        and not any(start <= hit.start("low") < end for start, end in clocks)
    ]


def _quantity(hit: re.Match[str]) -> Quantity:
    units = list(_UNITS)
    unit = next((units[i] for i in range(len(units)) if hit[f"u{i}"] is not None), "")
    low = _number(hit["low"], hit["sign"])
    high = low
    if hit["high"] is not None:
        high = _number(hit["high"], hit["high_sign"])
    mantissa, _, exponent = hit["low"].partition("e")
    decimals = len(mantissa.partition(".")[2]) - int(exponent or 0)
    return Quantity(
        low=low,
        high=high,
        unit=unit,
        signed=hit["sign"] is not None and hit["sign"].strip() != "–",
        step=0.5 * 10.0**-decimals,
        start=hit.start(),
        end=hit.end(),
    )


def _number(digits: str, sign: str | None) -> float:
    value = float(digits.replace(",", ""))
    return -value if sign and sign.strip() in ("-", "−") else value


def time_mentions(text: str) -> list[TimeMention]:
    """Times of flight written as by `core.clock.clock`; seconds alone are quantities."""
    return [_time(hit) for hit in _CLOCK.finditer(text)]


def _time(hit: re.Match[str]) -> TimeMention:
    minutes = 60 * int(hit["hours"] or 0) + int(hit["minutes"])
    return TimeMention(60.0 * minutes + int(hit["seconds"]), 1.0, hit.start(), hit.end())


def _inside(
    start: int, end: int, mentions: Sequence[ChannelMention | CylinderMention | ModeMention]
) -> bool:
    return any(start < other.end and end > other.start for other in mentions)

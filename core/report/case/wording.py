"""Numbers, channels, cylinders and intervals as reports print them."""

import re
from collections.abc import Iterable

from core.channels import CHANNEL_NAMES, channel, cht_name, egt_name, unit_label
from core.clock import clock
from core.cylinders import CYLINDERS, LAYOUT, bank
from core.diagnosis.diagnosis import Evidence
from core.knowledge.knowledge import ExpectedShift

_PROBE_SETS = {
    f"{kind} {min(CYLINDERS)}-{max(CYLINDERS)}": tuple(map(name_of, CYLINDERS))
    for kind, name_of in (("CHT", cht_name), ("EGT", egt_name))
}
"""All probes of a kind, by the words that name them together."""

_MARKDOWN_SPECIALS = re.compile(r"([\\`*_{}\[\]#|~]|<(?! \d)|>(?! \d)|^>)")
"""What Markdown could act on; a comparison such as ``< 0.1 %`` is left as it is."""


def sigma(value: float) -> str:
    """A size in standard deviations of the sensor noise: one decimal below ten."""
    size = abs(value)
    return f"{size:.1f} σ" if size < 9.95 else f"{size:.0f} σ"


def cylinder_name(cylinder: int) -> str:
    """``cylinder 3 (right rear)``."""
    return f"cylinder {cylinder} ({LAYOUT[cylinder].name})"


def bank_name(cylinder: int) -> str:
    """The bank that a cylinder belongs to: ``right bank (cylinders 1 and 3)``."""
    return f"{LAYOUT[cylinder].side} bank (cylinders {' and '.join(map(str, bank(cylinder)))})"


def with_cylinder(text: str, cylinder: int | None) -> str:
    """Knowledge text with "the affected cylinder" named, where it is known."""
    if cylinder is None:
        return text
    return text.replace("The affected cylinder", f"Cylinder {cylinder}").replace(
        "the affected cylinder", f"cylinder {cylinder}"
    )


def label(name: str) -> str:
    """A channel as the pages call it: ``CHT 3``, ``Oil temperature``."""
    return channel(name).label


def labels(names: Iterable[str]) -> str:
    """Several channels in log order, ``CHT 1-4, Oil pressure``: full sets of probes merged."""
    rest = set(names)
    words: dict[str, str] = {}
    for merged, members in _PROBE_SETS.items():
        if rest.issuperset(members):
            rest.difference_update(members)
            words[members[0]] = merged
    words.update({name: label(name) for name in rest})
    return ", ".join(words[name] for name in CHANNEL_NAMES if name in words)


def unit_of(name: str) -> str:
    """The unit of a channel as printed."""
    return unit_label(channel(name).unit)


def shift(evidence: Evidence) -> str:
    """A residual with sign and unit, ``+18.3 °F``; never rounded to zero."""
    text = f"{evidence.value:+.{channel(evidence.channel).decimals}f}"
    if float(text) == 0.0 and evidence.value != 0.0:
        text = f"{evidence.value:+.1g}"
    return f"{text} {unit_of(evidence.channel)}"


def interval(evidence: Evidence) -> str:
    """From when to when the channel was away from its mirror, ``1:03-2:45``."""
    return f"{clock(evidence.start_s)}-{clock(evidence.end_s)}"


def moves(evidence: Iterable[Evidence]) -> list[str]:
    """What channels did in few words, ``CHT 3 +18.3 °F``; a full set of probes as one item."""
    rest = {item.channel: item for item in evidence}
    said = []
    for name in list(rest):
        group = next((each for each, probes in _PROBE_SETS.items() if name in probes), "")
        probes = _PROBE_SETS.get(group, ())
        if probes and rest.keys() >= set(probes):
            said.append(f"{group} {_spread([rest.pop(probe) for probe in probes])}")
        elif name in rest:
            said.append(f"{label(name)} {shift(rest.pop(name))}")
    return said


def _spread(items: list[Evidence]) -> str:
    """The shifts of one set of probes: one value if they print alike, else the range."""
    items = sorted(items, key=lambda item: item.value)
    lowest, highest = shift(items[0]), shift(items[-1])
    if lowest == highest:
        return lowest
    return f"{lowest.removesuffix(' ' + unit_of(items[0].channel))} to {highest}"


def size(expected: ExpectedShift, name: str) -> str:
    """How far a mode takes a channel, ``10 to 35 °F``, without its sign."""
    return f"{abs(expected.mild):g} to {abs(expected.severe):g} {unit_of(name)}"


def expectation(expected: ExpectedShift, name: str) -> str:
    """What a mode predicts for the channel ``name``: ``rise by 10 to 35 °F``, ``stay put``."""
    match expected.sign:
        case "+":
            return f"rise by {size(expected, name)}"
        case "-":
            return f"fall by {size(expected, name)}"
        case "0":
            return "stay put"
        case "~":
            low, high = (f"{end:+g}" if end else "0" for end in (expected.low, expected.high))
            return f"keep within {low} to {high} {unit_of(name)}"


def escaped(text: str) -> str:
    """Text with everything escaped that Markdown could act on."""
    return _MARKDOWN_SPECIALS.sub(r"\\\1", text)


def plain(text: str) -> str:
    """Text from elsewhere (a model's name, say) in one line, and escaped for Markdown."""
    return escaped(" ".join(text.split()))

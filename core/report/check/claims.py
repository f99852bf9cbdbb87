"""Claims of a sentence about channels: which moved, which way, how far, when; or stayed still.

A claim is measured ("CHT 3 rose by 18 °F") or expected of a mode ("oil pressure should fall").
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from core.channels import channel
from core.knowledge.lexicon import lexicon
from core.report.check.mentions import ChannelMention, Quantity, TimeMention

Move = Literal["up", "down", "still"]

_JOINED = re.compile(
    r"^\s*(?:\([^)]*\))?\s*(?:,|and|or|nor|&|/|,\s*and|,\s*or|as well as|together with)?"
    r"\s*(?:the|also|both|its|that)?\s*$"
)
_LEAD = re.compile(
    r"(?:(?:a|an|the|no|not|any|without|little|slight|small|large|clear|sharp|marked|further|only|"
    r"expected|predicted|observed|measured|mild|strong|significant|sustained|"
    r"corresponding|and|with|of)\s+)*"
    r"(?:shifts?|changes?|movement|deviation|rise|increase|drop|fall|decrease|decline|reduction|gain|"
    r"loss|climb|elevation|trace|higher|lower|elevated|reduced|increased|decreased|raised|lowered|"
    r"rising|falling|warmer|hotter|cooler|unchanged|normal|stable|quiet|raises|lowers|warms|cools|"
    r"heats|drops|reduces|increases|decreases)"
    r"(?:\s+(?:of|by)\s+[^,;:]*?(?=\s+(?:in|of|for|on|at|to)\b))?(?:\s+(?:in|of|for|on|at|to))?"
    r"(?:\s+(?:the|its|both))?\s*$",
    re.IGNORECASE,
)
_SEGMENT = re.compile(r";|:\s|\.\s|\||\(|\)")
_BARE = re.compile(r"(?:\b(?:by|of|about|roughly|around|approximately|some|to)|[+\-−])\s*$")


@dataclass(frozen=True, slots=True)
class Predicate:
    """One predicate of channels. ``quantities`` are in the channels' unit, in σ or without unit."""

    move: Move | None
    expected: bool
    quantities: tuple[Quantity, ...]

    @property
    def empty(self) -> bool:
        """Whether nothing was said."""
        return self.move is None and not self.quantities


@dataclass(frozen=True, slots=True)
class ChannelClaim:
    """Channels and all that a sentence says of them; ``predicates`` is empty for a bare mention.

    ``exact`` as in `ChannelMention`: whether it is said of every one of ``channels``.
    """

    channels: tuple[str, ...]
    exact: bool
    predicates: tuple[Predicate, ...]
    times: tuple[TimeMention, ...]


@dataclass(frozen=True, slots=True)
class _Zone:
    """A group of mentions with the stretch of text that speaks of it."""

    mentions: tuple[ChannelMention, ...]
    lead: tuple[int, int]
    tail: tuple[int, int]


def channel_claims(
    text: str,
    mentions: Sequence[ChannelMention],
    found: Sequence[Quantity],
    times: Sequence[TimeMention],
) -> list[ChannelClaim]:
    """The claims of a sentence about the channels that it mentions, in order."""
    blank = _blanked(text, mentions)
    return [_claim(zone, blank, found, times) for zone in _zones(blank, mentions)]


def _blanked(text: str, mentions: Sequence[ChannelMention]) -> str:
    """The text with channel names overwritten, so that "normal acceleration" is no claim."""
    for mention in mentions:
        width = mention.end - mention.start
        text = f"{text[: mention.start]}{'#' * width}{text[mention.end :]}"
    return text


def _zones(blank: str, mentions: Sequence[ChannelMention]) -> list[_Zone]:
    if not mentions:
        return []
    groups: list[list[ChannelMention]] = []
    for mention in mentions:
        between = blank[groups[-1][-1].end : mention.start] if groups else ""
        if groups and _JOINED.match(between) and groups[-1][-1].exact == mention.exact:
            groups[-1].append(mention)
        else:
            groups.append([mention])
    starts = []
    for index, group in enumerate(groups):
        floor = groups[index - 1][-1].end if index else 0
        lead = _LEAD.search(blank[floor : group[0].start])
        starts.append(floor + lead.start() if lead else group[0].start)
    ends = [*starts[1:], len(blank)]
    zones: list[_Zone] = []
    for group, start, end in zip(groups, starts, ends, strict=True):
        lead_span = (start, group[0].start)
        if not zones and start == group[0].start and not _says(blank[group[-1].end : end]):
            lead_span = (0, start)
        zones.append(_Zone(tuple(group), lead_span, (group[-1].end, end)))
    return zones


def _says(text: str) -> bool:
    return _move(text) is not None or bool(re.search(r"\d", text))


def _claim(
    zone: _Zone, blank: str, found: Sequence[Quantity], times: Sequence[TimeMention]
) -> ChannelClaim:
    names = tuple(dict.fromkeys(name for item in zone.mentions for name in item.channels))
    units = {channel(name).unit for name in names} | {"sigma"}
    predicates: list[Predicate] = []
    for start, end, expected in _parts(blank, zone):
        inside = tuple(
            item
            for item in found
            if start <= item.start and item.end <= end and _belongs(item, units, blank)
        )
        move = _move(blank[start:end])
        if move != "still" and any(item.move and item.expected == expected for item in predicates):
            move = None  # only the first verb is surely the channel's
        predicates.append(Predicate(move, expected, inside))
    spans = (zone.lead, zone.tail)
    return ChannelClaim(
        channels=names,
        exact=all(mention.exact for mention in zone.mentions),
        predicates=tuple(item for item in predicates if not item.empty),
        times=tuple(item for item in times if any(low <= item.start < high for low, high in spans)),
    )


def _belongs(item: Quantity, units: set[str], blank: str) -> bool:
    if item.unit:
        return item.unit in units
    follows = blank[item.end : item.end + 12].lstrip()
    bare = _BARE.search(blank[: item.start]) or item.signed
    return bool(bare) and not re.match(r"[a-z%]", follows)


def _parts(blank: str, zone: _Zone) -> list[tuple[int, int, bool]]:
    """The stretches of a zone with one mood each: (start, end, expected)."""
    parts = []
    lead_start, lead_end = zone.lead
    expected = lexicon().expected.search(blank, lead_start, lead_end)
    still = lexicon().still.search(blank, lead_start, lead_end)
    asked = bool(expected) and not (still and expected and still.start() < expected.start())
    if lead_end > lead_start:
        parts.append((lead_start, lead_end, asked))
    for start, end in _segments(blank, *zone.tail):
        mood = lexicon().expected.search(blank, start, end)
        if mood is None:
            parts.append((start, end, asked and start == zone.tail[0]))
            continue
        parts += [(start, mood.start(), False), (mood.start(), end, True)]
    return parts


def _segments(blank: str, start: int, end: int) -> list[tuple[int, int]]:
    """A tail cut where a new thought begins. Only the first may go on with a comma."""
    cuts = {start, end}
    for pattern in (_SEGMENT, lexicon().contrast):
        cuts |= {hit.start() for hit in pattern.finditer(blank, start, end)}
    return [(low, high) for low, high in pairwise(sorted(cuts)) if high > low]


def _move(text: str) -> Move | None:
    """The first thing that a text says of a channel."""
    words = lexicon()
    still = words.still.search(text)
    directions: list[tuple[int, Move]] = []
    for move, pattern in (("up", words.up), ("down", words.down)):
        hit = pattern.search(text)
        if hit and not (still and still.start() <= hit.start() < still.end()):
            directions.append((hit.start(), "up" if move == "up" else "down"))
    if still:
        directions.append((still.start(), "still"))
    return min(directions)[1] if directions else None

"""What an answer to a mystery flight is worth. Pure rules: no clock, no store, no flight."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, Self

from core.channels import CHANNEL_INDEX
from core.checks import checked_number
from core.clock import LONGEST_S
from core.diagnosis.diagnosis import Evidence
from core.errors import InputError
from core.fmea.catalogue import catalogue
from core.knowledge.knowledge import knowledge

Verdict = Literal["right", "direction", "early", "still"]
"""Of a mark: right; moved the other way; marked before it moved; never left its mirror."""

Nearness = Literal["exact", "look-alike", "subsystem", "far", "none"]


@dataclass(frozen=True, slots=True)
class Rules:
    """Points and limits. The three shares add up to 100."""

    answer: int = 60
    evidence: int = 30
    time: int = 10
    look_alike_share: float = 0.4
    subsystem_share: float = 0.15
    mirror_cost: int = 15
    enough_marks: int = 4
    grace_s: float = 15.0
    quick_s: float = 120.0
    slow_s: float = 600.0


RULES = Rules()


@dataclass(frozen=True, slots=True)
class Mark:
    """A learner's claim: this channel leaves its course at ``time_s``, upwards or downwards."""

    channel: str
    time_s: float
    direction: Literal["+", "-"]

    def __post_init__(self) -> None:
        """Reject what no chart offers; raises `InputError` naming the field."""
        if self.channel not in CHANNEL_INDEX:
            raise InputError("channel", f"unknown channel {str(self.channel)[:40]!r}")
        if self.direction not in ("+", "-"):
            raise InputError("direction", "must be + or -")
        object.__setattr__(
            self, "time_s", checked_number("time_s", self.time_s, 0.0, LONGEST_S, "s")
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Score:
    """Points by what they were given for; ``verdicts`` by channel marked.

    ``missed`` are the channels that moved and were not rightly marked, strongest first; empty where
    enough others were.
    """

    nearness: Nearness
    answer: int
    evidence: int
    time: int
    mirror: int
    verdicts: dict[str, Verdict]
    missed: tuple[str, ...]

    @property
    def total(self) -> int:
        """Out of 100, never below nothing."""
        return max(0, self.answer + self.evidence + self.time + self.mirror)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values; `from_dict` reads them back."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """Read what `to_dict` wrote."""
        return cls(**{**values, "missed": tuple(values["missed"])})


def score(
    answer: str | None,
    truth: str,
    evidence: Sequence[Evidence],
    marks: Sequence[Mark],
    elapsed_s: float,
    *,
    mirror_seen: bool,
    rules: Rules = RULES,
) -> Score:
    """The score of an answer.

    ``answer`` is the mode named, None for giving up; ``truth`` the mode flown; ``evidence`` what
    `core.diagnosis.evidence.find_evidence` found, strongest first; at most one mark a channel.
    """
    nearness = near(answer, truth)
    share = {
        "exact": 1.0,
        "look-alike": rules.look_alike_share,
        "subsystem": rules.subsystem_share,
    }.get(nearness, 0.0)
    verdicts = {mark.channel: judge(mark, evidence, rules) for mark in marks}
    found = [channel for channel, verdict in verdicts.items() if verdict == "right"]
    given_up = answer is None
    return Score(
        nearness=nearness,
        answer=round(rules.answer * share),
        evidence=0 if given_up else round(rules.evidence * agreement(evidence, verdicts, rules)),
        # A guess is quick: time is worth something to an answer that is worth something.
        time=round(rules.time * share * promptness(elapsed_s, rules)),
        mirror=-rules.mirror_cost if mirror_seen else 0,
        verdicts=verdicts,
        missed=()
        if len(found) >= min(rules.enough_marks, len(evidence))
        else tuple(item.channel for item in evidence if item.channel not in found),
    )


def near(answer: str | None, truth: str) -> Nearness:
    """How close an answer comes: FMEA look-alikes, in either direction, are worth a part."""
    if answer is None:
        return "none"
    if answer not in catalogue():
        raise InputError("answer", f"unknown mode {answer[:40]!r}")
    if answer == truth:
        return "exact"
    known = knowledge()
    if truth in _look_alikes(known[answer].look_alikes) or answer in _look_alikes(
        known[truth].look_alikes
    ):
        return "look-alike"
    modes = catalogue()
    return "subsystem" if modes[answer].subsystem == modes[truth].subsystem else "far"


def judge(mark: Mark, evidence: Iterable[Evidence], rules: Rules = RULES) -> Verdict:
    """Whether a mark holds: the channel moved, that way, and not later than it was marked.

    A mark may lead the first departure by ``rules.grace_s``: nobody clicks to the second.
    """
    moved = next((item for item in evidence if item.channel == mark.channel), None)
    if moved is None:
        return "still"
    if mark.time_s < moved.onset_s - rules.grace_s:
        return "early"
    return "right" if mark.direction == moved.direction else "direction"


def agreement(
    evidence: Sequence[Evidence], verdicts: dict[str, Verdict], rules: Rules = RULES
) -> float:
    """How well the marks meet the evidence, 0-1: the harmonic mean of precision and recall.

    `Rules.enough_marks` right ones are a full recall: nobody has to mark all 23 charts. Where
    nothing moved, marking nothing is right.
    """
    if not evidence:
        return 0.0 if verdicts else 1.0
    right = sum(verdict == "right" for verdict in verdicts.values())
    if not right:
        return 0.0
    precision = right / len(verdicts)
    recall = min(1.0, right / min(rules.enough_marks, len(evidence)))
    return 2.0 * precision * recall / (precision + recall)


def promptness(elapsed_s: float, rules: Rules = RULES) -> float:
    """1 up to ``quick_s``, 0 from ``slow_s`` on, even in between."""
    return min(1.0, max(0.0, (rules.slow_s - elapsed_s) / (rules.slow_s - rules.quick_s)))


def _look_alikes(items: Iterable[Any]) -> set[str]:
    return {item.mode for item in items}

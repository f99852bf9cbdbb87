"""The case of a report: a diagnosis with its candidates compared with the evidence.

Every writer starts from a `Case`, so that all of them argue from the same facts.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from core.channels import CHANNEL_INDEX
from core.cylinders import mate
from core.diagnosis.diagnosis import Diagnosis, Evidence
from core.errors import InputError
from core.knowledge.knowledge import ModeKnowledge, knowledge
from core.report.case.findings import GAUGE_SHARE, CylinderHit, Finding, cylinder_hit, examine
from core.residual.window import WINDOW_S

N_CANDIDATES = 3
"""How many classes a report weighs (the paper's top-K)."""

CLOSE_MARGIN = 0.2
"""Two candidates whose probabilities differ by less than this are both open."""

LIKELY = 0.895
UNLIKELY = 0.5
"""Probabilities from which confidence can be high, and below which it is low."""

MIN_LATER_WINDOWS = 6
MIN_LATER_SHARE = 0.1
MAX_LATER = 2
"""A class counts as named later from that many windows and that share of them; at most so many
classes."""

Confidence = Literal["high", "moderate", "low"]


@dataclass(frozen=True, slots=True)
class Candidate:
    """A class with its probability (0-1) and what the evidence says about it."""

    probability: float
    finding: Finding

    @property
    def mode(self) -> ModeKnowledge:
        """The knowledge of the class."""
        return self.finding.mode


@dataclass(frozen=True, slots=True)
class LaterClass:
    """A class other than the verdict that windows after the onset name: ``windows`` ``of`` so many.

    ``first_s``: the end of the first of them.
    """

    mode: str
    windows: int
    of: int
    first_s: float


@dataclass(frozen=True, slots=True)
class Case:
    """The facts that a report is written from.

    ``candidates``: the most probable classes, best first. ``look_alikes``: those of the first that
    are not candidates themselves. ``hit``: the cylinder that the evidence points to, None where it
    points to none. ``later``: what windows after the onset name instead of the verdict.
    """

    diagnosis: Diagnosis
    candidates: tuple[Candidate, ...]
    look_alikes: tuple[Candidate, ...]
    hit: CylinderHit | None
    later: tuple[LaterClass, ...] = ()

    @property
    def top(self) -> Candidate:
        """The most probable class."""
        return self.candidates[0]

    @property
    def evidence(self) -> tuple[Evidence, ...]:
        """The evidence of the diagnosis."""
        return self.diagnosis.evidence

    @property
    def margin(self) -> float:
        """How far the first candidate leads the second (1 if it is alone)."""
        if len(self.candidates) < 2:
            return 1.0
        return self.candidates[0].probability - self.candidates[1].probability

    @property
    def doubts_nominal(self) -> bool:
        """Whether the classifier says nominal while channels say otherwise."""
        return self.top.mode.id == "nominal" and bool(self.top.finding.having("conflicts"))

    @property
    def parts_unseen(self) -> bool:
        """Whether the two flights part, yet no channel by itself has left its noise."""
        return self.diagnosis.onset_s is not None and not self.evidence

    @property
    def is_close(self) -> bool:
        """Whether the second candidate is as good as the first."""
        return self.margin < CLOSE_MARGIN

    @property
    def confidence(self) -> Confidence:
        """The confidence that the report states, from probability, margin and evidence.

        Low where the odds are even, or less than half of what the first candidate must move has
        moved, or as many channels contradict it as agree; or the flight resembles none of the
        classes; or it is nominal and the two flights part. High takes odds of 90 %, no conflict,
        and that the last windows do not name another class.
        """
        if self.diagnosis.none_of_these or (self.top.mode.id == "nominal" and self.parts_unseen):
            return "low"
        finding = self.top.finding
        confirmed, predicted = len(finding.confirmed), len(finding.predicted)
        conflicts = len(finding.having("conflicts"))
        if self.top.probability < UNLIKELY or self.is_close:
            return "low"
        if 2 * confirmed < predicted or (conflicts and conflicts >= confirmed):
            return "low"
        wavers = bool(self.later) and self.stands_since_s is None
        return "high" if self.top.probability >= LIKELY and not conflicts | wavers else "moderate"

    @property
    def better_explained(self) -> Candidate | None:
        """A rival that explains all of the evidence where the first candidate does not."""
        if self.top.finding.explains_all or not self.evidence:
            return None
        rivals = (*self.candidates[1:], *self.look_alikes)
        return next((rival for rival in rivals if rival.finding.explains_all), None)

    @property
    def weighed(self) -> dict[str, Candidate]:
        """Every class that the report may speak of, by id: candidates, then look-alikes."""
        return {item.mode.id: item for item in (*self.candidates, *self.look_alikes)}

    @property
    def open_verdicts(self) -> tuple[Candidate, ...]:
        """The first candidate, and the second where the lead is too small to choose."""
        return self.candidates[:2] if self.is_close else self.candidates[:1]

    @property
    def work_order(self) -> tuple[Candidate, ...]:
        """The candidates whose actions to list: the first, and the one that the evidence favours.

        Where the evidence denies a nominal verdict, looking for the next best comes instead.
        """
        second = self.better_explained
        if second is None and len(self.candidates) > 1 and (self.is_close or self.doubts_nominal):
            second = self.candidates[1]
        if second is None:
            return (self.top,)
        return (second,) if self.doubts_nominal else (self.top, second)

    @property
    def cylinders(self) -> frozenset[int]:
        """The cylinders at which a report may put the fault; empty where it has to leave it open.

        The one hit, the next where the lead is small, and both of a bank where the mode takes one.
        """
        if self.hit is None:
            return frozenset()
        found = {self.hit.cylinder}
        if not self.hit.clear and self.hit.runner_up is not None:
            found.add(self.hit.runner_up)
        channels = {item.channel for each in self.weighed.values() for item in each.mode.channels}
        if "CHT bank" in channels:
            found |= {mate(cylinder) for cylinder in found}
        return frozenset(found)

    @property
    def stands_since_s(self) -> float | None:
        """End of the first window from which on all name the verdict; None if the last does not.

        Windows that end after a repair are not asked.
        """
        diagnosis = self.diagnosis
        time_s, leaders = _judged_windows(diagnosis)
        others = np.flatnonzero(leaders != diagnosis.classes.index(diagnosis.top))
        since = int(others[-1]) + 1 if len(others) else 0
        return float(time_s[since]) if since < len(leaders) else None

    def cylinder_of(self, mode: ModeKnowledge) -> int | None:
        """The cylinder to name for a mode; None if it has none or the evidence shows none."""
        return self.hit.cylinder if self.hit and mode.names_cylinder else None


def open_case(diagnosis: Diagnosis, also: Sequence[str] = ()) -> Case:
    """Weigh the candidates of a diagnosis, and the classes ``also`` asked about.

    Raises `InputError` if the diagnosis has an unknown class or channel, or a number that is not
    finite or not a probability.
    """
    probabilities = _checked(diagnosis)
    known = knowledge()
    hit = cylinder_hit(diagnosis.evidence)

    def candidate(mode_id: str) -> Candidate:
        mode = known[mode_id]
        cylinder = hit.cylinder if hit else mode.usual_cylinder or 1
        # In lab conditions a healthy flight equals its mirror exactly, so nominal allows no trace.
        exact = mode_id == "nominal" and diagnosis.conditions == "lab"
        finding = examine(mode, diagnosis.evidence, cylinder, 0.0 if exact else GAUGE_SHARE)
        return Candidate(probabilities.get(mode_id, 0.0), finding)

    leading = [mode_id for mode_id, _ in diagnosis.ranked(N_CANDIDATES)]
    later = _later_classes(diagnosis)
    look_alikes = dict.fromkeys(
        [
            *(item.mode for item in known[leading[0]].look_alikes),
            *(item.mode for item in later),
            *(m for m in also if m in known),
        ]
    )
    return Case(
        diagnosis=diagnosis,
        candidates=tuple(map(candidate, leading)),
        look_alikes=tuple(candidate(mode) for mode in look_alikes if mode not in leading),
        hit=hit,
        later=later,
    )


def _judged_windows(diagnosis: Diagnosis) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Ends (k,) of the windows before any repair, and the class number that each names (k,)."""
    until_s = diagnosis.judged_until_s
    judged = diagnosis.time_s <= (np.inf if until_s is None else until_s)
    leaders = np.argmax(diagnosis.probabilities_over_time, axis=1)
    return diagnosis.time_s[judged], leaders[judged]


def _later_classes(diagnosis: Diagnosis) -> tuple[LaterClass, ...]:
    """What windows after the onset name instead of the verdict, most often first.

    A class that only a few windows name is left out, unless the last one does.
    """
    if diagnosis.onset_s is None or not len(diagnosis.time_s):
        return ()
    time_s, leaders = _judged_windows(diagnosis)
    after = time_s - WINDOW_S >= diagnosis.onset_s - 0.01
    if after.any():
        time_s, leaders = time_s[after], leaders[after]
    found = []
    for number in dict.fromkeys(leaders.tolist()):
        named = leaders == number
        count = int(named.sum())
        enough = count >= max(MIN_LATER_WINDOWS, MIN_LATER_SHARE * len(leaders))
        if diagnosis.classes[number] != diagnosis.top and (enough or number == leaders[-1]):
            first_s = float(time_s[named][0])
            found.append(LaterClass(diagnosis.classes[number], count, len(leaders), first_s))
    return tuple(sorted(found, key=lambda item: -item.windows)[:MAX_LATER])


def _checked(diagnosis: Diagnosis) -> Mapping[str, float]:
    """Probability by class, once every name and number has been found sound."""
    if not diagnosis.classes or len(diagnosis.classes) != len(diagnosis.probabilities):
        raise InputError("probabilities", "must hold one number for each class")
    for mode_id in diagnosis.classes:
        if mode_id not in knowledge():
            raise InputError("classes", f"unknown mode {mode_id!r}")
    for probability in diagnosis.probabilities:
        if not 0.0 <= probability <= 1.0:
            raise InputError("probabilities", f"must lie in 0-1, got {probability}")
    for item in diagnosis.evidence:
        if item.channel not in CHANNEL_INDEX:
            raise InputError("evidence", f"unknown channel {item.channel!r}")
        numbers = (item.start_s, item.end_s, item.value, item.sigma, item.onset_s)
        if not all(map(math.isfinite, numbers)):
            raise InputError("evidence", f"{item.channel} has a number that is not finite")
    if diagnosis.onset_s is not None and not math.isfinite(diagnosis.onset_s):
        raise InputError("onset_s", "must be a finite time or none")
    return dict(zip(diagnosis.classes, map(float, diagnosis.probabilities), strict=True))

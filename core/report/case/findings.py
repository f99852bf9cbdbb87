"""Findings: each mode compared with the evidence, a verdict a channel and a causal step.

Pure functions of evidence and knowledge. The template states these verdicts; the text of other
writers is checked against them.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from core.channels import CHANNEL_NAMES, channel, cht_name, egt_name
from core.cylinders import CYLINDERS
from core.diagnosis.diagnosis import Evidence
from core.knowledge.knowledge import ChainStep, ExpectedShift, ModeKnowledge

Verdict = Literal["agrees", "faint", "missing", "quiet", "conflicts", "unexplained"]
"""What a channel says about a mode.

agrees: moved as the mode predicts (or stayed within the trace it allows); faint: moved, but too
little to count; missing: should have moved and did not; quiet: did not move and need not;
conflicts: moved the other way, or moved where the mode leaves it alone; unexplained: moved, and
the mode says nothing about it.
"""

StepVerdict = Literal["seen", "not seen", "contradicted", "no sensor"]

FAINT_SHARE = 0.15
"""A shift below this share of the mild end of its range is faint. Ranges are settled values,
while a flight may end, or be repaired, before a channel has settled: a fault of severity 0.3, the
mild end, shows between a fifth and half of it two minutes after its onset."""

SLACK = 1.5
"""How far beyond its range a shift still passes for the mode's own: ranges are not limits."""

GAUGE_SHARE = 0.01
"""A channel that should stay put may stray by this share of its gauge: the floor that the
residual normalisation uses too (paper section 4.2)."""

UNEVEN_SHARE = 0.25
"""Among probes of one kind, which share one lag, a probe that must move but reaches less than this
share of what the leading one does is faint: the pattern does not fit, whatever the severity."""

STRAY_SHARE = 0.5
"""A probe that should stay put, or nearly so, conflicts if it goes more than this share of the way
of the probe that must move."""

CLEAR_LEAD = 1.25
"""The cylinder hit is clear if it moved this many times farther than the next."""


_PROBES = (tuple(map(cht_name, CYLINDERS)), tuple(map(egt_name, CYLINDERS)))


@dataclass(frozen=True, slots=True)
class ChannelCheck:
    """One channel compared with one mode. ``expected`` is None where the mode is silent on it."""

    channel: str
    expected: ExpectedShift | None
    evidence: Evidence | None
    verdict: Verdict

    @property
    def must_move(self) -> bool:
        """Whether the mode predicts a sustained shift here."""
        return self.expected is not None and self.expected.sign in ("+", "-")

    @property
    def value(self) -> float:
        """The measured shift in the channel's unit, 0 if it never left its noise."""
        return self.evidence.value if self.evidence else 0.0

    @property
    def reach(self) -> float:
        """How far the mode can take the channel, signed; 0 where it is silent."""
        return self.expected.severe if self.expected else 0.0

    @property
    def progress(self) -> float:
        """The measured shift as a multiple of what a mild fault settles at (for `must_move`)."""
        return self.value / self.expected.mild if self.must_move and self.expected else 0.0

    @property
    def shortfall(self) -> bool:
        """Whether the channel moved the right way, but less than a mild fault settles at."""
        mild = self.expected.mild if self.expected else 0.0
        return self._follows and round(abs(self.value), 2) < abs(mild)

    @property
    def excess(self) -> bool:
        """Whether the channel moved the right way, but more than a severe fault settles at."""
        return self._follows and round(abs(self.value), 2) > abs(self.reach)

    @property
    def _follows(self) -> bool:
        return self.verdict == "agrees" and self.must_move

    @property
    def oversize(self) -> bool:
        """Whether the channel moved the right way, but clearly farther than the mode takes it."""
        return self._follows and abs(self.value) > SLACK * abs(self.reach)


@dataclass(frozen=True, slots=True)
class StepCheck:
    """One causal step compared with the evidence, with the channels that decide it."""

    step: ChainStep
    verdict: StepVerdict
    checks: tuple[ChannelCheck, ...]


@dataclass(frozen=True, slots=True)
class Finding:
    """One mode compared with all the evidence, as seen from ``cylinder``.

    ``checks`` has every channel that the mode mentions or that moved, in log order.
    """

    mode: ModeKnowledge
    cylinder: int
    checks: tuple[ChannelCheck, ...]
    chain: tuple[StepCheck, ...]

    def having(self, *verdicts: Verdict) -> tuple[ChannelCheck, ...]:
        """The channels with one of these verdicts."""
        return tuple(check for check in self.checks if check.verdict in verdicts)

    def check_of(self, item: Evidence) -> ChannelCheck:
        """The check of one item of evidence; a weaker one on its channel is judged by itself."""
        check = next(check for check in self.checks if check.channel == item.channel)
        if check.evidence == item:
            return check
        return ChannelCheck(item.channel, check.expected, item, judge(check.expected, item))

    @property
    def predicted(self) -> tuple[ChannelCheck, ...]:
        """The channels in which the mode must show."""
        return tuple(check for check in self.checks if check.must_move)

    @property
    def confirmed(self) -> tuple[ChannelCheck, ...]:
        """The channels in which it must show and does, by an amount that fits."""
        return tuple(
            check for check in self.predicted if check.verdict == "agrees" and not check.oversize
        )

    @property
    def explains_all(self) -> bool:
        """Whether all that must move did, by a fitting amount, and nothing else did."""
        return bool(self.predicted) and all(
            check.verdict in ("agrees", "quiet") and not check.oversize for check in self.checks
        )


@dataclass(frozen=True, slots=True)
class CylinderHit:
    """The cylinder whose probes moved farthest; ``runner_up`` is the next (None if none moved)."""

    cylinder: int
    runner_up: int | None
    clear: bool


def strongest(evidence: Iterable[Evidence]) -> dict[str, Evidence]:
    """By channel, the item with the most sigma; of equals the first."""
    best: dict[str, Evidence] = {}
    for item in evidence:
        if item.channel not in best or abs(item.sigma) > abs(best[item.channel].sigma):
            best[item.channel] = item
    return best


def cylinder_hit(evidence: Iterable[Evidence]) -> CylinderHit | None:
    """The cylinder whose CHT and EGT moved farthest, each as a share of its gauge.

    None where no head or exhaust temperature left its noise.
    """
    moved = strongest(evidence)

    def departure(cylinder: int) -> float:
        return sum(
            abs(moved[name].value) / channel(name).full_scale
            for name in (cht_name(cylinder), egt_name(cylinder))
            if name in moved
        )

    ranked = sorted(CYLINDERS, key=departure, reverse=True)
    lead, second = (departure(cylinder) for cylinder in ranked[:2])
    if lead == 0.0:
        return None
    return CylinderHit(
        cylinder=ranked[0],
        runner_up=ranked[1] if second > 0.0 else None,
        clear=lead >= CLEAR_LEAD * second,
    )


def judge(
    expected: ExpectedShift | None, evidence: Evidence | None, gauge_share: float = GAUGE_SHARE
) -> Verdict:
    """The verdict on one channel by itself; see `examine` for ``gauge_share``."""
    if evidence is None:
        must_move = expected is not None and expected.sign in ("+", "-")
        return "missing" if must_move else "quiet"
    if expected is None:
        return "unexplained"
    value = evidence.value
    if expected.sign in ("+", "-"):
        if abs(value) < FAINT_SHARE * abs(expected.mild):
            return "faint"
        return "agrees" if (value > 0.0) == (expected.sign == "+") else "conflicts"
    floor = gauge_share * channel(evidence.channel).full_scale
    lowest = min(SLACK * expected.low, -floor)
    highest = max(SLACK * expected.high, floor)
    return "agrees" if lowest <= value <= highest else "conflicts"


def examine(
    mode: ModeKnowledge,
    evidence: Iterable[Evidence],
    cylinder: int,
    gauge_share: float = GAUGE_SHARE,
) -> Finding:
    """Compare a mode that affects ``cylinder`` with the evidence.

    ``gauge_share`` is how far, as a share of its gauge, a channel may stray that should stay put.
    """
    moved = strongest(evidence)
    signature = mode.signature(cylinder)
    checks = {
        name: ChannelCheck(
            name,
            signature.get(name),
            moved.get(name),
            judge(signature.get(name), moved.get(name), gauge_share),
        )
        for name in CHANNEL_NAMES
        if name in signature or name in moved
    }
    for probes in _PROBES:
        checks.update(_compared([checks[name] for name in probes if name in checks]))
    return Finding(
        mode=mode,
        cylinder=cylinder,
        checks=tuple(checks.values()),
        chain=tuple(
            _check_step(step, tuple(checks[name] for name in step.predictions(cylinder)))
            for step in mode.chain
        ),
    )


def _compared(checks: Sequence[ChannelCheck]) -> dict[str, ChannelCheck]:
    """Checks of one kind of probe, compared with the one that follows the mode farthest."""
    followers = [check for check in checks if check.must_move and check.verdict == "agrees"]
    if not followers:
        return {}
    lead = max(followers, key=lambda check: check.progress)
    return {check.channel: replace(check, verdict=_beside(check, lead)) for check in checks}


def _beside(check: ChannelCheck, lead: ChannelCheck) -> Verdict:
    if check.verdict != "agrees" or check.must_move:
        lagging = check.progress < UNEVEN_SHARE * lead.progress
        return "faint" if check.verdict == "agrees" and lagging else check.verdict
    strays = abs(check.value) > STRAY_SHARE * abs(lead.value)
    should_trail = abs(check.reach) < STRAY_SHARE * abs(lead.reach)
    return "conflicts" if strays and should_trail else "agrees"


def _check_step(step: ChainStep, checks: tuple[ChannelCheck, ...]) -> StepCheck:
    """A step is seen if most of what it must move has moved and nothing speaks against it.

    Without a sustained shift to look for, one conditional move is enough; a step that only leaves
    channels alone is seen if it does.
    """
    must = [check for check in checks if check.must_move]
    may = [check for check in checks if check.expected and check.expected.sign == "~"]
    verdict: StepVerdict
    if not checks:
        verdict = "no sensor"
    elif any(check.verdict == "conflicts" for check in checks):
        verdict = "contradicted"
    elif must:
        agreeing = sum(check.verdict == "agrees" for check in must)
        verdict = "seen" if 2 * agreeing >= len(must) else "not seen"
    elif may:
        verdict = "seen" if any(check.verdict == "agrees" for check in may) else "not seen"
    else:
        verdict = "seen"
    return StepCheck(step, verdict, checks)

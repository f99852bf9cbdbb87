"""What the evidence says about each mode: the facts that every report has to agree with.

Pure functions from evidence and knowledge to verdicts, one a channel and one a causal step. The
template writer states these verdicts; whatever else writes a report can be checked against them.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from core.channels import CHANNEL_NAMES, CYLINDERS, channel, cht_name, egt_name
from core.diagnosis.diagnosis import Evidence
from core.fmea.knowledge import ChainStep, ExpectedShift, ModeKnowledge

Verdict = Literal["agrees", "faint", "missing", "quiet", "conflicts", "unexplained"]
"""What a channel says about a mode.

agrees: moved as the mode predicts (or stayed within the trace it allows); faint: moved, but too
little to count; missing: should have moved and did not; quiet: did not move and need not;
conflicts: moved the other way, or moved where the mode leaves it alone; unexplained: moved, and
the mode says nothing about it.
"""

StepVerdict = Literal["seen", "not seen", "contradicted", "no sensor"]

FAINT_SHARE = 0.25
"""A shift below this share of the mild end of its range is faint. A mild fault has severity 0.3,
so this is about a severity of 0.1, or the first quarter of a slow climb."""

SLACK = 1.5
"""How far beyond its range a shift still passes for the mode's own: ranges are not limits."""

GAUGE_SHARE = 0.01
"""A channel that should stay put may stray by this share of its gauge: the floor that the
residual normalisation uses too (paper section 4.2)."""

CLEAR_LEAD = 1.25
"""The cylinder hit is clear if it moved this many times farther than the next."""


@dataclass(frozen=True, slots=True)
class ChannelCheck:
    """One channel held against one mode. ``expected`` is None where the mode is silent on it."""

    channel: str
    expected: ExpectedShift | None
    evidence: Evidence | None
    verdict: Verdict

    @property
    def must_move(self) -> bool:
        """Whether the mode predicts a sustained shift here."""
        return self.expected is not None and self.expected.sign in ("+", "-")

    @property
    def oversize(self) -> bool:
        """Whether the channel moved the right way, but clearly farther than the mode takes it."""
        return (
            self.verdict == "agrees"
            and self.must_move
            and self.evidence is not None
            and self.expected is not None
            and abs(self.evidence.value) > SLACK * abs(self.expected.severe)
        )


@dataclass(frozen=True, slots=True)
class StepCheck:
    """One causal step held against the evidence, with the channels that decide it."""

    step: ChainStep
    verdict: StepVerdict
    checks: tuple[ChannelCheck, ...]


@dataclass(frozen=True, slots=True)
class Finding:
    """One mode held against all the evidence, as seen from ``cylinder``.

    ``checks`` has every channel that the mode mentions or that moved, in log order.
    """

    mode: ModeKnowledge
    cylinder: int
    checks: tuple[ChannelCheck, ...]
    chain: tuple[StepCheck, ...]

    def having(self, *verdicts: Verdict) -> tuple[ChannelCheck, ...]:
        """The channels with one of these verdicts."""
        return tuple(check for check in self.checks if check.verdict in verdicts)

    @property
    def predicted(self) -> tuple[ChannelCheck, ...]:
        """The channels in which the mode must show."""
        return tuple(check for check in self.checks if check.must_move)

    @property
    def confirmed(self) -> tuple[ChannelCheck, ...]:
        """The channels in which it must show and does."""
        return tuple(check for check in self.predicted if check.verdict == "agrees")


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


def judge(expected: ExpectedShift | None, evidence: Evidence | None) -> Verdict:
    """The verdict on one channel."""
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
    floor = GAUGE_SHARE * channel(evidence.channel).full_scale
    lowest = min(SLACK * expected.low, -floor)
    highest = max(SLACK * expected.high, floor)
    return "agrees" if lowest <= value <= highest else "conflicts"


def examine(mode: ModeKnowledge, evidence: Iterable[Evidence], cylinder: int) -> Finding:
    """Hold a mode, hitting ``cylinder`` (1-4), against the evidence."""
    moved = strongest(evidence)
    signature = mode.signature(cylinder)
    checks = {
        name: ChannelCheck(
            name, signature.get(name), moved.get(name), judge(signature.get(name), moved.get(name))
        )
        for name in CHANNEL_NAMES
        if name in signature or name in moved
    }
    return Finding(
        mode=mode,
        cylinder=cylinder,
        checks=tuple(checks.values()),
        chain=tuple(
            _check_step(step, tuple(checks[name] for name in step.predictions(cylinder)))
            for step in mode.chain
        ),
    )


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

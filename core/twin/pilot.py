"""The pilot: turns the plan's legs into targets for the autopilot, tick by tick.

Mixtures are named by where the lever would be at 5,000 ft. In climbs and descents the pilot leans
by altitude, as one does in a 172: the adapter moves the lever with the air pressure, up to full
rich, so that the air-fuel ratio stays. Where a plan has no legs the lever is set once, at trim.
"""

import math
from dataclasses import replace
from typing import NamedTuple

from core.clock import TICK_S
from core.twin.constants import CRUISE_MIXTURE
from core.twin.plan import Leg, Plan

CLIMB_FPM = 500.0
CAPTURE_S = 90.0
"""The speed loop and the altitude integral stay closed this long after the climb has ended."""

MIXTURE_PER_S = 0.01
"""How fast the mixture lever is turned."""
REACH_FT = 150.0
"""How far ahead of a guarded aircraft its commanded altitude may climb or descend."""
ON_ALTITUDE_FT, ON_SPEED_KT = 20.0, 1.0
"""So near its targets, a guarded aircraft has captured them..."""
LOST_FT = 50.0
"""... and so far from them, it has lost its altitude."""
GUST_S = 25.0
"""What a gust does is over after that."""

FIELD_KT_PER_S = 0.3
"""A pilot changes speed gently; in lab a new speed is a step for the speed loop."""


class Where(NamedTuple):
    """How high and how fast the aircraft is."""

    altitude_ft: float
    ias_kt: float


class Targets(NamedTuple):
    """What the autopilot is to hold now; ``capturing`` while a new leg is being taken up.

    ``mixture`` is where the lever would be at 5,000 ft, 1 full rich.
    """

    altitude_ft: float
    climb_fps: float
    speed_kt: float
    heading_deg: float
    capturing: bool
    mixture: float


class Pilot:
    """Flies the legs one after the other; holds what was reached in between.

    It flies blind, by the clock, unless it is given where the aircraft is: from the first action on
    a flight it waits for an aircraft that cannot follow, and captures until it has followed.
    """

    def __init__(self, plan: Plan, tick: int = 0) -> None:
        """On the plan's altitude, speed and heading, leaned for cruise; ``tick`` comes next."""
        self._kt_per_s = FIELD_KT_PER_S if plan.conditions == "field" else math.inf
        self._legs = list(plan.legs)
        self._tick = tick
        self._held: Targets | None = None
        self._altitude_ft = self._to_altitude_ft = plan.altitude_ft
        self._speed_kt = self._to_speed_kt = plan.speed_kt
        self._heading_deg = plan.heading_deg
        self._mixture = self._to_mixture = CRUISE_MIXTURE
        self._capture_until_s = -math.inf
        self._is_capturing = False
        self._above_ft = self._faster_kt = 0.0
        self.finds_power = False
        """Whether the last capture is to find another power setting, or to leave the one it met."""

    def set_targets(self, leg: Leg) -> None:
        """Take up new targets at the next tick, after those that the plan has there."""
        leg = replace(leg, start_s=self._tick * TICK_S)
        sooner = sum(planned.start_s <= leg.start_s for planned in self._legs)
        self._legs.insert(sooner, leg)

    def recover(self, where: Where, *, finds_power: bool) -> None:
        """Capture the targets there are from ``where`` on, if the aircraft has lost its altitude.

        ``finds_power``: the power setting there was is of no use, so that one must be found.
        """
        if self._is_capturing:
            return
        if finds_power or abs(where.altitude_ft - self._to_altitude_ft) > LOST_FT:
            self._held = None
            self.finds_power = finds_power
            self._altitude_ft = where.altitude_ft
            self._capture_until_s = self._tick * TICK_S + CAPTURE_S

    def next(self, where: Where | None = None) -> Targets:
        """The targets of the next tick (0.1 s), for an aircraft that is ``where`` if guarded."""
        now_s = self._tick * TICK_S
        self._tick += 1
        while self._legs and now_s >= self._legs[0].start_s:
            self._take_up(self._legs.pop(0), now_s)
        if self._held is not None:
            return self._held
        self._mixture = _toward(self._mixture, self._to_mixture, MIXTURE_PER_S)
        self._speed_kt = _toward(self._speed_kt, self._to_speed_kt, self._kt_per_s)
        is_on_targets = where is None or self._is_on_targets(where)
        if where is not None and (self._is_capturing or now_s < self._capture_until_s):
            lowest_ft, highest_ft = where.altitude_ft - REACH_FT, where.altitude_ft + REACH_FT
            self._altitude_ft = max(lowest_ft, min(highest_ft, self._altitude_ft))
        step_ft = CLIMB_FPM / 60.0 * TICK_S
        to_go_ft = self._to_altitude_ft - self._altitude_ft
        change_ft = max(-step_ft, min(step_ft, to_go_ft))
        self._altitude_ft += change_ft
        if change_ft or self._speed_kt != self._to_speed_kt:
            self._capture_until_s = now_s + CAPTURE_S
        self._is_capturing = now_s < self._capture_until_s or (
            self._is_capturing and not is_on_targets
        )
        targets = Targets(
            self._altitude_ft,
            change_ft / TICK_S,
            self._speed_kt,
            self._heading_deg,
            self._is_capturing,
            self._mixture,
        )
        if not targets.capturing and self._mixture == self._to_mixture:
            self._held = targets
        return targets

    def _take_up(self, leg: Leg, now_s: float) -> None:
        self._held = None
        self._to_altitude_ft = leg.altitude_ft or self._to_altitude_ft
        self._to_speed_kt = leg.speed_kt or self._to_speed_kt
        self._heading_deg = self._heading_deg if leg.heading_deg is None else leg.heading_deg
        self._to_mixture = leg.mixture or self._to_mixture
        if not leg.only_mixture:
            self._capture_until_s = now_s + CAPTURE_S
            self.finds_power = True

    def _is_on_targets(self, where: Where) -> bool:
        """Whether the aircraft is on them apart from gusts, and no gust moves the throttle now."""
        above_ft = where.altitude_ft - self._to_altitude_ft
        faster_kt = where.ias_kt - self._to_speed_kt
        share = TICK_S / GUST_S
        self._above_ft += share * (above_ft - self._above_ft)
        self._faster_kt += share * (faster_kt - self._faster_kt)
        return (
            abs(self._above_ft) <= ON_ALTITUDE_FT
            and max(abs(self._faster_kt), abs(faster_kt)) <= ON_SPEED_KT
        )


def _toward(value: float, target: float, per_s: float) -> float:
    """``value`` a tick later on its way to ``target`` at the rate ``per_s``."""
    step = per_s * TICK_S
    if abs(target - value) <= step:
        return target
    return value + math.copysign(step, target - value)

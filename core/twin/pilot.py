"""The pilot: turns the plan's legs into targets for the autopilot, tick by tick."""

import math
from dataclasses import dataclass

from core.fmea.laws import TICK_S
from core.twin.plan import Plan

CLIMB_FPM = 500.0
CAPTURE_S = 90.0
"""The speed loop and the altitude integral stay closed this long after the climb has ended."""


@dataclass(frozen=True, slots=True)
class Targets:
    """What the autopilot is to hold now; ``capturing`` while a new leg is being taken up."""

    altitude_ft: float
    climb_fps: float
    speed_kt: float
    heading_deg: float
    capturing: bool


class Pilot:
    """Flies the legs one after the other; nothing to do on a plan without legs."""

    def __init__(self, plan: Plan) -> None:
        """On the plan's altitude, speed and heading."""
        self._legs = list(plan.legs)
        self._tick = 0
        self._altitude_ft = self._to_altitude_ft = plan.altitude_ft
        self._speed_kt, self._heading_deg = plan.speed_kt, plan.heading_deg
        self._capture_until_s = -math.inf

    @property
    def has_legs(self) -> bool:
        """Whether the plan changes anything on the way."""
        return bool(self._legs)

    def next(self) -> Targets:
        """The targets of the next tick (0.1 s)."""
        now_s = self._tick * TICK_S
        self._tick += 1
        while self._legs and now_s >= self._legs[0].start_s:
            leg = self._legs.pop(0)
            self._to_altitude_ft = leg.altitude_ft or self._to_altitude_ft
            self._speed_kt = leg.speed_kt or self._speed_kt
            self._heading_deg = self._heading_deg if leg.heading_deg is None else leg.heading_deg
            self._capture_until_s = now_s + CAPTURE_S
        step_ft = CLIMB_FPM / 60.0 * TICK_S
        to_go_ft = self._to_altitude_ft - self._altitude_ft
        change_ft = max(-step_ft, min(step_ft, to_go_ft))
        self._altitude_ft += change_ft
        if change_ft:
            self._capture_until_s = now_s + CAPTURE_S
        return Targets(
            self._altitude_ft,
            change_ft / TICK_S,
            self._speed_kt,
            self._heading_deg,
            now_s < self._capture_until_s,
        )

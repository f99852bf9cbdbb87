"""The four control inputs of the surrogate: what the crew commands, sample by sample.

They come from the plan and not from the flight: the positions of throttle and mixture that JSBSim
gives already carry the fault's correction (layer 2) and would tell the network of it, and no
diagnosis may read states. The throttle is set once for the commanded speed, so that speed stands
for it.
"""

import numpy as np

from core.arrays import Array32
from core.clock import STEPS_PER_TICK
from core.twin.pilot import Pilot, Targets
from core.twin.plan import Plan

CONTROL_NAMES: tuple[str, ...] = ("altitude_ft", "speed_kt", "turn_deg", "mixture")
"""Target altitude, target speed, target heading relative to the first one (-180 to 180), lever."""

N_CONTROLS = len(CONTROL_NAMES)


CONTROL_SCALE = np.array([1000.0, 10.0, 90.0, 0.1], dtype=np.float32)
CONTROL_CENTRE = np.array([5000.0, 100.0, 0.0, 0.93], dtype=np.float32)
"""What brings each to about one; fixed, because a cruise leaves turn and lever where they are."""


def controls(plan: Plan, start_row: int, n_rows: int) -> Array32:
    """The commands in force at ``n_rows`` samples of a flight from ``start_row`` on, (n, 4)."""
    pilot = Pilot(plan)
    last_row = start_row + n_rows
    if plan.legs:
        ticks = [pilot.next() for _ in range(-(-last_row // STEPS_PER_TICK))]
        held = np.repeat(_rows(ticks, plan), STEPS_PER_TICK, axis=0)
        commanded: Array32 = held[start_row:last_row]
        return commanded
    return np.repeat(_rows([pilot.next()], plan), n_rows, axis=0)


def _rows(ticks: list[Targets], plan: Plan) -> Array32:
    return np.array(
        [
            (tick.altitude_ft, tick.speed_kt, _turn_deg(tick.heading_deg, plan), tick.mixture)
            for tick in ticks
        ],
        dtype=np.float32,
    )


def _turn_deg(heading_deg: float, plan: Plan) -> float:
    return (heading_deg - plan.heading_deg + 180.0) % 360.0 - 180.0

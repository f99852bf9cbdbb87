"""How fast the twin flies, as multiples of JSBSim's bare loop in the same process.

Seconds say more of the machine than of the code; ratios to `FGFDMExec.run` carry across machines.
Seconds are CPU time of this process, all threads, so that what else the machine does is left out.
"""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from statistics import median
from typing import Any

import jsbsim

from core.fmea.fault import Fault
from core.twin.flight import fly, fly_pair
from core.twin.plan import DT_S, Plan, checked_number

PLAN = Plan(altitude_ft=5000.0, speed_kt=100.0, duration_s=300.0)
FAULT = Fault("cylinder_compression", severity=0.8, onset_s=60.0)
"""One that reaches the engine, so that faulted aircraft and mirror both have to be flown."""


@dataclass(frozen=True, slots=True)
class Speed:
    """Medians over ``rounds``: CPU seconds of each piece of work, and its ratio to the bare loop.

    ``trajectory_ratio``: one flight complete with autopilot, fault and 23 channels.
    ``pair_ratio``: that flight and its mirror. A ratio is taken within its round, where both
    times met the same machine.
    """

    trajectory_ratio: float
    pair_ratio: float
    bare_s: float
    trajectory_s: float
    pair_s: float
    rounds: int
    steps: int
    fault: str

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return asdict(self)


def measure(rounds: int, progress: Callable[[float], None] = lambda share: None) -> Speed:
    """Time the twin; ``progress`` is told the share done. Raises `InputError` for bad rounds."""
    rounds = int(checked_number("rounds", rounds, 1, 1000))
    fly_pair(PLAN, FAULT)  # imports, caches and page faults belong to no round
    times: list[tuple[float, float, float]] = []
    for done in range(rounds):
        bare_s = bare_loop_s(PLAN)
        trajectory_s = _seconds(lambda: fly(PLAN, FAULT))
        pair_s = _seconds(lambda: fly_pair(PLAN, FAULT))
        times.append((bare_s, trajectory_s, pair_s))
        progress((done + 1) / rounds)
    return Speed(
        trajectory_ratio=median(trajectory_s / bare_s for bare_s, trajectory_s, _ in times),
        pair_ratio=median(pair_s / bare_s for bare_s, _, pair_s in times),
        bare_s=median(row[0] for row in times),
        trajectory_s=median(row[1] for row in times),
        pair_s=median(row[2] for row in times),
        rounds=rounds,
        steps=PLAN.n_steps,
        fault=FAULT.mode,
    )


def bare_loop_s(plan: Plan) -> float:
    """Seconds that JSBSim's own c172p takes for the plan's steps, trimmed level and left alone.

    Only the loop is timed, not the loading. jsbsim is used directly here: what our adapter
    (`core.twin.aircraft`) adds to it is part of what is measured.
    """
    jsbsim.set_logger(jsbsim.DefaultLogger(jsbsim.LogLevel.FATAL))
    executive = jsbsim.FGFDMExec(None)
    executive.set_debug_level(0)
    executive.load_model("c172p")
    executive.set_dt(DT_S)
    executive["ic/h-sl-ft"] = plan.altitude_ft
    executive["ic/vc-kts"] = plan.speed_kt
    executive["fcs/throttle-cmd-norm"] = 0.75
    executive.run_ic()
    executive["propulsion/set-running"] = -1
    executive["fcs/mixture-cmd-norm"] = 0.95
    executive["simulation/do_simple_trim"] = 1

    def loop() -> None:
        run = executive.run
        for _ in range(plan.n_steps):
            run()

    return _seconds(loop)


def _seconds(work: Callable[[], object]) -> float:
    started = time.process_time()
    work()
    return time.process_time() - started

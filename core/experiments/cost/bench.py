"""How fast the twin flies, as multiples of JSBSim's bare loop in the same process.

Seconds say more of the machine than of the code; ratios to `FGFDMExec.run` carry across machines.
Seconds are CPU time of this process, all threads, so that what else the machine does is left out.
Only what workers gain is a matter of wall time, and the one figure that a busy machine spoils.
"""

import hashlib
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from statistics import median
from typing import Any

import jsbsim
from distributed import Client

from core.checks import checked_number
from core.clock import DT_S
from core.fmea.fault import Fault
from core.twin.flight import fly, fly_pair
from core.twin.plan import Plan
from core.workers.pool import pool_client

MEASURED_PLAN = Plan(altitude_ft=5000.0, speed_kt=100.0, duration_s=300.0)
FAULT = Fault("cylinder_compression", severity=0.8, onset_s=60.0)
"""One that reaches the engine, so that faulted aircraft and mirror both have to be flown."""

QUIET_SHARE = 0.9
"""Two workers that get less than this of a core each are not alone on the machine."""


@dataclass(frozen=True, slots=True)
class Workload:
    """How long the long flight is, and how many flights the workers share."""

    long_s: float
    flights: int


FULL = Workload(long_s=7200.0, flights=64)
QUICK = Workload(long_s=900.0, flights=8)


LONG_ROUNDS = 3
"""Long rounds are half a minute's work each and differ little: more of them say no more."""


@dataclass(frozen=True, slots=True)
class Round:
    """One measurement of a 300 s flight: CPU seconds of work.

    ``trajectory_s``: one flight complete with autopilot, fault and channels. ``pair_s``: that
    flight and its mirror.
    """

    bare_s: float
    trajectory_s: float
    pair_s: float

    def ratios(self) -> dict[str, float]:
        """The ratios by which we judge, as explained in `Speed`."""
        return {
            "trajectory_ratio": self.trajectory_s / self.bare_s,
            "pair_ratio": self.pair_s / self.bare_s,
        }


@dataclass(frozen=True, slots=True)
class LongRound:
    """One measurement of much work: the long flight, and many flights shared out.

    ``pair_s`` (300 s flight) and ``long_pair_s`` are CPU time, ``one_worker_s`` and
    ``two_workers_s`` wall time. ``worker_share`` is the share of a core that each of the two had.
    """

    pair_s: float
    long_pair_s: float
    one_worker_s: float
    two_workers_s: float
    worker_share: float

    def ratios(self, workload: Workload) -> dict[str, float]:
        """The ratios by which we judge, as explained in `Speed`."""
        return {
            "long_flight_cost_ratio": (self.long_pair_s / workload.long_s)
            / (self.pair_s / MEASURED_PLAN.duration_s),
            "two_worker_speedup": self.one_worker_s / self.two_workers_s,
        }


@dataclass(frozen=True, slots=True)
class Speed:
    """Medians over the rounds; a ratio is taken within its round, where both met one machine.

    ``trajectory_ratio``, ``pair_ratio``: to the bare loop. ``long_flight_cost_ratio``: a
    simulated second of the long pair against one of the 300 s pair. ``two_worker_speedup``: the
    rate of faulted flights on two worker processes against one. ``busy``: others took part of the
    workers' cores, so that the speedup says little.
    """

    trajectory_ratio: float
    pair_ratio: float
    long_flight_cost_ratio: float
    two_worker_speedup: float
    busy: bool
    bare_s: float
    trajectory_s: float
    pair_s: float
    long_pair_s: float
    fault: str
    steps: int
    workload: Workload
    rounds: tuple[Round, ...]
    long_rounds: tuple[LongRound, ...]

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return asdict(self)


def measure(
    rounds: int,
    workload: Workload = FULL,
    progress: Callable[[float], None] = lambda share: None,
) -> Speed:
    """Time the twin; ``progress`` gets the share done. Raises `InputError` for bad rounds.

    Of ``rounds`` rounds, as many as `LONG_ROUNDS` are followed by a long one.
    """
    rounds = int(checked_number("rounds", rounds, 1, 1000))
    fly_pair(MEASURED_PLAN, FAULT)  # imports, caches and page faults belong to no round
    done: list[Round] = []
    long: list[LongRound] = []
    with workers(1) as one, workers(2) as two:
        for _ in range(rounds):
            done.append(_round())
            if len(long) < LONG_ROUNDS:
                long.append(_long_round(workload, one, two))
            progress(len(done) / rounds)
    return Speed(
        **_medians([each.ratios() for each in done]),
        **_medians([each.ratios(workload) for each in long]),
        **_medians([asdict(each) for each in done]),
        busy=median(each.worker_share for each in long) < QUIET_SHARE,
        long_pair_s=median(each.long_pair_s for each in long),
        fault=FAULT.mode,
        steps=MEASURED_PLAN.n_steps,
        workload=workload,
        rounds=tuple(done),
        long_rounds=tuple(long),
    )


def _medians(rows: list[dict[str, float]]) -> dict[str, float]:
    return {name: median(row[name] for row in rows) for name in rows[0]}


def _round() -> Round:
    return Round(
        bare_s=bare_loop_s(MEASURED_PLAN),
        trajectory_s=_cpu_seconds(lambda: fly(MEASURED_PLAN, FAULT)),
        pair_s=_cpu_seconds(lambda: fly_pair(MEASURED_PLAN, FAULT)),
    )


def _long_round(workload: Workload, one: Client, two: Client) -> LongRound:
    long_plan = Plan(MEASURED_PLAN.altitude_ft, MEASURED_PLAN.speed_kt, duration_s=workload.long_s)
    one_worker_s, _ = _shared_out(one, workload.flights)
    two_workers_s, worker_share = _shared_out(two, workload.flights)
    return LongRound(
        pair_s=_cpu_seconds(lambda: fly_pair(MEASURED_PLAN, FAULT)),
        long_pair_s=_cpu_seconds(lambda: fly_pair(long_plan, FAULT)),
        one_worker_s=one_worker_s,
        two_workers_s=two_workers_s,
        worker_share=worker_share,
    )


@contextmanager
def workers(number: int) -> Iterator[Client]:
    """So many worker processes that have flown before."""
    with pool_client(number) as client:
        client.run(fly_on_worker, 0)
        yield client


@dataclass(frozen=True, slots=True)
class Flown:
    """What a worker tells of a flight: a digest of its channels, and the time it took."""

    digest: str
    cpu_s: float
    wall_s: float


def fly_on_worker(seed: int) -> Flown:
    """One faulted flight from the paper's cruise box, wherever this runs."""
    cpu_s, wall_s = time.process_time(), time.perf_counter()
    flight = fly(Plan.sampled(seed), FAULT)
    digest = hashlib.sha256(flight.channels.tobytes()).hexdigest()
    return Flown(digest, time.process_time() - cpu_s, time.perf_counter() - wall_s)


def _shared_out(client: Client, flights: int) -> tuple[float, float]:
    """Wall seconds for that many flights, and the share of a core that a worker had."""
    started = time.perf_counter()
    flown: list[Flown] = client.gather(client.map(fly_on_worker, range(flights), pure=False))
    wall_s = time.perf_counter() - started
    return wall_s, sum(each.cpu_s for each in flown) / sum(each.wall_s for each in flown)


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

    return _cpu_seconds(loop)


def _cpu_seconds(work: Callable[[], object]) -> float:
    started = time.process_time()
    work()
    return time.process_time() - started

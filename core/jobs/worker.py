"""What a worker does with a run: fly the pair, diagnose it as it goes, write the report."""

import asyncio
import os
import pickle
import secrets
import signal
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from distributed import Worker, WorkerPlugin, get_worker

from core.diagnosis.diagnosis import Diagnosis
from core.errors import MirrorTwinError
from core.fmea.fault import Fault
from core.jobs.events import (
    SAMPLE_STRIDE,
    Cancelled,
    Diagnosed,
    Event,
    Failed,
    Probabilities,
    Progress,
    Reported,
    Samples,
)
from core.report.grounded import GroundedReport
from core.twin.plan import DT_S, Plan
from core.twin.trajectory import Pair, Trajectory

if TYPE_CHECKING:  # it loads torch
    from core.diagnosis.predict import Residual

BLOCK_S = 5.0
"""Flight time between two messages: the classifier's stride, about 10 ms of computing."""

FLOWN = 0.9
"""The share of a run's progress that flying takes; diagnosis and report are quick."""

NICENESS = 5
"""How far a worker of the server's own stands back for the server and the browser."""

TOPIC = "mirrortwin-runs"
"""The Dask event topic of all runs. One for all, because a scheduler never forgets a topic."""

Emit = Callable[[Event], None]

_WARM_UP_PLAN = Plan(duration_s=30.0)
_WARM_UP_FAULT = Fault("baffle_crack", onset_s=10.0)


@dataclass(frozen=True, slots=True, eq=False)
class RunResult:
    """What a run comes to."""

    pair: Pair
    diagnosis: Diagnosis
    report: GroundedReport


def fly_run(run_id: str, plan: Plan, fault: Fault, emit: Emit) -> RunResult:
    """Fly, diagnose and report on one run, in the calling process.

    ``emit`` receives Progress, Samples, Probabilities, Diagnosed and Reported as they come; it may
    raise to stop the flight, at the latest one block (`BLOCK_S`) on. Raises `InputError` (onset
    beyond the end), `FlightError` (the plan cannot be flown) or `MirrorTwinError` (no model).
    """
    # Here and not above: the server imports this module too, and has no use for torch or JSBSim.
    from core.diagnosis.predict import load_diagnoser
    from core.report.case import open_case
    from core.report.grounded import grounded_template

    emit(Progress(run_id, "flying", 0.0))
    stream = load_diagnoser().stream()
    blocks: list[Pair] = []
    for block, progress in _blocks(plan, fault):
        blocks.append(block)
        emit(_samples(run_id, block))
        for time_s, probabilities in stream.push(block):
            emit(Probabilities(run_id, float(time_s), probabilities))
        emit(Progress(run_id, "flying", FLOWN * progress))
    emit(Progress(run_id, "diagnosing", FLOWN))
    diagnosis = stream.finish()
    emit(Diagnosed(run_id, diagnosis))
    emit(Progress(run_id, "reporting", 0.95))
    report = grounded_template(open_case(diagnosis))
    emit(Reported(run_id, report))
    return RunResult(_joined(blocks), diagnosis, report)


def fly_task(key: str, run_id: str, plan: Plan, fault: Fault) -> RunResult | Failed | Cancelled:
    """`fly_run` as the Dask task ``key``, with its events sent to `TOPIC`.

    Each message is (run id, key, start, pickled event); ``start`` differs every time that a task
    is begun, so that whoever listens can tell a second attempt from the first. Errors meant for the
    user come back as a value: raised, Dask would print their traceback on the worker's terminal.
    """
    worker = get_worker()
    start = secrets.token_hex(8)

    def emit(event: Event) -> None:
        if _is_cancelled(worker, key):
            raise _CancelledError
        worker.log_event(TOPIC, (run_id, key, start, pickle.dumps(event, protocol=5)))

    try:
        return fly_run(run_id, plan, fault, emit)
    except _CancelledError:
        return Cancelled(run_id)
    except MirrorTwinError as error:
        return Failed(run_id, str(error), retryable=False)


def fly_unseen_task(plan: Plan, fault: Fault) -> RunResult | Failed:
    """`fly_run` as a Dask task that tells nobody what it flies."""
    try:
        return fly_run("unseen", plan, fault, lambda event: None)
    except MirrorTwinError as error:
        return Failed("", str(error), retryable=False)


def diagnose_task(pair: Pair, plan: Plan, residual: "Residual") -> Diagnosis | Failed:
    """Diagnose a flown pair by one way to form residuals, as a Dask task.

    An error meant for the user comes back as a value, as in `fly_task`.
    """
    from core.diagnosis.predict import load_diagnoser

    try:
        return load_diagnoser(residual).diagnose(pair, plan)
    except MirrorTwinError as error:
        return Failed("", str(error), retryable=False)


class WarmUp(WorkerPlugin):
    """Flies a short run when a worker starts, so that its first real one is as quick as any.

    On the thread that flies the real ones, which thus wait for it, while the worker still hears
    that it is to close.
    """

    name = "mirrortwin-warm-up"

    async def setup(self, worker: Worker) -> None:
        """Called by Dask on every worker, also on one that replaces another."""
        await asyncio.get_running_loop().run_in_executor(worker.executors["default"], _warm_up)


def _warm_up() -> None:
    # An error is said by the run that meets it, where the user can read it.
    with suppress(MirrorTwinError):
        fly_run("warm-up", _WARM_UP_PLAN, _WARM_UP_FAULT, lambda event: None)


class HouseManners(WorkerPlugin):
    """How a worker behaves that shares the server's terminal and machine.

    It leaves Ctrl-C to the server, which then closes its workers in good order, and lets the
    server and the browser go first: a flight never holds up the screen that shows it. A worker
    started by hand must heed Ctrl-C itself, and has a machine of its own.
    """

    name = "mirrortwin-house-manners"

    def setup(self, worker: Worker) -> None:
        """Called by Dask on the worker's main thread."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        os.nice(NICENESS)
        # Linux weighs whole sessions against each other before it looks at the niceness within.
        with suppress(OSError):
            os.setsid()
            Path("/proc/self/autogroup").write_text(str(NICENESS), encoding="ascii")


class _CancelledError(Exception):
    """The run is no longer wanted."""


def _is_cancelled(worker: Worker, key: str) -> bool:
    # Dask does not interrupt a running task, but tells its worker that nobody wants it any more:
    # on cancel, and also when the server that asked for it is gone.
    task = worker.state.tasks.get(key)
    return task is None or task.state == "cancelled"


def _blocks(plan: Plan, fault: Fault) -> Iterator[tuple[Pair, float]]:
    from core.twin.flight import PairFlight

    flight = PairFlight(plan, fault)
    while (block := flight.advance(BLOCK_S)) is not None:
        yield block, flight.progress


def _samples(run_id: str, block: Pair) -> Samples:
    """Every `SAMPLE_STRIDE`-th sample of a block; blocks begin on such a sample."""
    faulted, mirror = block.faulted[::SAMPLE_STRIDE], block.mirror[::SAMPLE_STRIDE]

    def single(values: np.ndarray[Any, Any]) -> np.ndarray[Any, np.dtype[np.float32]]:
        return np.ascontiguousarray(values, dtype=np.float32)

    return Samples(
        run_id,
        index=round(float(faulted.time_s[0]) / (SAMPLE_STRIDE * DT_S)),
        time_s=single(faulted.time_s),
        faulted=single(faulted.channels),
        mirror=single(mirror.channels),
        faulted_states=single(faulted.states),
        mirror_states=single(mirror.states),
    )


def _joined(blocks: list[Pair]) -> Pair:
    return Pair(
        Trajectory.joined([block.faulted for block in blocks]),
        Trajectory.joined([block.mirror for block in blocks]),
    )

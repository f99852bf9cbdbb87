"""The tasks of a worker: fly the pair, diagnose it meanwhile, write the report."""

import asyncio
import os
import pickle
import secrets
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from distributed import Worker, WorkerPlugin, get_worker, secede

from core.arrays import Array32
from core.clock import DT_S
from core.diagnosis.diagnosis import Diagnosis
from core.errors import MirrorTwinError
from core.fmea.fault import Fault
from core.jobs.events import (
    SAMPLE_STRIDE,
    Acted,
    Cancelled,
    Diagnosed,
    Event,
    Failed,
    Probabilities,
    Progress,
    Reported,
    Samples,
)
from core.jobs.extremes import Seconds
from core.jobs.live import Inbox, LiveFlight
from core.report.grounded import GroundedReport
from core.twin.actions import Action, done_by, in_order
from core.twin.plan import Conditions, Plan
from core.twin.trajectory import Pair

if TYPE_CHECKING:  # it loads torch
    from core.diagnosis.predict import Residual

BLOCK_S = 5.0
"""Flight time between two messages: the classifier's stride, about 10 ms of computing."""

FLOWN = 0.9
"""The share of a run's progress that flying takes; diagnosis and report are quick."""

NICENESS = 5
"""Niceness of local workers, so that server and browser get the CPU first."""

TOPIC = "mirrortwin-runs"
"""The Dask event topic of all runs. One for all, because a scheduler never forgets a topic."""

Emit = Callable[[Event], None]

_WARM_UP_PLAN = Plan(duration_s=30.0)
_WARM_UP_FAULT = Fault("baffle_crack", onset_s=10.0)


@dataclass(frozen=True, slots=True, eq=False)
class RunResult:
    """Result of a run; ``actions`` are those that took effect before its end."""

    pair: Pair
    diagnosis: Diagnosis
    report: GroundedReport
    actions: tuple[Action, ...] = ()


def fly_run(
    run_id: str, plan: Plan, fault: Fault, emit: Emit, actions: Iterable[Action] = ()
) -> RunResult:
    """Fly, diagnose and report on one run, in the calling process.

    ``emit`` receives Progress, Samples, Probabilities, Diagnosed and Reported as they come; it may
    raise to stop the flight, at the latest one block (`BLOCK_S`) on. Raises `InputError` (onset
    or action beyond the end), `FlightError` (the plan cannot be flown) or `MirrorTwinError` (no
    model).
    """
    listed = tuple(actions)
    blocks = _blocks(plan, fault, listed)
    return _followed(run_id, plan.conditions, blocks, emit, lambda: listed)


def _followed(
    run_id: str,
    conditions: Conditions,
    flight: Iterator[tuple[Pair, float]],
    emit: Emit,
    actions: Callable[[], tuple[Action, ...]],
) -> RunResult:
    """Follow a flight given as blocks, each with the share flown by its end, to its result.

    ``actions`` gives what was asked for on the way, once it is over; what came after its end, on
    the ground, was not done.
    """
    # Here and not above: the server imports this module too, and has no use for torch or JSBSim.
    from core.diagnosis.interventions import interventions
    from core.diagnosis.predict import load_diagnoser
    from core.report.case.case import open_case
    from core.report.grounded import grounded_template

    emit(Progress(run_id, "flying", 0.0))
    stream = load_diagnoser(conditions=conditions).stream()
    blocks: list[Pair] = []
    seconds = Seconds()
    for block, progress in flight:
        blocks.append(block)
        emit(_samples(run_id, block, seconds.push(block)))
        for time_s, probabilities in stream.push(block):
            emit(Probabilities(run_id, float(time_s), probabilities))
        emit(Progress(run_id, "flying", FLOWN * progress))
    emit(Progress(run_id, "diagnosing", FLOWN))
    pair = Pair.joined(blocks)
    done = done_by(actions(), float(pair.faulted.time_s[-1]))
    diagnosis = stream.finish(interventions(done, pair.ground_s))
    emit(Diagnosed(run_id, diagnosis))
    emit(Progress(run_id, "reporting", 0.95))
    report = grounded_template(open_case(diagnosis))
    emit(Reported(run_id, report))
    return RunResult(pair, diagnosis, report, done)


class _Line:
    """The line from the Dask task ``key`` to the listeners of `TOPIC`, for as long as it is wanted.

    Each message is (run id, key, worker's address, start, pickled event); ``start`` differs every
    time that a task starts, so that a second attempt can be told from the first.
    """

    def __init__(self, key: str, run_id: str) -> None:
        self._worker, self._key, self._run_id = get_worker(), key, run_id
        self.start = secrets.token_hex(8)

    def emit(self, event: Event) -> None:
        self.check_wanted()
        # Not 5: arrays would come back as views, each two objects more to look through for garbage.
        pickled = pickle.dumps(event, protocol=4)
        self._worker.log_event(
            TOPIC, (self._run_id, self._key, self._worker.address, self.start, pickled)
        )

    def check_wanted(self) -> None:
        """Raise if the run is no longer wanted."""
        # Dask does not interrupt a running task, but tells its worker that nobody wants it any
        # more: on cancel, and also when the server that asked for it is gone.
        task = self._worker.state.tasks.get(self._key)
        if task is None or task.state == "cancelled":
            raise _CancelledError


def _outcome(run_id: str, fly: Callable[[], RunResult]) -> RunResult | Failed | Cancelled:
    """What ``fly`` returns. An error meant for the user comes back as a value, too.

    Raised, Dask would print its traceback on the worker's terminal.
    """
    try:
        return fly()
    except _CancelledError:
        return Cancelled(run_id)
    except MirrorTwinError as error:
        return Failed(run_id, str(error), retryable=False)


def fly_task(
    key: str, run_id: str, plan: Plan, fault: Fault, actions: tuple[Action, ...]
) -> RunResult | Failed | Cancelled:
    """`fly_run` as the Dask task ``key``, with its events sent to `TOPIC`."""
    line = _Line(key, run_id)
    return _outcome(run_id, lambda: fly_run(run_id, plan, fault, line.emit, actions))


def live_task(key: str, run_id: str, plan: Plan, fault: Fault) -> RunResult | Failed | Cancelled:
    """A live flight as the Dask task ``key``: it flies by the orders that it gets.

    It leaves its place among the worker's threads, since it mostly waits: a worker flies many live
    flights, and whole runs between their steps.
    """
    from core.twin.flight import PairFlight

    line = _Line(key, run_id)

    def fly() -> RunResult:
        with Inbox(line.start) as inbox:
            line.emit(Progress(run_id, "flying", 0.0))  # the server answers with orders
            flight = LiveFlight(
                PairFlight(plan, fault, live=True),
                inbox,
                lambda done: line.emit(Acted(run_id, done)),
                line.check_wanted,
            )
            with closing(flight.blocks()) as blocks:
                return _followed(
                    run_id,
                    plan.conditions,
                    blocks,
                    line.emit,
                    lambda: in_order(flight.actions, plan),
                )

    secede()
    return _outcome(run_id, fly)


def fly_unseen_task(plan: Plan, fault: Fault) -> RunResult | Failed:
    """`fly_run` as a Dask task that tells nobody what it flies."""
    try:
        return fly_run("unseen", plan, fault, lambda event: None)
    except MirrorTwinError as error:
        return Failed("", str(error), retryable=False)


def diagnose_task(
    pair: Pair, plan: Plan, residual: "Residual", actions: tuple[Action, ...]
) -> Diagnosis | Failed:
    """Diagnose a flown pair by one way to form residuals, as a Dask task.

    Of the ``actions`` it learns what it may know.

    An error meant for the user comes back as a value, as in `fly_task`.
    """
    from core.diagnosis.interventions import interventions
    from core.diagnosis.predict import load_diagnoser

    try:
        diagnoser = load_diagnoser(residual, conditions=plan.conditions)
        known = interventions(actions, pair.ground_s)
        return diagnoser.diagnose(pair, plan, interventions=known)
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


class LocalWorkerSettings(WorkerPlugin):
    """Settings of a worker that shares the server's terminal and machine.

    It leaves Ctrl-C to the server, which then closes its workers in good order, and lets the
    server and the browser go first: a flight never holds up the screen that shows it. A worker
    started by hand must heed Ctrl-C itself, and has a machine of its own.
    """

    name = "mirrortwin-local-worker"

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


def _blocks(plan: Plan, fault: Fault, actions: tuple[Action, ...]) -> Iterator[tuple[Pair, float]]:
    from core.twin.flight import PairFlight

    flight = PairFlight(plan, fault, actions)
    while (block := flight.advance(BLOCK_S)) is not None:
        yield block, flight.progress


def _samples(run_id: str, block: Pair, extremes: Array32) -> Samples:
    """Every `SAMPLE_STRIDE`-th sample of a block, which begins on such a sample."""
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
        extremes=extremes,
    )

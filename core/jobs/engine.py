"""The job engine: takes runs, has workers fly them, publishes their events, stores results."""

import logging
import pickle
import secrets
import threading
from collections import OrderedDict
from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING

from distributed import CancelledError, Client, Future, KilledWorker
from distributed.client import ClosedClientError

from core.diagnosis.diagnosis import Diagnosis
from core.errors import InputError, StoreError, WorkerError
from core.fmea.fault import Fault
from core.jobs.answers import LOOK_S, WORKER_DIED, Answers, cancel
from core.jobs.cluster import Cluster
from core.jobs.events import (
    Cancelled,
    Event,
    Failed,
    FinalEvent,
    Finished,
    Progress,
    Stage,
    Started,
)
from core.jobs.feed import Feed, Subscription
from core.jobs.live import Control, checked_pace
from core.jobs.submitted import Outcome, Submitted
from core.jobs.worker import TOPIC, RunResult, diagnose_task, fly_task, fly_unseen_task, live_task
from core.store.locks import claim
from core.store.records import RunRecord
from core.store.store import SERVER_STOPPED, RunStore
from core.twin.actions import Action, commanded, in_order
from core.twin.plan import Plan
from core.workers.pool import START_S
from core.workers.scheduler import RemoteScheduler

if TYPE_CHECKING:  # it loads torch
    from core.diagnosis.predict import Residual

logger = logging.getLogger(__name__)

MAX_ATTEMPTS = 2
"""Most attempts at a run, so that one that kills its worker does not kill them all."""

RECENT_RUNS = 8
"""Ended runs whose events are kept in memory; the results of all are in the store."""

MAX_LIVE = 100
"""Live flights in the air at one time: each holds a thread and some memory of a worker."""

STORED = 0.97
"""Progress when all that is left is to store the run."""

NO_WORKER_SAID_S = 5.0
"""After so long its page says that there is none."""

CONNECTION_LOST = "the connection to the Dask scheduler broke during this run; press Run again"
BROKEN = "the worker could not fly this run because of a fault in the program: {}"


class Engine:
    """Flies runs on Dask workers and stores them. Thread-safe.

    `submit`, `retry` and `cancel` take some milliseconds (an SQLite commit, a message to Dask), or
    up to `CONNECT_TIMEOUT_S` after a remote scheduler was lost: on an event loop
    call them by ``asyncio.to_thread``. `wait` blocks. All else returns at once.
    """

    def __init__(
        self,
        store: RunStore,
        scheduler: RemoteScheduler | None = None,
        n_workers: int = 2,
        no_worker_s: float = START_S,
    ) -> None:
        """Start ``n_workers`` local workers or use those at ``scheduler``; raises `WorkerError`.

        Runs that an earlier process left unfinished in ``store`` are marked as failed. What waits
        fails after ``no_worker_s`` seconds without any worker.
        """
        self.store = store
        self._no_worker_s = no_worker_s
        self._cluster = Cluster(scheduler, n_workers)
        self._answers = Answers(self._cluster, no_worker_s)
        self._lock = threading.RLock()
        self._runs: OrderedDict[str, Submitted] = OrderedDict()
        self._closing = False
        self._claim = claim(store.root, store.fail_unfinished)
        self._closed = threading.Event()
        threading.Thread(target=self._look, name="mirrortwin-look", daemon=True).start()

    def submit(
        self, plan: Plan, fault: Fault, actions: Iterable[Action] = (), *, pace: float | None = None
    ) -> str:
        """Enter a run and have it flown; returns its id.

        With a ``pace`` (one of `core.jobs.live.PACES`) it is flown live: `act` and `steer` reach
        it on its way. Raises `InputError` (onset or action beyond the end, no such pace),
        `StoreError` or `WorkerError`.
        """
        fault.check_within(plan.duration_s)
        listed = in_order(actions, plan)
        control = None if pace is None else Control(plan, checked_pace(pace), listed)
        client = self._cluster.client()
        if control is not None and self._count_live() >= MAX_LIVE:
            raise WorkerError(f"{MAX_LIVE} live flights are in the air; end one of them first")
        record = self.store.create(plan, fault, listed)
        self._launch(client, record, control)
        return record.id

    def act(self, run_id: str, action: Action) -> None:
        """Do something during a live flight: at its time, or now if that has passed.

        It is stored before it is sent to the worker; an Acted event follows. Raises `InputError` if
        the run is not in the air or ends before, `StoreError`.
        """
        with self._lock:
            self._in_the_air(run_id).act(action)

    def steer(
        self, run_id: str, *, pace: float | None = None, is_paused: bool | None = None
    ) -> None:
        """Set the pace of a live flight, pause it or resume it; a Paced event follows.

        Raises `InputError` if the run is not in the air, or there is no such pace.
        """
        with self._lock:
            self._in_the_air(run_id).steer(pace, is_paused)

    def retry(self, run_id: str) -> None:
        """Fly a failed or cancelled run again under its own name.

        Subscribe again to see it. Raises `InputError` if it is done or still being flown,
        `StoreError` or `WorkerError`.
        """
        client = self._cluster.client()
        with self._lock:
            record = self._record(run_id)
            if record.status not in ("failed", "cancelled"):
                raise InputError("run", f"{run_id} is {record.status}: there is nothing to retry")
            record = self.store.update(run_id, status="queued", error=None, attempts=0)
            self._launch(client, record)

    def cancel(self, run_id: str) -> None:
        """Stop a run, at the latest one block of flight on; nothing happens if it has ended.

        A Cancelled event follows. Raises `StoreError` if there is no such run, `WorkerError` if
        another process is flying it.
        """
        with self._lock:
            live = self._runs.get(run_id)
            if live is None and not self.store.get(run_id).finished:
                raise WorkerError(f"run {run_id} is flown by another server; cancel it there")
            future = live.future if live else None
            if live is None or future is None:
                return
            live.is_cancelled = True
        cancel(future)

    def diagnose(self, run_id: str, residual: "Residual") -> Diagnosis:
        """The diagnosis of a stored run, its residuals formed in one way or another.

        Blocks for some tenths of a second, or behind the flights that come before it. Raises
        `StoreError`, or `WorkerError` saying why the run cannot be diagnosed so.
        """
        record = self.store.get(run_id)
        pair = self.store.load_pair(run_id)
        plan = commanded(record.plan, record.actions)
        return self._answers.wait_for(diagnose_task, pair, plan, residual, record.actions)

    def fly_unseen(self, plan: Plan, fault: Fault) -> RunResult:
        """Fly a run without a record and without events.

        Blocks for a second or two. Raises `WorkerError` saying why it could not be flown.
        """
        return self._answers.wait_for(fly_unseen_task, plan, fault, priority=0)

    def history(self, run_id: str) -> list[Event]:
        """Every event so far, from the last Started on if a worker died.

        For a run of an earlier process, or of long ago, only how it ended. Raises `StoreError`.
        """
        return self._feed(run_id).events()

    def subscribe(self, run_id: str) -> Subscription:
        """A reader of the run's events, past and to come; raises `StoreError`."""
        return self._feed(run_id).subscribe()

    def wait(self, run_id: str, timeout: float | None = None) -> RunRecord:
        """The record once the run has ended; raises `WorkerError` after ``timeout`` seconds."""
        if self._feed(run_id).wait(timeout) is None:
            raise WorkerError(f"run {run_id} is not done after {timeout:g} s")
        return self._record(run_id)

    def wait_warm(self, timeout: float = 60.0) -> None:
        """Block until the workers have loaded all they need; raises `WorkerError`."""
        self._cluster.wait_warm(timeout)

    def close(self) -> None:
        """Stop all runs (their records say that the server stopped) and the local workers."""
        self._closed.set()
        with self._lock:
            self._closing = True
            unfinished = [live for live in self._runs.values() if live.feed.final is None]
        for live in unfinished:
            if live.future is not None:
                cancel(live.future)
        for live in unfinished:
            live.feed.wait(timeout=5)
        self._cluster.close()
        if self._claim is not None:
            self._claim.close()

    # -- inside ----------------------------------------------------------------------------------

    def _launch(self, client: Client, record: RunRecord, control: Control | None = None) -> None:
        key = f"fly-{record.id}-{secrets.token_hex(4)}"
        live = Submitted(record, key, client, self.store, control=control)
        live.feed.append(Progress(record.id, "waiting", 0.0))
        with self._lock:
            self._runs[record.id] = live
            self._runs.move_to_end(record.id)
            self._forget_old_runs()
            try:
                live.future = self._entered(client, live)
            except ClosedClientError:
                self._end(live, Failed(record.id, CONNECTION_LOST, retryable=True))
            else:
                live.future.add_done_callback(partial(self._settle, live))

    def _entered(self, client: Client, live: Submitted) -> Future[Outcome]:
        """The run as a task of the cluster's."""
        # Every time: a scheduler that was restarted has forgotten who listens.
        client.subscribe_topic(TOPIC, self._on_message)
        record = live.record
        flight = (live.key, record.id, record.plan, record.fault)
        task, more = (fly_task, (record.actions,)) if live.control is None else (live_task, ())
        # First come, first flown, also of runs that come together and wait for a worker.
        return client.submit(task, *flight, *more, key=live.key, pure=False, fifo_timeout="0 ms")

    def _forget_old_runs(self) -> None:
        ended = [run_id for run_id, live in self._runs.items() if live.feed.final is not None]
        for run_id in ended[:-RECENT_RUNS]:
            del self._runs[run_id]

    def _count_live(self) -> int:
        return sum(live.is_live for live in self._runs.values())

    def _in_the_air(self, run_id: str) -> Submitted:
        live = self._runs.get(run_id)
        if live is None or not live.is_live:
            raise InputError("run", f"{run_id} is not a live flight in the air")
        return live

    async def _on_message(self, message: tuple[float, tuple[str, str, str, str, bytes]]) -> None:
        """Take a worker's message; called on Dask's event loop, in the order of sending."""
        _, (run_id, key, address, start, pickled) = message
        live = self._runs.get(run_id)
        if live is None or live.key != key:
            return  # of another server on the same scheduler, or of a submission given up
        if start != live.start and not self._begin(live, address, start):
            if live.future is not None:
                await live.future.cancel()
            return
        with self._lock:
            live.feed.append(live.note_event(pickle.loads(pickled)))

    def _begin(self, live: Submitted, address: str, start: str) -> bool:
        """Note that a worker has started the run; False if that is one attempt too many."""
        with self._lock:
            attempt = live.record.attempts + 1
            if live.feed.final is not None or attempt > MAX_ATTEMPTS:
                live.attempts_exhausted = True
                return False
            live.change(status="running", attempts=attempt)
            event = Started(live.record.id, attempt)
            live.is_unmanned = False
            is_open = live.feed.append(event) if attempt == 1 else live.feed.restart(event)
            if is_open:
                live.assign_worker(address, start)
            return is_open

    def _look(self) -> None:
        """Have no run wait for a worker without a word, or for ever; on a thread of its own."""
        while not self._closed.wait(LOOK_S):
            with self._lock:
                waiting = [live for live in self._runs.values() if live.future is not None]
            without_s = self._cluster.without_workers_s() if waiting else 0.0
            for live in waiting:
                self._report_missing_workers(live, without_s)

    def _report_missing_workers(self, live: Submitted, without_s: float) -> None:
        with self._lock:
            future = live.future
            if future is None:
                return
            if live.client.status == "closed":
                # A client cancels what it holds when it closes, but not what it took meanwhile.
                self._end(live, Failed(live.record.id, CONNECTION_LOST, retryable=True))
                return
            is_unmanned = without_s > min(NO_WORKER_SAID_S, self._no_worker_s)
            if is_unmanned != live.is_unmanned:
                live.is_unmanned = is_unmanned
                stage: Stage = "no_worker" if is_unmanned else "waiting"
                live.feed.append(Progress(live.record.id, stage, 0.0))
            live.is_given_up = without_s > self._no_worker_s
        if live.is_given_up:
            cancel(future)

    def _settle(self, live: Submitted, future: Future[Outcome]) -> None:
        """Store the outcome of a run; called on Dask's callback thread, one run at a time."""
        run_id = live.record.id
        final: FinalEvent
        try:
            final = self._stored(live, future.result())
        except CancelledError:
            final = self._interrupted(live)
        except KilledWorker:
            final = Failed(run_id, WORKER_DIED, retryable=True)
        except StoreError as error:
            final = Failed(run_id, str(error), retryable=True)
        except Exception as error:  # a bug, but the page must not wait for ever
            logger.exception("run %s", run_id)
            final = Failed(run_id, BROKEN.format(error or type(error).__name__), retryable=True)
        self._end(live, final)

    def _end(self, live: Submitted, final: FinalEvent) -> None:
        with self._lock:
            live.future = None  # lets the worker forget the flight
            if live.feed.final is not None:
                return
            if isinstance(final, Failed):
                live.change(status="failed", error=final.message)
            elif isinstance(final, Cancelled):
                live.change(status="cancelled")
            live.feed.append(final)

    def _stored(self, live: Submitted, outcome: Outcome) -> FinalEvent:
        if not isinstance(outcome, RunResult):
            return outcome
        run_id = live.record.id
        live.feed.append(Progress(run_id, "storing", STORED))
        if outcome.actions != live.record.actions:
            with self._lock:
                live.keep(outcome.actions)
        self.store.save_pair(run_id, outcome.pair)
        live.record = self.store.save_result(run_id, outcome.diagnosis, outcome.report)
        return Finished(run_id)

    def _interrupted(self, live: Submitted) -> FinalEvent:
        run_id = live.record.id
        if live.is_cancelled:
            return Cancelled(run_id)
        if live.is_given_up:
            return Failed(run_id, self._answers.no_worker, retryable=True)
        if live.attempts_exhausted:
            return Failed(run_id, WORKER_DIED, retryable=True)
        message = SERVER_STOPPED if self._closing else CONNECTION_LOST
        return Failed(run_id, message, retryable=True)

    def _record(self, run_id: str) -> RunRecord:
        live = self._runs.get(run_id)
        return live.record if live else self.store.get(run_id)

    def _feed(self, run_id: str) -> Feed:
        live = self._runs.get(run_id)
        if live is not None:
            return live.feed
        feed = Feed()
        feed.append(_end_of(self.store.get(run_id)))
        return feed


def _end_of(record: RunRecord) -> FinalEvent:
    if record.status == "done":
        return Finished(record.id)
    if record.status == "cancelled":
        return Cancelled(record.id)
    if record.status == "failed":
        return Failed(record.id, record.error or "this run failed", retryable=True)
    message = "another server is flying this run; reload the page when it is done"
    return Failed(record.id, message, retryable=False)

"""Runs on a real local cluster: two worker processes, real flights."""

import asyncio
import math
from pathlib import Path

import numpy as np
import psutil
import pytest
from jobs_support import CRACK, PATIENCE_S, SHORT_PLAN, read_all, read_until, samples_of

from core.errors import FlightError, InputError, StoreError, WorkerError
from core.fmea.fault import Fault
from core.jobs.engine import RECENT_RUNS, Engine
from core.jobs.events import (
    Cancelled,
    Diagnosed,
    Event,
    Failed,
    Finished,
    Probabilities,
    Progress,
    Reported,
    Samples,
    Started,
)
from core.jobs.worker import fly_run
from core.store.store import SERVER_STOPPED, RunStore
from core.twin.flight import PairFlight
from core.twin.plan import Plan, Weather
from core.twin.trajectory import Pair

pytestmark = pytest.mark.alone

LONG_PLAN = Plan(duration_s=7200.0)


def test_a_run_from_submission_to_store(engine: Engine, short_pair: Pair) -> None:
    run_id = engine.submit(SHORT_PLAN, CRACK)
    events = read_all(engine.subscribe(run_id))
    assert events[:2] == [Progress(run_id, "waiting", 0.0), Started(run_id, 1)]
    assert events[-1] == Finished(run_id)
    kinds = [type(event) for event in events]
    assert kinds.index(Samples) < kinds.index(Probabilities) < kinds.index(Diagnosed)
    assert kinds.index(Diagnosed) < kinds.index(Reported) < kinds.index(Finished)
    assert all(event.run_id == run_id for event in events)
    record = engine.wait(run_id, timeout=0)
    assert record == engine.store.get(run_id)
    assert (record.status, record.attempts, record.error) == ("done", 1, None)
    pair = engine.store.load_pair(run_id)
    assert pair.faulted.channels.tobytes() == short_pair.faulted.channels.tobytes()
    assert pair.mirror.states.tobytes() == short_pair.mirror.states.tobytes()
    diagnosis, report = engine.store.load_result(run_id)
    assert record.top == diagnosis.top
    assert Reported(run_id, report) in events


def test_a_worker_and_this_process_give_the_same(engine: Engine) -> None:
    here: list[Event] = []
    result = fly_run("here", SHORT_PLAN, CRACK, here.append)
    run_id = engine.submit(SHORT_PLAN, CRACK)
    there = read_all(engine.subscribe(run_id))
    for ours, theirs in zip(samples_of(here), samples_of(there), strict=True):
        assert (ours.index, ours.time_s.tobytes()) == (theirs.index, theirs.time_s.tobytes())
        assert ours.faulted.tobytes() == theirs.faulted.tobytes()
        assert ours.mirror_states.tobytes() == theirs.mirror_states.tobytes()
    assert engine.store.load_result(run_id)[0].to_dict() == result.diagnosis.to_dict()


def test_samples_come_while_the_flight_is_flown(engine: Engine) -> None:
    run_id = engine.submit(LONG_PLAN, CRACK)
    read_until(engine.subscribe(run_id), Samples)
    assert engine.store.get(run_id).status == "running"
    engine.cancel(run_id)
    engine.wait(run_id, timeout=PATIENCE_S)


def test_history_repeats_what_was_told(engine: Engine) -> None:
    run_id = engine.submit(SHORT_PLAN, Fault())
    told = read_all(engine.subscribe(run_id))
    assert engine.history(run_id) == told == read_all(engine.subscribe(run_id))


def test_two_runs_at_once_do_not_mix(engine: Engine) -> None:
    plans = [Plan(duration_s=60.0, seed=seed) for seed in (1, 2)]
    runs = [engine.submit(plan, CRACK) for plan in plans]
    subscriptions = [engine.subscribe(run_id) for run_id in runs]
    for run_id, plan, subscription in zip(runs, plans, subscriptions, strict=True):
        events = read_all(subscription)
        assert {event.run_id for event in events} == {run_id}
        alone: list[Event] = []
        fly_run(run_id, plan, CRACK, alone.append)
        streamed, expected = (
            np.concatenate([part.faulted for part in samples_of(some)]) for some in (events, alone)
        )
        np.testing.assert_array_equal(streamed, expected)


def test_an_event_loop_reads_a_run_and_stays_free(engine: Engine) -> None:
    async def read() -> list[Event]:
        run_id = await asyncio.to_thread(engine.submit, SHORT_PLAN, CRACK, pace=10.0)
        await asyncio.to_thread(engine.steer, run_id, is_paused=True)
        subscription = engine.subscribe(run_id)

        async def collect() -> list[Event]:
            return [event async for event in subscription]

        reader = asyncio.create_task(collect())
        for _ in range(20):  # while nothing comes; were the loop held, nobody would go on
            await asyncio.sleep(0.005)
        assert not reader.done()
        await asyncio.to_thread(engine.steer, run_id, is_paused=False, pace=math.inf)
        return await reader

    events = asyncio.run(asyncio.wait_for(read(), PATIENCE_S))
    assert isinstance(events[-1], Finished)


def test_cancel_stops_a_flight_within_a_block(engine: Engine) -> None:
    run_id = engine.submit(LONG_PLAN, CRACK)
    subscription = engine.subscribe(run_id)
    read_until(subscription, Samples)
    engine.cancel(run_id)
    events = read_all(subscription)
    assert isinstance(events[-1], Cancelled)
    assert engine.wait(run_id).status == engine.store.get(run_id).status == "cancelled"
    assert len(samples_of(engine.history(run_id))) < LONG_PLAN.n_steps / 250
    for short in [engine.submit(SHORT_PLAN, Fault()) for _ in range(3)]:
        assert engine.wait(short, timeout=PATIENCE_S).status == "done"


def test_a_run_that_waits_for_a_worker_can_be_cancelled(engine: Engine) -> None:
    flying = [engine.submit(LONG_PLAN, CRACK) for _ in range(2)]
    for run_id in flying:
        read_until(engine.subscribe(run_id), Samples)
    waiting = engine.submit(SHORT_PLAN, CRACK)
    engine.cancel(waiting)
    assert engine.wait(waiting, timeout=PATIENCE_S).status == "cancelled"
    assert Started not in {type(event) for event in engine.history(waiting)}
    for run_id in flying:
        engine.cancel(run_id)
        engine.wait(run_id, timeout=PATIENCE_S)


def test_a_cancelled_run_can_be_flown_again(engine: Engine) -> None:
    run_id = engine.submit(Plan(duration_s=600.0), CRACK)
    read_until(engine.subscribe(run_id), Samples)
    engine.cancel(run_id)
    engine.wait(run_id, timeout=PATIENCE_S)
    engine.retry(run_id)
    events = read_all(engine.subscribe(run_id))
    assert (events[1], events[-1]) == (Started(run_id, 1), Finished(run_id))
    streamed = np.concatenate([part.time_s for part in samples_of(events)])
    np.testing.assert_allclose(streamed, np.arange(3000) * 0.2, atol=1e-4)  # none of the first try
    engine.cancel(run_id)  # too late: nothing happens
    assert engine.store.get(run_id).status == "done"


def test_only_what_ended_badly_is_retried(engine: Engine) -> None:
    run_id = engine.submit(SHORT_PLAN, CRACK)
    with pytest.raises(InputError, match="nothing to retry"):
        engine.retry(run_id)
    engine.wait(run_id, timeout=PATIENCE_S)
    with pytest.raises(InputError, match="is done"):
        engine.retry(run_id)


def test_bad_input_is_refused_before_anything_is_stored(engine: Engine) -> None:
    before = len(engine.store.records())
    with pytest.raises(InputError, match="onset_s"):
        engine.submit(SHORT_PLAN, Fault("baffle_crack", onset_s=50.0))
    assert len(engine.store.records()) == before


def test_a_plan_that_cannot_be_flown_says_why(engine: Engine) -> None:
    plan = Plan(altitude_ft=9000.0, speed_kt=115.0, weather=Weather(isa_deviation_degc=-20.0))
    with pytest.raises(FlightError) as caught:
        PairFlight(plan, CRACK)
    run_id = engine.submit(plan, CRACK)
    final = read_all(engine.subscribe(run_id))[-1]
    assert final == Failed(run_id, str(caught.value), retryable=False)
    assert engine.wait(run_id).error == str(caught.value)


def test_an_unknown_run_is_named(engine: Engine) -> None:
    for ask in (engine.history, engine.subscribe, engine.wait, engine.cancel, engine.retry):
        with pytest.raises(StoreError, match="no run 'nonsense'"):
            ask("nonsense")


def test_wait_gives_up_in_time(engine: Engine) -> None:
    run_id = engine.submit(LONG_PLAN, CRACK)
    with pytest.raises(WorkerError, match=r"not done after 0\.1 s"):
        engine.wait(run_id, timeout=0.1)
    engine.cancel(run_id)
    engine.wait(run_id, timeout=PATIENCE_S)


def test_only_recent_runs_keep_their_events(engine: Engine) -> None:
    plan = Plan(duration_s=30.0)
    runs = [engine.submit(plan, Fault()) for _ in range(RECENT_RUNS + 3)]
    held = engine.subscribe(runs[0])
    for run_id in runs:
        engine.wait(run_id, timeout=PATIENCE_S)
    last = engine.submit(plan, Fault())
    assert len(read_all(engine.subscribe(last))) > 5
    assert engine.history(runs[0]) == [Finished(runs[0])]
    assert len(read_all(held)) > 5  # who was reading keeps what is his


def test_everything_listens_on_loopback_only(engine: Engine) -> None:
    processes = [psutil.Process(), *psutil.Process().children(recursive=True)]
    listening = [
        connection.laddr
        for process in processes
        for connection in process.net_connections("inet")
        if connection.status == psutil.CONN_LISTEN
    ]
    assert len(listening) >= 5  # the scheduler, two nannies and two workers
    assert {address.ip for address in listening} == {"127.0.0.1"}


def test_one_engine_leaves_the_runs_of_another_alone(engine: Engine) -> None:
    run_id = engine.submit(LONG_PLAN, CRACK)
    read_until(engine.subscribe(run_id), Samples)
    other = Engine(RunStore(engine.store.root), n_workers=1)
    try:
        assert engine.store.get(run_id).status == "running"
        (final,) = other.history(run_id)
        assert isinstance(final, Failed)
        assert "another server" in final.message
        with pytest.raises(WorkerError, match="another server"):
            other.cancel(run_id)
    finally:
        other.close()
    assert engine.store.get(run_id).status == "running"
    engine.cancel(run_id)
    engine.wait(run_id, timeout=PATIENCE_S)


def test_a_closed_engine_leaves_no_run_open(tmp_path: Path) -> None:
    others = psutil.Process().children(recursive=True)
    store = RunStore(tmp_path)
    engine = Engine(store, n_workers=1)
    flying, waiting = (engine.submit(LONG_PLAN, CRACK) for _ in range(2))
    read_until(engine.subscribe(flying), Samples)
    own = set(psutil.Process().children(recursive=True)) - set(others)
    reader = engine.subscribe(waiting)
    engine.close()
    for run_id in (flying, waiting):
        assert (store.get(run_id).status, store.get(run_id).error) == ("failed", SERVER_STOPPED)
    assert isinstance(read_all(reader)[-1], Failed)
    with pytest.raises(WorkerError, match="stopping"):
        engine.submit(SHORT_PLAN, CRACK)
    _, alive = psutil.wait_procs(own, timeout=PATIENCE_S)
    assert alive == []

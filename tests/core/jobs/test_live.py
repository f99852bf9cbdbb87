"""Live flights on real workers: paced, acted upon, and rebuilt when their worker is killed."""

import math
import os
import signal
import time
from collections.abc import Callable

import numpy as np
import pytest
from jobs_support import PATIENCE_S, SHORT_PLAN, read_all, read_until, samples_of

from core.errors import InputError, StoreError
from core.files import read_json
from core.fmea.fault import Fault
from core.jobs.engine import Engine
from core.jobs.events import Acted, Cancelled, Event, Finished, Paced, Samples, Started
from core.jobs.feed import Subscription
from core.jobs.live import PERIOD_S, Control, Inbox, Orders, deliver
from core.store.store import RunStore
from core.twin.actions import Action, Repair, SetFault, SetTarget
from core.twin.flight import fly_pair
from core.twin.plan import Plan

pytestmark = pytest.mark.alone

HEALTHY = Fault("nominal")
PLAN = Plan(duration_s=300.0, seed=7)


def flown_s(event: Event) -> float:
    """Where a flight stood when it told that."""
    return float(event.time_s[-1]) if isinstance(event, Samples) else -1.0


def read_to(subscription: Subscription, time_s: float) -> Samples:
    """Read on until the flight has come to that time."""
    while True:
        event = read_until(subscription, Samples)
        assert isinstance(event, Samples)
        if flown_s(event) >= time_s:
            return event


def assert_flown_again(engine: Engine, run_id: str) -> tuple[Action, ...]:
    """Plan, fault and actions give the stored bytes; returns the actions."""
    record = engine.store.get(run_id)
    stored = engine.store.load_pair(run_id)
    again = fly_pair(record.plan, record.fault, record.actions)
    assert stored.faulted.channels.tobytes() == again.faulted.channels.tobytes()
    assert stored.mirror.channels.tobytes() == again.mirror.channels.tobytes()
    assert stored.faulted.states.tobytes() == again.faulted.states.tobytes()
    return record.actions


def streamed(time_s: float) -> Samples:
    """Samples that end there."""
    last = np.array([time_s], dtype=np.float32)
    nothing = np.empty((1, 0), dtype=np.float32)
    return Samples("run", 0, last, nothing, nothing, nothing, nothing)


def test_what_a_dead_worker_had_not_begun_happens_where_the_flight_was() -> None:
    control = Control(PLAN, 10.0)
    control.begun("tcp://one", "first")
    control.heard(streamed(20.0))
    control.actions = control.with_action(SetFault(0.0, "baffle_crack"))
    assert control.actions[0].time_s == pytest.approx(20.2)
    flown = SetFault(24.0, "baffle_crack")  # the worker had come further when it heard
    assert control.taken(Acted("run", (flown,)))
    assert not control.taken(Acted("run", (flown,)))
    control.actions = control.with_action(Repair(0.0))
    control.heard(streamed(60.0))
    control.begun("tcp://two", "second")
    orders = control.orders()
    assert [action.time_s for action in orders.actions] == [24.0, pytest.approx(60.2)]
    assert orders.resume_s == pytest.approx(60.2)
    control.heard(streamed(5.0))  # it is flown there again
    assert control.flown_s == pytest.approx(60.2)


def test_orders_that_were_overtaken_are_left_out() -> None:
    with Inbox("start") as inbox:
        newest = Orders(2, 1.0, True, (), 0.0)
        deliver("start", newest)
        deliver("start", Orders(1, 60.0, False, (), 0.0))
        deliver("of another flight", Orders(3, 60.0, False, (), 0.0))
        assert inbox.orders is newest
    deliver("start", Orders(4, 60.0, False, (), 0.0))
    assert inbox.orders is newest


def test_a_live_flight_is_its_plan_and_its_actions(engine: Engine) -> None:
    run_id = engine.submit(PLAN, HEALTHY, pace=60.0)
    subscription = engine.subscribe(run_id)
    read_to(subscription, 30.0)
    for action in (SetFault(0.0, "baffle_crack", 0.7), SetTarget(0.0, altitude_ft=5200.0)):
        engine.act(run_id, action)
    read_to(subscription, 120.0)
    engine.act(run_id, SetFault(0.0, "baffle_crack", 0.9))
    engine.act(run_id, Repair(200.0))
    engine.steer(run_id, pace=math.inf)
    events = read_all(subscription)
    assert events[-1] == Finished(run_id)
    actions = assert_flown_again(engine, run_id)
    assert [type(action) for action in actions] == [SetFault, SetTarget, SetFault, Repair]
    assert 30.0 <= actions[0].time_s < 120.0 <= actions[2].time_s < actions[3].time_s == 200.0
    written = read_json(engine.store.recording_path(run_id).with_name("run.json"))
    assert len(written["record"]["actions"]) == 4
    residual = engine.store.load_pair(run_id).residual
    onset = round(actions[0].time_s * 50)
    assert not residual[:onset].any()
    assert residual[onset:].any()

    again = engine.submit(PLAN, HEALTHY, actions)
    assert engine.wait(again, timeout=PATIENCE_S).status == "done"
    assert engine.store.load_pair(again).residual.tobytes() == residual.tobytes()
    assert engine.store.get(again).actions == actions


def test_it_keeps_its_pace_and_stands_still_in_a_pause(engine: Engine) -> None:
    asked = time.monotonic()
    run_id = engine.submit(PLAN, HEALTHY, pace=10.0)
    subscription = engine.subscribe(run_id)
    read_until(subscription, Samples)
    came_to_s = flown_s(read_to(subscription, 8.0))
    assert time.monotonic() - asked > came_to_s / 10.0 - PERIOD_S  # never ahead of its pace
    engine.steer(run_id, is_paused=True)
    assert read_until(subscription, Paced) == Paced(run_id, 10.0, True)
    while subscription.get(timeout=0.5) is not None:
        pass
    engine.act(run_id, SetFault(0.0, "engine_failure", 0.6))
    acted = read_until(subscription, Acted)
    assert isinstance(acted, Acted)
    paused_at_s = acted.actions[0].time_s
    assert subscription.get(timeout=0.3) in (None, acted)
    engine.steer(run_id, is_paused=False, pace=60.0)
    assert flown_s(read_to(subscription, paused_at_s)) < paused_at_s + 60.0 * PERIOD_S + 1.0
    assert engine.history(run_id).count(acted) >= 1
    engine.cancel(run_id)
    assert read_all(subscription)[-1] == Cancelled(run_id)
    record = engine.store.get(run_id)
    assert (record.status, record.actions) == ("cancelled", acted.actions)
    engine.retry(run_id)
    assert engine.wait(run_id, timeout=PATIENCE_S).status == "done"
    assert assert_flown_again(engine, run_id) == acted.actions


def test_live_flights_leave_room_for_others(engine: Engine) -> None:
    """Ten that wait, on two workers of one thread each, and a run passes between them."""
    waiting = [engine.submit(PLAN, HEALTHY, pace=1.0) for _ in range(10)]
    subscriptions = [engine.subscribe(run_id) for run_id in waiting]
    for subscription in subscriptions:
        read_until(subscription, Samples)
    run_id = engine.submit(SHORT_PLAN, HEALTHY)
    assert engine.wait(run_id, timeout=PATIENCE_S).status == "done"
    for live in waiting:
        engine.cancel(live)
    for subscription in subscriptions:
        assert isinstance(read_all(subscription)[-1], Cancelled)


def test_what_cannot_be_done_is_refused_and_stored_nowhere(engine: Engine) -> None:
    with pytest.raises(InputError, match="pace"):
        engine.submit(PLAN, HEALTHY, pace=7.0)
    run_id = engine.submit(PLAN, HEALTHY, pace=60.0)
    with pytest.raises(InputError, match="time_s"):
        engine.act(run_id, Repair(300.0))
    with pytest.raises(InputError, match="pace"):
        engine.steer(run_id, pace=-1.0)
    engine.cancel(run_id)
    engine.wait(run_id, timeout=PATIENCE_S)
    for late in (lambda: engine.act(run_id, Repair(1.0)), lambda: engine.steer(run_id, pace=1.0)):
        with pytest.raises(InputError, match="not a live flight in the air"):
            late()
    assert engine.store.get(run_id).actions == ()
    plain = engine.submit(SHORT_PLAN, HEALTHY)
    with pytest.raises(InputError, match="not a live flight"):
        engine.act(plain, Repair(1.0))


def test_an_action_that_cannot_be_stored_is_not_flown(
    engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_id = engine.submit(PLAN, HEALTHY, pace=60.0)

    def full(*_: object) -> None:
        raise StoreError("no space left")

    with monkeypatch.context() as patched:
        patched.setattr(RunStore, "save_actions", full)
        with pytest.raises(StoreError):
            engine.act(run_id, SetFault(0.0, "engine_failure", 0.9))
    engine.steer(run_id, pace=math.inf)
    assert engine.wait(run_id, timeout=PATIENCE_S).status == "done"
    assert not engine.store.load_pair(run_id).residual.any()


def kill_worker_of(engine: Engine, run_id: str) -> None:
    control = engine._runs[run_id].control
    assert control is not None
    client = engine._cluster.client()
    (pid,) = client.run(os.getpid, workers=[control.address]).values()
    os.kill(pid, signal.SIGKILL)


@pytest.mark.slow
def test_a_killed_workers_flight_is_back_with_nothing_lost(
    tmp_path_factory: pytest.TempPathFactory, record_property: Callable[[str, object], None]
) -> None:
    engine = Engine(RunStore(tmp_path_factory.mktemp("live")), n_workers=2)
    engine.wait_warm(timeout=PATIENCE_S)
    try:
        run_id = engine.submit(PLAN, HEALTHY, pace=60.0)
        subscription = engine.subscribe(run_id)
        seen = [read_to(subscription, 20.0)]
        engine.act(run_id, SetFault(0.0, "engine_run_rough", 0.8))
        engine.act(run_id, SetTarget(0.0, altitude_ft=5200.0))
        seen.append(read_to(subscription, 240.0))
        engine.steer(run_id, is_paused=True)
        while (event := subscription.get(timeout=0.5)) is not None:
            seen += [event] if isinstance(event, Samples) else []
        before_s, acted = flown_s(seen[-1]), engine.store.get(run_id).actions
        assert len(acted) == 2
        kill_worker_of(engine, run_id)
        killed_s = time.monotonic()
        engine.act(run_id, SetFault(0.0, "engine_run_rough", 0.3))  # while nobody flies
        assert read_until(subscription, Started) == Started(run_id, 2)
        back = read_to(subscription, before_s)
        took_s = time.monotonic() - killed_s
        record_property("rebuilt_s", round(took_s, 2))
        print(f"back at {flown_s(back):.1f} s of the flight after {took_s:.2f} s")
        assert flown_s(back) == before_s  # and still paused there
        assert subscription.get(timeout=0.3) is None or not isinstance(
            engine.history(run_id)[-1], Finished
        )
        engine.steer(run_id, is_paused=False, pace=math.inf)
        events = read_all(subscription)
        assert events[-1] == Finished(run_id)
        flown = engine.store.get(run_id).actions
        assert flown[:2] == acted
        assert flown[2].time_s >= before_s
        assert_flown_again(engine, run_id)
        stored = engine.store.load_pair(run_id).faulted
        for part in seen:
            rows = np.searchsorted(stored.time_s, np.asarray(part.time_s, dtype=np.float64) - 1e-3)
            np.testing.assert_array_equal(stored.channels[rows], part.faulted)
        assert samples_of(engine.history(run_id))[0].index == 0
    finally:
        engine.close()

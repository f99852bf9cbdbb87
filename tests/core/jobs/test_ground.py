"""A run that the ground ends before its plan does is a run like any other, only shorter."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from jobs_support import read_all, samples_of

from core.dataset.generate import PlannedRun
from core.dataset.generate import fly_run as fly_for_the_data_set
from core.fmea.fault import Fault
from core.jobs.engine import Engine
from core.jobs.events import Finished, Probabilities, Progress
from core.jobs.worker import fly_run
from core.twin.actions import Repair, SetFault, SetTarget
from core.twin.flight import fly_pair
from core.twin.plan import Conditions, Plan
from core.twin.trajectory import Pair

HEALTHY = Fault("nominal")
FAILED = SetFault(10.0, "engine_failure", 1.0)
TURNED = SetTarget(20.0, heading_deg=40.0)
TOO_LATE = Repair(400.0)
PLAN = Plan(altitude_ft=2000.0, speed_kt=90.0, heading_deg=30.0, duration_s=600.0, seed=3)


@pytest.fixture(scope="module")
def flown() -> Iterator[Pair]:
    """What a run of that plan comes to."""
    pair = fly_pair(PLAN, HEALTHY, [FAILED, TURNED])
    assert pair.ground_s is not None
    yield pair


def assert_is(pair: Pair, flown: Pair) -> None:
    """The same flight, bit for bit."""
    for one, other in ((pair.faulted, flown.faulted), (pair.mirror, flown.mirror)):
        assert one.time_s.tobytes() == other.time_s.tobytes()
        assert one.states.tobytes() == other.states.tobytes()
        assert one.channels.tobytes() == other.channels.tobytes()


def test_a_run_in_blocks_ends_on_the_ground_and_is_diagnosed(flown: Pair) -> None:
    events: list[object] = []
    result = fly_run("run", PLAN, HEALTHY, events.append, [FAILED, TURNED, TOO_LATE])
    assert_is(result.pair, flown)
    assert result.actions == (FAILED, TURNED)
    ground_s = flown.ground_s
    assert ground_s is not None
    assert result.diagnosis.time_s[-1] <= ground_s
    assert all(item.end_s <= ground_s for item in result.diagnosis.evidence)
    told = [event for event in events if isinstance(event, Probabilities)]
    assert [event.time_s for event in told] == list(result.diagnosis.time_s)
    shares = [event.fraction for event in events if isinstance(event, Progress)]
    assert shares == sorted(shares)


def test_a_stored_run_is_done_and_as_long_as_it_was_flown(engine: Engine, flown: Pair) -> None:
    run_id = engine.submit(PLAN, HEALTHY, [FAILED, TURNED, TOO_LATE])
    record = engine.wait(run_id, timeout=240)
    assert record.status == "done", record.error
    assert record.actions == engine.store.get(run_id).actions == (FAILED, TURNED)
    stored = engine.store.load_pair(run_id)
    assert_is(stored, flown)
    assert stored.ground_s == flown.ground_s
    time_s, faulted, mirror = engine.store.load_channels(run_id, 0.0, math.inf)
    assert len(time_s) == len(faulted) == len(mirror) == len(flown.mirror)


def test_a_live_flight_ends_on_the_ground_by_itself(engine: Engine, flown: Pair) -> None:
    run_id = engine.submit(PLAN, HEALTHY, [FAILED, TURNED, TOO_LATE], pace=math.inf)
    events = read_all(engine.subscribe(run_id), timeout=240.0)
    assert events[-1] == Finished(run_id)
    assert_is(engine.store.load_pair(run_id), flown)
    assert engine.store.get(run_id).actions == (FAILED, TURNED)
    streamed = np.concatenate([part.time_s for part in samples_of(events)])
    np.testing.assert_array_equal(streamed, flown.mirror.time_s[::10].astype(np.float32))


@pytest.mark.parametrize("conditions", ["lab", "field"])
def test_the_data_set_keeps_what_was_flown(conditions: Conditions) -> None:
    plan = Plan(2000.0, 90.0, duration_s=250.0, seed=3, conditions=conditions)
    run = PlannedRun("failed", "train", plan, Fault("engine_failure", 1.0, 60.0))
    kept = fly_for_the_data_set(run)
    pair = fly_pair(plan, run.fault)
    assert pair.ground_s is not None
    assert kept.departure_row is not None
    end = kept.start_row + kept.channels.shape[1]
    assert end <= len(pair.faulted)
    np.testing.assert_array_equal(kept.channels[0], pair.faulted.channels[kept.start_row : end])

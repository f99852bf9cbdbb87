"""The ground ends a flight: both aircraft at one sample, and whatever blocks it is flown in."""

import numpy as np
import pytest

from core.errors import InputError
from core.fmea.fault import Fault
from core.twin.actions import Action, Repair, SetFault, SetTarget, done_by
from core.twin.events import flight_events
from core.twin.flight import PairFlight, fly, fly_pair
from core.twin.plan import Conditions, Plan
from core.twin.trajectory import GROUND_FT, Pair

HEALTHY = Fault("nominal")
FAILED = Fault("engine_failure", 1.0, 10.0)
PLAN = Plan(altitude_ft=2000.0, duration_s=7200.0, seed=3)


def bytes_of(pair: Pair) -> tuple[bytes, ...]:
    """Everything that two equal flights have in common."""
    return tuple(
        values.tobytes()
        for flight in (pair.faulted, pair.mirror)
        for values in (flight.time_s, flight.states, flight.channels)
    )


@pytest.fixture(scope="module")
def fallen() -> Pair:
    """Two hours as planned, three minutes as flown."""
    return fly_pair(PLAN, FAILED)


def test_a_flight_ends_where_the_first_of_the_two_meets_the_ground(fallen: Pair) -> None:
    altitude_ft = fallen.faulted.state("altitude_ft")
    assert altitude_ft[-1] <= GROUND_FT < altitude_ft[:-1].min()
    assert len(fallen.faulted) == len(fallen.mirror)
    assert fallen.ground_s == fallen.faulted.time_s[-1] == pytest.approx(193.7, abs=0.5)
    assert fallen.mirror.ground_s is None
    assert fallen.residual.shape == fallen.faulted.channels.shape
    for flight in (fallen.faulted, fallen.mirror):
        assert np.isfinite(flight.states).all()
        assert np.isfinite(flight.channels).all()


@pytest.mark.parametrize("conditions", ["lab", "field"])
def test_blocks_of_any_size_end_on_the_ground_with_the_same_bytes(conditions: Conditions) -> None:
    plan = Plan(2000.0, 90.0, duration_s=900.0, seed=8, conditions=conditions)
    whole = fly_pair(plan, FAILED)
    assert whole.ground_s is not None
    flight, blocks = PairFlight(plan, FAILED, live=True), []
    for block_s in (0.1, 30.0, 120.0, *(0.7,) * 200):
        if (block := flight.advance(block_s)) is not None:
            blocks.append(block)
    assert flight.advance(1.0) is None
    assert flight.progress == 1.0
    assert flight.ground_s == whole.ground_s
    assert bytes_of(Pair.joined(blocks)) == bytes_of(whole)


def test_one_aircraft_alone_ends_there_too(fallen: Pair) -> None:
    alone = fly(PLAN, FAILED)
    assert alone.channels.tobytes() == fallen.faulted.channels.tobytes()


def test_nothing_can_be_done_on_the_ground() -> None:
    flight = PairFlight(PLAN, FAILED, live=True)
    while flight.advance(60.0) is not None:
        pass
    assert flight.flown_s <= 194.0
    with pytest.raises(InputError, match="met the ground at 193"):
        flight.act(Repair(300.0))


def test_what_was_to_come_after_the_ground_was_never_done(fallen: Pair) -> None:
    soon, late = SetTarget(20.0, heading_deg=90.0), Repair(300.0)
    actions: list[Action] = [SetFault(10.0, "engine_failure", 1.0), soon, late]
    pair = fly_pair(PLAN, HEALTHY, actions)
    assert pair.ground_s is not None
    done = done_by(actions, float(pair.faulted.time_s[-1]))
    assert done == tuple(actions[:2])
    assert bytes_of(fly_pair(PLAN, HEALTHY, done)) == bytes_of(pair)


def test_the_ground_is_an_event_without_length(fallen: Pair) -> None:
    (ground,) = (event for event in flight_events(fallen.faulted) if event.kind == "ground")
    assert ground.start_s == ground.end_s == fallen.ground_s
    assert (ground.value, ground.limit, ground.unit) == (GROUND_FT, GROUND_FT, "ft")
    assert not any(event.kind == "ground" for event in flight_events(fallen.mirror))


def test_a_flight_above_the_ground_keeps_the_length_of_its_plan() -> None:
    pair = fly_pair(Plan(altitude_ft=2000.0, duration_s=40.0), FAILED)
    assert pair.ground_s is None
    assert len(pair.faulted) == 2000

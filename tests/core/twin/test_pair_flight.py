"""How a pair is flown: blocks, actions, the ground; with an aircraft that flies straight on."""

import numpy as np
import pytest
from fake_aircraft import FakeAircraft, Sinking
from hypothesis import given, settings
from hypothesis import strategies as st

from core.errors import InputError
from core.fmea.catalogue import catalogue, class_ids
from core.fmea.fault import Fault
from core.twin.actions import Repair, SetFault, SetTarget
from core.twin.aircraft import Aircraft
from core.twin.conditions import Setting
from core.twin.flight import PairFlight
from core.twin.plan import Plan
from core.twin.trajectory import Pair

PLAN = Plan(duration_s=40.0, seed=11)
HEALTHY = Fault("nominal")
ROUGH = Fault("engine_run_rough", 0.8, 10.0)
SPARED = next(mode.id for mode in catalogue().values() if mode.drives and not mode.moves_engine)


class Hangar:
    """Gives out aircraft and remembers them: the mirror's comes first."""

    def __init__(self, kind: type[FakeAircraft] = FakeAircraft) -> None:
        self.kind = kind
        self.given: list[FakeAircraft] = []

    def __call__(self, plan: Plan, setting: Setting) -> Aircraft:
        self.given.append(self.kind(plan, setting))
        return self.given[-1]


def all_of(flight: PairFlight, block_s: float = 7.3) -> Pair:
    """The rest of the flight."""
    blocks = []
    while (block := flight.advance(block_s)) is not None:
        blocks.append(block)
    return Pair.joined(blocks)


def bytes_of(pair: Pair) -> tuple[bytes, ...]:
    """Everything that two equal pairs have in common."""
    return tuple(
        values.tobytes()
        for flight in (pair.faulted, pair.mirror)
        for values in (flight.time_s, flight.states, flight.channels)
    )


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(0.1, 20.0), max_size=6), st.sampled_from(class_ids()))
def test_blocks_of_any_size_are_the_same_flight(blocks_s: list[float], mode: str) -> None:
    fault = Fault(mode, 0.7, 10.0)
    flight = PairFlight(PLAN, fault, new_aircraft=FakeAircraft)
    cut = [block for seconds in blocks_s if (block := flight.advance(seconds)) is not None]
    while (rest := flight.advance(60.0)) is not None:
        cut.append(rest)
    assert flight.progress == 1.0
    whole = all_of(PairFlight(PLAN, fault, new_aircraft=FakeAircraft), 60.0)
    assert bytes_of(Pair.joined(cut)) == bytes_of(whole)


def test_a_fault_that_spares_the_engine_needs_one_aircraft_and_any_other_two() -> None:
    for fault, needed in ((Fault(SPARED, 0.8, 10.0), 1), (ROUGH, 2)):
        hangar = Hangar()
        residual = all_of(PairFlight(PLAN, fault, new_aircraft=hangar)).residual
        assert len(hangar.given) == needed
        assert not residual[:500].any()
        assert residual[500:].any()


def test_a_live_flight_has_an_aircraft_for_each_whatever_comes() -> None:
    hangar = Hangar()
    PairFlight(PLAN, HEALTHY, live=True, new_aircraft=hangar)
    assert len(hangar.given) == 2


def test_targets_are_set_for_both_and_only_the_faulted_engine_is_repaired() -> None:
    hangar = Hangar()
    actions = [SetTarget(12.0, speed_kt=90.0), SetFault(20.0, "engine_run_rough"), Repair(30.0)]
    all_of(PairFlight(PLAN, ROUGH, actions, new_aircraft=hangar))
    mirror, faulted = hangar.given
    assert mirror.asked == [("targets", 120)]
    assert faulted.asked == [("targets", 120), ("guard", 200), ("recover", 300)]


def test_an_action_happens_at_its_time_or_now() -> None:
    hangar = Hangar()
    flight = PairFlight(PLAN, HEALTHY, live=True, new_aircraft=hangar)
    flight.advance(5.0)
    late = flight.act(SetTarget(1.0, speed_kt=90.0))
    planned = flight.act(SetTarget(20.04, speed_kt=95.0))
    assert (late.time_s, planned.time_s) == (5.0, 20.1)  # the next tick
    all_of(flight)
    assert [tick for _, tick in hangar.given[0].asked] == [50, 201]


def test_what_is_not_live_or_over_takes_no_action() -> None:
    with pytest.raises(ValueError, match="not live"):
        PairFlight(PLAN, HEALTHY, new_aircraft=FakeAircraft).act(Repair(1.0))
    flight = PairFlight(PLAN, HEALTHY, live=True, new_aircraft=FakeAircraft)
    all_of(flight)
    with pytest.raises(InputError, match="before the end"):
        flight.act(Repair(5.0))


def test_the_ground_ends_both_at_one_sample_in_any_blocks() -> None:
    plan = Plan(altitude_ft=2000.0, duration_s=40.0)
    flight = PairFlight(plan, ROUGH, live=True, new_aircraft=Sinking)
    pair = all_of(flight, 0.7)
    assert (pair.ground_s, flight.ground_s, flight.progress) == (20.0, 20.0, 1.0)
    assert len(pair.faulted) == len(pair.mirror) == 1001
    assert np.isfinite(pair.faulted.channels).all()
    with pytest.raises(InputError, match=r"met the ground at 20\.0"):
        flight.act(Repair(30.0))

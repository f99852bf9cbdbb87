"""A live flight in one process: its orders, its pauses, and what is flown again without delay."""

import math
from collections.abc import Iterator

import pytest
from fake_aircraft import FakeAircraft

from core.fmea.fault import Fault
from core.jobs.live import REPLAY_S, Inbox, LiveFlight, Orders
from core.twin.actions import Action, Repair, SetFault
from core.twin.flight import PairFlight
from core.twin.plan import Plan
from core.twin.trajectory import Pair

PLAN = Plan(duration_s=300.0, seed=7)
ROUGH = SetFault(20.0, "engine_run_rough", 0.8)


class NobodyWaitsError(Exception):
    """Raised where the flight asks whether it is still wanted."""


def not_wanted() -> None:
    raise NobodyWaitsError


class Flown:
    """A live flight, its inbox and the actions it reported."""

    def __init__(self, inbox: Inbox) -> None:
        self.inbox = inbox
        self.reported: list[tuple[Action, ...]] = []
        flight = PairFlight(PLAN, Fault("nominal"), live=True, new_aircraft=FakeAircraft)
        self.flight = LiveFlight(flight, inbox, self.reported.append, not_wanted)
        self.blocks = self.flight.blocks()
        self._number = 0

    def order(
        self, pace: float, actions: tuple[Action, ...] = (), *, paused: bool = False,
        resume_s: float = 0.0,
    ) -> None:  # fmt: skip
        """Send newer orders."""
        self._number += 1
        self.inbox.put(Orders(self._number, pace, paused, actions, resume_s))

    def next_s(self) -> float:
        """The length of the next block."""
        block, _ = next(self.blocks)
        return len(block.faulted) * 0.02


@pytest.fixture
def live() -> Iterator[Flown]:
    """A flight that has no orders yet."""
    with Inbox("start") as inbox:
        yield Flown(inbox)


def test_without_orders_it_waits_and_asks_whether_it_is_wanted(live: Flown) -> None:
    with pytest.raises(NobodyWaitsError):
        live.next_s()


def test_a_pause_flies_nothing_but_takes_actions(live: Flown) -> None:
    live.order(math.inf, (ROUGH,), paused=True)
    with pytest.raises(NobodyWaitsError):
        live.next_s()
    assert live.reported == [(ROUGH,)]


def test_actions_are_reported_with_their_times_and_once(live: Flown) -> None:
    live.order(math.inf)
    live.next_s()
    live.order(math.inf, (Repair(0.0),))
    live.next_s()
    live.next_s()
    ((repair,),) = live.reported
    assert repair.time_s == 5.0
    assert live.flight.actions == (repair,)


def test_what_was_seen_before_is_flown_in_long_blocks_even_in_a_pause(live: Flown) -> None:
    live.order(1.0, paused=True, resume_s=1.5 * REPLAY_S)
    assert [live.next_s(), live.next_s()] == [REPLAY_S, 0.5 * REPLAY_S]
    with pytest.raises(NobodyWaitsError):
        live.next_s()


def test_a_pace_gives_steps_of_that_many_samples(live: Flown) -> None:
    live.order(60.0)
    assert live.next_s() == pytest.approx(12.0)


def test_the_flight_is_that_of_its_actions(live: Flown) -> None:
    live.order(math.inf, (ROUGH, Repair(90.0)))
    flown = Pair.joined([block for block, _ in live.blocks])
    plain = PairFlight(PLAN, Fault("nominal"), live.flight.actions, new_aircraft=FakeAircraft)
    again = plain.advance(PLAN.duration_s)
    assert again is not None
    assert flown.residual.any()
    assert flown.faulted.channels.tobytes() == again.faulted.channels.tobytes()

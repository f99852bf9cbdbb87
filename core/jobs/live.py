"""Live flights: flown at a pace, with actions on the way.

The server keeps all that was ordered (`Control`) and sends the whole of it to the worker whenever
it changes, past Dask's scheduler to an `Inbox` in the worker's process. An action is in the store
before it is sent, and a worker begins with nothing and asks: so one that takes over from a dead one
does again, at once, all that was done, and goes on from where the flight was.
"""

import math
import threading
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

from core.clock import DT_S
from core.errors import InputError
from core.jobs.events import SAMPLE_STRIDE, Acted, Samples
from core.twin.actions import Action, in_order
from core.twin.plan import Plan
from core.twin.trajectory import Pair

if TYPE_CHECKING:  # it loads JSBSim, for which the server has no use
    from core.twin.flight import PairFlight

PACES: tuple[float, ...] = (1.0, 10.0, 60.0, math.inf)
"""Simulated seconds per wall-clock second; infinite is as fast as possible."""

PERIOD_S = 0.2
"""Time between two steps of a paced flight, if a step is at least one streamed sample."""

STAY_S = 0.5
"""How often a waiting flight looks whether it is still wanted."""

HURRY_S = 5.0
"""Flight time of a block where nothing is to be waited for."""

REPLAY_S = 60.0
"""Flight time of a block that has been seen before: the longer, the sooner it is back."""

LATE_S = 1.0
"""A flight that is later than this lets the time go, instead of hurrying to make up for it."""

_SAMPLE_S = SAMPLE_STRIDE * DT_S


def checked_pace(pace: float) -> float:
    """One of `PACES`; raises `InputError` for any other."""
    if pace not in PACES:
        raise InputError("pace", f"must be 1, 10, 60 or inf, got {pace!r:.20}")
    return pace


@dataclass(frozen=True, slots=True)
class Orders:
    """All that a live flight is to do, in the order of asking; a higher ``number`` is newer.

    Up to ``resume_s`` it has been seen before: it is flown there without delay.
    """

    number: int
    pace: float
    is_paused: bool
    actions: tuple[Action, ...]
    resume_s: float


# -- the server's side ---------------------------------------------------------------------------


@dataclass(slots=True)
class Control:
    """What was ordered of one live flight, and how far it has come. Not thread-safe."""

    plan: Plan
    pace: float
    actions: tuple[Action, ...] = ()
    is_paused: bool = False
    flown_s: float = 0.0
    address: str = ""
    """The worker that flies it; empty before there is one."""
    start: str = ""
    _number: int = 0
    _taken: int = 0
    _resume_s: float = 0.0

    def assign(self, address: str, start: str) -> None:
        """Note the worker that flies it from now on, perhaps in the place of a dead one.

        What the dead one was asked to do and had not begun happens now, not before what was seen.
        """
        self.address, self.start = address, start
        self._resume_s = self.flown_s
        seen, unseen = self.actions[: self._taken], self.actions[self._taken :]
        self.actions = seen + tuple(self._not_before_now(action) for action in unseen)
        self._taken = 0

    def note_samples(self, samples: Samples) -> None:
        """Note how far the flight has come; less, while it is flown there again."""
        self.flown_s = max(self.flown_s, round(float(samples.time_s[-1]) + _SAMPLE_S, 1))

    def note_actions(self, acted: Acted) -> bool:
        """Note at what times the worker applies which actions; whether anything changed."""
        known, self._taken = self.actions, len(acted.actions)
        self.actions = acted.actions + known[self._taken :]
        return self.actions != known

    def with_action(self, action: Action) -> tuple[Action, ...]:
        """All actions and this one; raises `InputError` if the flight is over by then."""
        actions = (*self.actions, self._not_before_now(action))
        in_order(actions, self.plan)
        return actions

    def orders(self) -> Orders:
        """Everything, to be sent."""
        self._number += 1
        return Orders(self._number, self.pace, self.is_paused, self.actions, self._resume_s)

    def _not_before_now(self, action: Action) -> Action:
        return replace(action, time_s=max(action.time_s, self.flown_s))


# -- the worker's side ---------------------------------------------------------------------------


class Inbox:
    """Where the orders for one live flight arrive, in the process that flies it."""

    def __init__(self, start: str) -> None:
        """For the flight started under that name; to be used as a context."""
        self._start = start
        self._came = threading.Condition()
        self._orders: Orders | None = None

    def __enter__(self) -> Self:
        """Let orders arrive."""
        _inboxes[self._start] = self
        return self

    def __exit__(self, *error: object) -> None:
        """Let no more arrive."""
        del _inboxes[self._start]

    @property
    def orders(self) -> Orders | None:
        """The newest orders."""
        return self._orders

    def put(self, orders: Orders) -> None:
        """Take orders, unless newer ones have overtaken them."""
        with self._came:
            if self._orders is None or orders.number > self._orders.number:
                self._orders = orders
                self._came.notify()

    def wait(self, seconds: float, known: Orders | None) -> None:
        """Wait for other orders than those known, but no longer than that."""
        with self._came:
            self._came.wait_for(lambda: self._orders is not known, seconds)


_inboxes: dict[str, Inbox] = {}

_turn = threading.Lock()
"""Held by the one flight of this process that takes a step, a few milliseconds.

Without it, tens of flights wait for Python's interpreter lock after every call that lets go of it,
and each takes 5 ms to be handed on: steps took twice their time, and the messages of all waited.
"""


def deliver(start: str, orders: Orders) -> None:
    """Hand orders to a flight of this process; they are for nobody if it has ended."""
    if inbox := _inboxes.get(start):
        inbox.put(orders)


class LiveFlight:
    """One live flight, in the process that flies it."""

    def __init__(
        self,
        flight: "PairFlight",
        inbox: Inbox,
        report_actions: Callable[[tuple[Action, ...]], None],
        check_wanted: Callable[[], None],
    ) -> None:
        """Fly ``flight``, which is live, by the orders that arrive in ``inbox``.

        ``report_actions`` is called with all actions and their times when there are new ones;
        ``check_wanted`` is called while the flight waits, and raises to end it.
        """
        self.actions: tuple[Action, ...] = ()
        self._flight = flight
        self._inbox = inbox
        self._report_actions, self._check_wanted = report_actions, check_wanted
        self._due_s: float | None = None

    def blocks(self) -> Generator[tuple[Pair, float]]:
        """The flight and the share of it flown, block by block, each when its time has come."""
        while self._flight.progress < 1.0:
            orders = self._inbox.orders
            wait_s = STAY_S if orders is None else self._wait_s(orders)
            if orders is not None:
                self._apply_actions(orders)
            if orders is None or wait_s > 0.0:
                self._inbox.wait(min(wait_s, STAY_S), orders)
                self._check_wanted()
                continue
            with _turn:  # until the next block is asked for: what comes of this one is in it
                block = self._flight.advance(self._step_s(orders))
                assert block is not None  # there was something left to fly
                yield block, self._flight.progress

    def _apply_actions(self, orders: Orders) -> None:
        """Apply the actions ordered since the last time; times that have passed become now."""
        new = orders.actions[len(self.actions) :]
        if new:
            self.actions += tuple(map(self._flight.act, new))
            self._report_actions(self.actions)

    def _wait_s(self, orders: Orders) -> float:
        """How long the next block is not to be flown yet."""
        if orders.is_paused and not self._is_resuming(orders):
            self._due_s = None
            return STAY_S
        if self._due_s is None or self._must_hurry(orders):
            self._due_s = time.monotonic()
        return self._due_s - time.monotonic()

    def _step_s(self, orders: Orders) -> float:
        """The length of the next block, in whole samples, and when the one after it is due."""
        if self._must_hurry(orders):
            left_s = orders.resume_s - self._flight.flown_s
            return min(REPLAY_S, left_s) if self._is_resuming(orders) else HURRY_S
        step_s = max(round(orders.pace * PERIOD_S / _SAMPLE_S), 1) * _SAMPLE_S
        now_s = time.monotonic()
        self._due_s = max(self._due_s or now_s, now_s - LATE_S) + step_s / orders.pace
        return step_s

    def _is_resuming(self, orders: Orders) -> bool:
        return self._flight.flown_s < orders.resume_s

    def _must_hurry(self, orders: Orders) -> bool:
        return math.isinf(orders.pace) or self._is_resuming(orders)

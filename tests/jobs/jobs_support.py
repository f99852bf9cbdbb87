"""What the job tests share: one short run, and ways to read its events."""

import time

from core.fmea.fault import Fault
from core.jobs.events import Event, Samples
from core.jobs.feed import Subscription
from core.twin.plan import Plan

SHORT_PLAN = Plan(duration_s=40.0, seed=5)
CRACK = Fault("baffle_crack", severity=0.8, onset_s=10.0)

PATIENCE_S = 240.0
"""How long to wait for what must come: nothing on a quiet machine, ages on a busy one."""


def read_all(subscription: Subscription, timeout: float = PATIENCE_S) -> list[Event]:
    """All events up to the final one."""
    events: list[Event] = []
    deadline = time.monotonic() + timeout
    while not subscription.over:
        event = subscription.get(deadline - time.monotonic())
        assert event is not None or subscription.over, f"no end after {timeout} s: {events[-3:]}"
        if event is not None:
            events.append(event)
    return events


def read_until(subscription: Subscription, kind: type[Event], timeout: float = PATIENCE_S) -> Event:
    """Read on to the next event of that kind."""
    deadline = time.monotonic() + timeout
    while True:
        event = subscription.get(deadline - time.monotonic())
        assert event is not None, f"no {kind.__name__} within {timeout} s"
        if isinstance(event, kind):
            return event


def samples_of(events: list[Event]) -> list[Samples]:
    """The samples among ``events``."""
    return [event for event in events if isinstance(event, Samples)]

"""What the job tests share: one short run, and ways to read its events."""

import time

import numpy as np

from core.diagnosis.diagnosis import Diagnosis, Evidence
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.jobs.events import Event, Samples
from core.jobs.feed import Subscription
from core.report.case.case import open_case
from core.report.grounded import GroundedReport, grounded_template
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


def a_diagnosis() -> Diagnosis:
    """Two windows that lean towards the second class."""
    classes = tuple(catalogue())
    over_time = np.full((2, len(classes)), 0.01, np.float32)
    over_time[:, 1] = [0.7, 0.81]
    evidence = Evidence("E1 CHT1", 60.0, 90.0, 12.5, "degF", "+", 500.0, 61.0)
    return Diagnosis(
        classes, np.array([30.0, 35.0]), over_time, over_time[1], (evidence,), 61.0, "cnn", "lab"
    )


def a_report() -> GroundedReport:
    """The report on it."""
    return grounded_template(open_case(a_diagnosis()))

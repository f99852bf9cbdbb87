"""Excursions are reported, not hidden."""

import numpy as np

from core.fmea.fault import Fault
from core.twin.events import flight_events
from core.twin.flight import fly
from core.twin.plan import Plan
from core.twin.trajectory import STATE_INDEX, Trajectory


def test_a_quiet_flight_has_no_events() -> None:
    assert flight_events(fly(Plan(duration_s=60.0))) == ()


def test_overspeed_crosses_the_redline() -> None:
    plan = Plan(speed_kt=110.0, altitude_ft=5500.0, duration_s=120.0)
    events = flight_events(fly(plan, Fault("engine_overspeed", 0.9, 30.0)))
    rpm = [event for event in events if event.kind == "E1 RPM"]
    assert rpm
    assert rpm[0].start_s > 30.0
    assert rpm[0].limit == 2700.0 < max(event.value for event in rpm)


def test_a_stall_is_found_and_a_gust_is_not() -> None:
    flight = fly(Plan(duration_s=30.0))
    states = flight.states.copy()
    states[100:110, STATE_INDEX["alpha_deg"]] = 20.0
    states[500:600, STATE_INDEX["alpha_deg"]] = 18.0
    (event,) = flight_events(Trajectory(flight.time_s, states, flight.channels))
    assert (event.kind, event.value) == ("stall", 18.0)
    assert np.isclose(event.start_s, 10.0)
    assert np.isclose(event.end_s, 11.98)

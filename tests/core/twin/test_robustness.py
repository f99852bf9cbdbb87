"""Anything that the envelope allows can be flown: finite, physical, without an abort of JSBSim."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, event, given, settings
from hypothesis import strategies as st

from core.channels import CHANNELS
from core.cylinders import CYLINDERS
from core.errors import FlightError
from core.fmea.catalogue import class_ids
from core.fmea.fault import Fault
from core.twin.events import LOST_CONTROL_BANK_DEG, STALL_ALPHA_DEG, flight_events
from core.twin.flight import fly_pair
from core.twin.plan import PLAN_RANGES, Leg, Plan, Weather
from core.twin.trajectory import Trajectory

PHYSICAL: dict[str, tuple[float, float]] = {
    "V": (0.0, 32.0),
    "A": (-60.0, 60.0),
    "gal": (-0.5, 28.0),
    "gph": (-0.5, 20.0),
    "psi": (-2.0, 115.0),
    "rpm": (0.0, 3100.0),
    "degF": (-40.0, 1700.0),
    "degC": (-60.0, 60.0),
    "kt": (30.0, 170.0),
    "fpm": (-4000.0, 4000.0),
    "g": (-2.5, 2.8),
    "ft": (0.0, 11000.0),
}
"""What no C172 leaves in one piece, by unit; sensor noise included."""


def _within(field: str) -> st.SearchStrategy[float]:
    low, high, _ = PLAN_RANGES[field]
    return st.floats(low, high)


weathers = st.builds(
    Weather,
    isa_deviation_degc=_within("isa_deviation_degc"),
    wind_kt=_within("wind_kt"),
    wind_from_deg=_within("wind_from_deg"),
    turbulence=st.sampled_from([0.0, 0.0, 1.0, 2.0, 3.0, 4.0]),
)
legs = st.builds(
    Leg,
    start_s=st.floats(1.0, 29.0),
    altitude_ft=st.none() | _within("altitude_ft"),
    speed_kt=st.none() | _within("speed_kt"),
    heading_deg=st.none() | _within("heading_deg"),
)
plans = st.builds(
    Plan,
    altitude_ft=_within("altitude_ft"),
    speed_kt=_within("speed_kt"),
    heading_deg=_within("heading_deg"),
    duration_s=st.floats(30.0, 60.0),
    seed=st.integers(0, 2**31 - 1),
    power=st.sampled_from(["fixed", "speed_hold"]),
    conditions=st.sampled_from(["lab", "field"]),
    weather=weathers,
    legs=st.just(()) | st.tuples(legs),
)
faults = st.builds(
    Fault,
    mode=st.sampled_from(class_ids()),
    severity=st.floats(0.0, 1.0),
    onset_s=st.floats(0.0, 29.0),
    cylinder=st.sampled_from([None, *CYLINDERS]),
)


def _check(flight: Trajectory, plan: Plan) -> None:
    assert len(flight) == plan.n_steps
    assert np.all(np.isfinite(flight.states))
    for channel, values in zip(CHANNELS, flight.channels.T, strict=True):
        low, high = PHYSICAL[channel.unit]
        assert np.all((values >= low) & (values <= high)), (
            channel.name,
            values.min(),
            values.max(),
        )
    kinds = {each.kind for each in flight_events(flight)}
    for kind, excess in (
        ("stall", flight.state("alpha_deg") - STALL_ALPHA_DEG),
        ("lost_control", np.abs(flight.state("roll_deg")) - LOST_CONTROL_BANK_DEG),
    ):
        if np.any(np.convolve(excess > 0.0, np.ones(50), "valid") == 50):  # for a whole second
            assert kind in kinds
            event(kind)


@pytest.mark.slow
@settings(max_examples=500, deadline=None, suppress_health_check=list(HealthCheck))
@given(plan=plans, fault=faults)
def test_anything_in_the_envelope_flies_within_physics(plan: Plan, fault: Fault) -> None:
    try:
        pair = fly_pair(plan, fault)
    except FlightError as error:
        # The top right corner would take the engine past its red line: said at once, and nowhere
        # else.
        assert "no level flight" in str(error)
        assert plan.altitude_ft > 4000.0
        assert plan.speed_kt > 104.0
        event("refused")
        assume(False)
    _check(pair.faulted, plan)
    _check(pair.mirror, plan)


def test_threads_may_fly_and_end() -> None:
    """In a process of its own: what goes wrong here ends Python."""
    program = (
        "import threading\n"
        "from core.twin.jsbsim_aircraft import _load\n"
        "for _ in range(12):\n"
        "    threads = [threading.Thread(target=_load) for _ in range(3)]\n"
        "    for thread in threads: thread.start()\n"
        "    for thread in threads: thread.join()\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=300)

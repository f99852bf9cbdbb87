"""A fault is graded: the more severe, the further it moves its main channel (paper section 6.2)."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from core.channels import channel
from core.clock import DT_S
from core.experiments.signs.signatures import signatures
from core.fmea.catalogue import class_ids
from core.fmea.fault import Fault
from core.twin.flight import fly
from core.twin.plan import Plan

FAULTS = [mode for mode in class_ids() if mode != "nominal"]
DURATION_S, ONSET_S = 150.0, 15.0
STEP = 0.05
"""Severities closer than this are not told apart here."""

plans = st.builds(
    Plan,
    altitude_ft=st.floats(3000.0, 7500.0),
    speed_kt=st.floats(88.0, 110.0),
    heading_deg=st.floats(0.0, 360.0),
    duration_s=st.just(DURATION_S),
    seed=st.integers(0, 2**31 - 1),
)
severities = st.lists(st.floats(0.1, 1.0), min_size=2, max_size=2).filter(
    lambda pair: abs(pair[0] - pair[1]) >= STEP
)


def main_channel(mode: str) -> tuple[str, float]:
    """The channel whose needle a mode moves furthest across its gauge, and the direction."""
    claims = {
        name: (entry.low + entry.high) / 2.0 / channel(name).full_scale
        for name, entry in signatures().expected[mode].items()
        if entry.sign in "+-"
    }
    name = max(claims, key=lambda name: abs(claims[name]))
    return name, float(np.sign(claims[name]))


def _assert_graded(mode: str, plan: Plan, pair: list[float]) -> None:
    """The main channel moves further, mean from half a minute after onset to the end."""
    name, direction = main_channel(mode)
    rows = slice(round((ONSET_S + 30.0) / DT_S), None)
    none, mild, severe = (
        fly(plan, fault).channel(name)[rows].mean(dtype=np.float64)
        for fault in (
            Fault("nominal"), *(Fault(mode, severity, ONSET_S) for severity in sorted(pair)),
        )
    )  # fmt: skip
    assert 0.0 < direction * (mild - none) < direction * (severe - none)


def test_the_main_channels_are_those_that_an_engineer_would_name() -> None:
    expected = {
        "baffle_crack": "E1 CHT1",
        "rocker_cover_leak": "E1 OilP",
        "oil_cooler_maintenance": "E1 OilT",
        "intake_gasket_leak": "E1 EGT2",
        "cylinder_compression": "E1 CHT4",
        "engine_overspeed": "E1 RPM",
        "inflight_anomaly": "E1 RPM",
    }
    assert {mode: main_channel(mode)[0] for mode in expected} == expected


@settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck))
@given(mode=st.sampled_from(FAULTS), plan=plans, pair=severities)
def test_the_main_effect_grows_with_severity(mode: str, plan: Plan, pair: list[float]) -> None:
    _assert_graded(mode, plan, pair)


@pytest.mark.slow
@pytest.mark.parametrize("mode", FAULTS)
def test_the_main_effect_of_each_mode_grows_with_severity(mode: str) -> None:
    @settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck))
    @given(plan=plans, pair=severities)
    def grows(plan: Plan, pair: list[float]) -> None:
        _assert_graded(mode, plan, pair)

    grows()


def test_a_failing_engine_fails_by_degrees() -> None:
    """Not its main channel alone: speed, heads, exhaust, pressure and fuel flow, step by step."""
    plan = Plan(duration_s=DURATION_S, seed=11)
    rows = slice(round((ONSET_S + 60.0) / DT_S), None)
    healthy = fly(plan)
    for name in ("E1 RPM", "E1 CHT1", "E1 EGT1", "E1 OilP", "E1 FFlow", "VSpd"):
        lost = [
            float((healthy.channel(name) - fly(plan, fault).channel(name))[rows].mean(dtype=float))
            for fault in (Fault("engine_failure", s, ONSET_S) for s in (0.1, 0.3, 0.6, 1.0))
        ]
        steps = np.diff(lost) / lost[-1]
        assert np.all(steps > 0.02), (name, lost)
        assert lost[0] < 0.85 * lost[-1], (name, lost)

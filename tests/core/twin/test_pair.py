"""The pair: what the fault may change, and what it must not."""

import ast
import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from core.channels import CHANNEL_INDEX, CHANNEL_NAMES
from core.errors import InputError
from core.fmea.catalogue import catalogue, class_ids
from core.fmea.fault import Fault
from core.twin.flight import PairFlight, fly, fly_pair
from core.twin.plan import Plan
from core.twin.trajectory import Trajectory

SHORT = Plan(duration_s=60.0, seed=11)
ONSET_S = 30.0
ONSET_STEP = 1500
FAULTS = [mode for mode in class_ids() if mode != "nominal"]


def test_nominal_residual_is_exactly_zero() -> None:
    assert not np.any(fly_pair(SHORT, Fault("nominal")).residual)


@pytest.mark.parametrize("mode", FAULTS)
def test_pair_is_bit_identical_before_onset_and_differs_after(mode: str) -> None:
    residual = fly_pair(SHORT, Fault(mode, 0.8, ONSET_S)).residual
    assert not np.any(residual[:ONSET_STEP])
    assert np.any(residual[ONSET_STEP:])
    assert np.all(np.isfinite(residual))


@pytest.mark.parametrize("mode", FAULTS)
def test_severity_zero_is_nominal(mode: str) -> None:
    assert not np.any(fly_pair(SHORT, Fault(mode, 0.0, ONSET_S)).residual)


@pytest.mark.parametrize("mode", ["engine_run_rough", "baffle_screw", "intake_manifold_loose"])
def test_blocks_of_any_size_give_the_same_bytes(mode: str) -> None:
    fault = Fault(mode, 0.7, ONSET_S)
    flight, blocks = PairFlight(SHORT, fault), []
    for seconds in (0.1, 7.3, 13.0, 60.0):
        if (block := flight.advance(seconds)) is not None:
            blocks.append(block.faulted)
    assert flight.advance(1.0) is None
    joined, whole = Trajectory.joined(blocks), fly_pair(SHORT, fault).faulted
    assert joined.channels.tobytes() == whole.channels.tobytes()
    assert joined.states.tobytes() == whole.states.tobytes()


@pytest.mark.parametrize("mode", FAULTS)
def test_flying_alone_equals_flying_beside_the_mirror(mode: str) -> None:
    """Also proves the shortcut: a fault that spares the engine is not flown a second time."""
    fault = Fault(mode, 0.9, ONSET_S)
    alone, paired = fly(SHORT, fault), fly_pair(SHORT, fault).faulted
    assert alone.channels.tobytes() == paired.channels.tobytes()
    assert alone.states.tobytes() == paired.states.tobytes()


def _digest(plan: Plan, fault: Fault) -> str:
    pair = fly_pair(plan, fault)
    parts = (pair.faulted.channels, pair.mirror.channels, pair.faulted.states)
    return hashlib.sha256(b"".join(part.tobytes() for part in parts)).hexdigest()


def test_same_inputs_give_the_same_bytes_in_another_process() -> None:
    code = (
        "import hashlib\n"
        "from core.fmea.fault import Fault\n"
        "from core.twin.flight import fly_pair\n"
        "from core.twin.plan import Plan\n"
        "p = fly_pair(Plan(duration_s=60.0, seed=11), Fault('engine_run_rough', 0.8, 30.0))\n"
        "parts = (p.faulted.channels, p.mirror.channels, p.faulted.states)\n"
        "print(hashlib.sha256(b''.join(x.tobytes() for x in parts)).hexdigest())\n"
    )
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert other.stdout.strip() == _digest(SHORT, Fault("engine_run_rough", 0.8, 30.0))


def test_another_seed_gives_another_aircraft() -> None:
    one, two = fly(SHORT), fly(Plan(duration_s=60.0, seed=12))
    assert not np.allclose(one.channel("E1 EGT1").mean(), two.channel("E1 EGT1").mean(), atol=1e-3)


def test_onset_after_the_end_is_refused() -> None:
    with pytest.raises(InputError, match="onset_s: must lie in 0 to 60 s"):
        fly_pair(SHORT, Fault("engine_failure", 0.8, 60.0))


def test_nominal_stays_inside_every_limit() -> None:
    from core.channels import CHANNELS

    for speed_kt in (90.0, 100.0, 110.0):
        means = fly(Plan(speed_kt=speed_kt, duration_s=60.0)).channels.mean(axis=0)
        for channel, mean in zip(CHANNELS, means, strict=True):
            if channel.green is not None:
                assert channel.green[0] <= mean <= channel.green[1], (channel.name, mean)


def test_plan_is_held() -> None:
    flight = fly(Plan(altitude_ft=4800.0, speed_kt=95.0, heading_deg=123.0, seed=5))
    assert np.abs(flight.state("altitude_ft") - 4800.0).max() < 5.0
    assert np.abs(flight.state("ias_kt") - 95.0).max() < 1.0
    assert np.abs(flight.state("heading_deg") - 123.0).max() < 1.0


def test_speed_hold_opens_the_throttle_against_a_power_loss() -> None:
    fault = Fault("cylinder_compression", 0.8, ONSET_S)
    held = fly_pair(Plan(duration_s=180.0, power="speed_hold"), fault)
    fixed = fly_pair(Plan(duration_s=180.0), fault)
    assert held.faulted.state("throttle")[-1] > held.mirror.state("throttle")[-1] + 0.005
    assert fixed.faulted.state("throttle")[-1] == fixed.mirror.state("throttle")[-1]
    speed = CHANNEL_INDEX["IAS"]
    assert abs(held.residual[-500:, speed].mean()) < 0.5 * abs(fixed.residual[-500:, speed].mean())


def test_sensors_cannot_know_the_fault() -> None:
    """No import of the sensor module leads to a fault, a mode or the catalogue."""
    source = (Path(__file__).parents[3] / "core" / "twin" / "sensors.py").read_text()
    imported = {
        node.module
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom) and node.module
    }
    assert not imported & {"core.fmea.fault", "core.fmea.catalogue", "core.fmea.injection"}
    assert not any(mode in source for mode in FAULTS)


@settings(max_examples=15, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    mode=st.sampled_from(FAULTS),
    severity=st.floats(0.0, 1.0),
    onset_s=st.floats(0.0, 29.0),
    cylinder=st.sampled_from([None, 1, 2, 3, 4]),
    altitude_ft=st.floats(2000.0, 9000.0),
    speed_kt=st.floats(80.0, 110.0),
    seed=st.integers(0, 2**31 - 1),
)
def test_anything_in_the_envelope_flies(
    mode: str,
    severity: float,
    onset_s: float,
    cylinder: int | None,
    altitude_ft: float,
    speed_kt: float,
    seed: int,
) -> None:
    plan = Plan(altitude_ft=altitude_ft, speed_kt=speed_kt, duration_s=30.0, seed=seed)
    pair = fly_pair(plan, Fault(mode, severity, onset_s, cylinder))
    assert pair.faulted.channels.shape == (1500, len(CHANNEL_NAMES))
    assert np.all(np.isfinite(pair.faulted.channels))
    assert np.all(pair.faulted.channel("E1 OilP") > -2.0)
    assert np.all(pair.faulted.state("rpm") < 3000.0)


def test_every_mode_but_the_cooling_and_oil_ones_reaches_the_engine() -> None:
    spared = {mode for mode in FAULTS if not catalogue()[mode].moves_engine}
    assert spared == {mode for mode in FAULTS if mode.startswith("baffle_")} | {
        "rocker_cover_leak",
        "oil_cooler_maintenance",
    }

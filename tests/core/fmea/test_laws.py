"""Layer 1: each law against its equation."""

import math

import numpy as np
import pytest

from core.clock import TICK_S
from core.errors import InputError
from core.fmea.laws import REFERENCE_QBAR_PSF, REFERENCE_RPM, Drivers, read_law

CRUISE = Drivers(REFERENCE_RPM, REFERENCE_QBAR_PSF, 100.0)


def _levels(spec: dict[str, object], seconds: float, drivers: Drivers = CRUISE) -> list[float]:
    law = read_law("law", spec).start(np.random.default_rng(1))
    return [law.step(drivers) for _ in range(round(seconds / TICK_S))]


def test_exponential_approach() -> None:
    levels = _levels({"kind": "exponential", "tau_s": 40.0}, 40.0)
    assert levels[-1] == pytest.approx(1.0 - math.exp(-1.0), rel=1e-9)


def test_accumulated_loss_is_the_integral_of_the_rate() -> None:
    spec = {"kind": "exponential", "tau_s": 40.0, "accumulates_over_s": 200.0}
    elapsed_s = 200.0
    exact = (elapsed_s - 40.0 * (1.0 - math.exp(-elapsed_s / 40.0))) / 200.0
    assert _levels(spec, elapsed_s)[-1] == pytest.approx(exact, rel=2e-3)


def test_linear_accumulation_saturates() -> None:
    levels = _levels({"kind": "linear", "duration_s": 100.0}, 150.0)
    assert levels[499] == pytest.approx(0.5)
    assert levels[-1] == 1.0


def test_fatigue_reaches_one_after_its_duration_and_accelerates() -> None:
    levels = _levels({"kind": "fatigue", "duration_s": 100.0}, 100.0)
    assert levels[-1] == pytest.approx(1.0, abs=0.02)
    assert levels[499] < 0.4  # da/dt = C (1 + 3a): (4^0.5 - 1) / 3 = 1/3 at half time


def test_fatigue_runs_faster_at_higher_engine_speed() -> None:
    fast = Drivers(2600.0, REFERENCE_QBAR_PSF, 100.0)
    spec = {"kind": "fatigue", "duration_s": 100.0}
    assert _levels(spec, 50.0, fast)[-1] > _levels(spec, 50.0)[-1]


def test_releases_make_a_staircase_with_shortening_steps() -> None:
    spec = {"kind": "fatigue", "duration_s": 100.0, "releases": [0.2, 0.5, 0.9]}
    levels = np.array(_levels(spec, 100.0))
    assert set(np.round(levels, 6)) == {0.0, round(1 / 3, 6), round(2 / 3, 6), 1.0}
    steps = np.flatnonzero(np.diff(levels)) * TICK_S
    assert steps[1] - steps[0] < steps[0] + 1.0


def test_breakthrough_is_slow_then_sudden() -> None:
    spec = {"kind": "fatigue", "duration_s": 100.0, "breakthrough": 0.6}
    levels = _levels(spec, 140.0)
    assert max(levels[:600]) < 0.1
    assert levels[-1] > 0.9


def test_flap_opens_above_its_speed_and_reseats_lower() -> None:
    spec = {
        "kind": "flap", "loosening_tau_s": 1.0, "opens_at_kias": 95.0,
        "reseats_lower_kt": 8.0, "seeping_share": 0.3,
    }  # fmt: skip
    law = read_law("law", spec).start(np.random.default_rng(1))

    def settle(ias_kt: float) -> float:
        drivers = Drivers(REFERENCE_RPM, REFERENCE_QBAR_PSF, ias_kt)
        return [law.step(drivers) for _ in range(600)][-1]

    assert settle(80.0) == pytest.approx(0.3, abs=0.01)  # shut: it only seeps
    assert settle(90.0) == pytest.approx(1.0, abs=0.01)  # blown open above 95 - 8
    assert settle(83.0) == pytest.approx(1.0, abs=0.01)  # hysteresis: stays open
    assert settle(75.0) == pytest.approx(0.3, abs=0.01)  # re-seated


def test_gate_opens_a_growing_share_of_the_time() -> None:
    spec = {
        "kind": "gate", "on_s": 4.0, "start_duty": 0.2, "end_duty": 0.7, "ramp_s": 400.0,
    }  # fmt: skip
    levels = np.array(_levels(spec, 1600.0))
    assert set(levels) == {0.0, 1.0}
    assert levels[:2000].mean() < 0.45 < 0.55 < levels[-8000:].mean() < 0.85


def test_pulse_recovers() -> None:
    spec = {"kind": "pulse", "fall_tau_s": 3.0, "hold_s": 20.0, "recover_tau_s": 5.0, "gap_s": 60.0}
    levels = np.array(_levels(spec, 70.0))
    assert levels.max() > 0.95
    assert levels[450:600].min() < 0.05


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"kind": "magic"}, "unknown law 'magic'"),
        ({"kind": "linear"}, "duration_s"),
        ({"kind": "linear", "duration_s": 1.0, "speed": 2.0}, "is not a parameter of linear"),
    ],
)
def test_bad_law_is_named(table: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_law("x.drive.law", table)

"""The sequential test finds what leaves healthy noise, when it did, and nothing else."""

import json

import numpy as np
import pytest

from core.channels import CHANNEL_INDEX, N_CHANNELS
from core.residual.departure import Departure, DepartureTest
from core.residual.healthy import (
    STEP_S,
    HealthyResidual,
    Kind,
    change_sd,
    covariance,
    load_healthy,
    readable,
    rotated,
)

N_STEPS = 180
"""15 minutes."""


@pytest.fixture(scope="module")
def healthy() -> HealthyResidual:
    return load_healthy()


def _noise(healthy: HealthyResidual, seed: int, kind: Kind = "cruise") -> np.ndarray:
    """Step means (n, 23) of a healthy flight as the description has it, in light turbulence."""
    rng = np.random.default_rng(seed)
    process = healthy.process(kind, float(healthy.gustiness[0, 1]))
    lags = np.abs(np.subtract.outer(np.arange(N_STEPS), np.arange(N_STEPS)))
    columns = []
    for variances in process:
        factor = np.linalg.cholesky(covariance(variances, N_STEPS)[lags] + 1e-12 * np.eye(N_STEPS))
        columns.append(factor @ rng.standard_normal(N_STEPS) + rng.normal(0.0, 3.0))
    mixed = np.array(columns).T
    for name in ("CHT", "EGT"):  # back from common and contrasts to cylinders
        at = [CHANNEL_INDEX[f"E1 {name}{cylinder}"] for cylinder in (1, 2, 3, 4)]
        unit = np.zeros((4, N_CHANNELS))
        unit[np.arange(4), at] = 1.0
        mixed[:, at] = mixed[:, at] @ np.linalg.inv(rotated(unit)[:, at]).T
    return mixed


def _tested(healthy: HealthyResidual, flight: np.ndarray) -> Departure | None:
    test = DepartureTest(healthy)
    for step in flight:
        test.push(step, np.zeros(N_CHANNELS))
    return test.finish()


@pytest.mark.parametrize("seed", range(6))
def test_a_healthy_flight_departs_from_nothing(healthy, seed):
    assert _tested(healthy, _noise(healthy, seed)) is None


@pytest.mark.parametrize("onset_s", [60.0, 115.0, 140.0, 400.0])
@pytest.mark.parametrize(
    ("name", "size", "tau_s"), [("E1 EGT2", 40.0, 9.0), ("E1 CHT4", -20.0, 170.0)]
)
def test_a_departure_is_found_and_dated(healthy, onset_s, name, size, tau_s):
    flight = _noise(healthy, 11)
    since_s = np.maximum((np.arange(N_STEPS) + 0.5) * STEP_S - onset_s, 0.0)
    flight[:, CHANNEL_INDEX[name]] += size * (1.0 - np.exp(-since_s / tau_s))
    found = _tested(healthy, flight)
    assert found is not None
    assert found.onset_s == pytest.approx(onset_s, abs=15.0)
    assert found.low_s <= found.onset_s <= found.high_s
    assert onset_s < found.found_s <= onset_s + 60.0


def test_a_gust_is_no_departure(healthy):
    flight = _noise(healthy, 12)
    flight[90:92, CHANNEL_INDEX["E1 RPM"]] += 60.0
    assert _tested(healthy, flight) is None


def test_nothing_found_is_taken_back(healthy):
    """What comes later does not change when a departure is found, nor its onset."""
    flight = _noise(healthy, 13)
    flight[80:, CHANNEL_INDEX["E1 CHT1"]] += 8.0
    test = DepartureTest(healthy)
    found = [test.push(step, np.zeros(N_CHANNELS)) for step in flight]
    first = next(item for item in found if item is not None)
    assert found[-1] == test.finish() == first
    assert found.index(first) * STEP_S <= 80 * STEP_S + 60.0


def test_the_spread_over_time_is_that_of_the_process(healthy):
    process = healthy.process("manoeuvres", 0.02)
    spread = change_sd(process, 6, 40)
    column = CHANNEL_INDEX["E1 OilT"]
    lags = np.abs(np.subtract.outer(np.arange(60), np.arange(60)))
    whole = covariance(process[column], 60)[lags]
    for row in (0, 7, 39):
        weights = np.zeros(60)
        weights[:6] -= 1.0 / 6.0
        weights[6 + row + 1 - 6 : 6 + row + 1] += 1.0 / 6.0
        assert spread[row, column] == pytest.approx(np.sqrt(weights @ whole @ weights), rel=1e-9)


def test_the_file_is_read_back(healthy):
    again = HealthyResidual.from_dict(json.loads(readable(healthy)))
    np.testing.assert_allclose(again.variances, healthy.variances, rtol=1e-5)
    np.testing.assert_allclose(again.gustiness, healthy.gustiness)


def test_a_file_of_another_version_is_refused(healthy):
    with pytest.raises(ValueError, match="another version"):
        HealthyResidual.from_dict(healthy.to_dict() | {"step_s": 1.0})

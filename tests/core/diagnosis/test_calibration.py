"""Temperature, calibration error and energy on logits whose answers are known."""

import numpy as np
import pytest
from scipy.special import softmax

from core.diagnosis.calibration import Calibration, calibration_error, energy


def sampled(n, factor, seed=0):
    """Logits ``factor`` times too sure, and truths drawn from what they should be."""
    rng = np.random.default_rng(seed)
    honest = rng.normal(scale=2.0, size=(n, 5))
    shares = softmax(honest, axis=1)
    truth = np.array([rng.choice(5, p=row) for row in shares])
    return (factor * honest).astype(np.float32), truth


@pytest.mark.parametrize("factor", [0.5, 1.0, 3.0])
def test_the_temperature_is_how_much_too_sure_the_logits_are(factor):
    logits, truth = sampled(6000, factor)
    calibration = Calibration.fitted(logits, truth)
    assert calibration.temperature == pytest.approx(factor, rel=0.1)


def test_calibration_lowers_the_error_on_unseen_windows():
    calibration = Calibration.fitted(*sampled(3000, 3.0))
    logits, truth = sampled(3000, 3.0, seed=1)
    report = calibration.report(logits, truth)
    error = report["expected_calibration_error"]
    assert error["before"] > 0.1
    assert error["after"] < 0.03
    np.testing.assert_array_equal(
        calibration.probabilities(logits).argmax(axis=1), logits.argmax(axis=1)
    )


def test_calibration_error_by_hand():
    probabilities = np.array([[0.95, 0.05]] * 4 + [[0.35, 0.65]] * 4)
    truth = np.array([0, 0, 0, 1, 1, 1, 0, 0])
    # 0.95 sure and right in 3 of 4; 0.65 sure and right in 2 of 4
    assert calibration_error(probabilities, truth) == pytest.approx((0.2 + 0.15) / 2)


def test_energy_is_high_where_no_class_speaks_up():
    quiet, loud = energy(np.zeros((1, 20))), energy(np.array([[12.0] + [0.0] * 19]))
    assert quiet[0] == pytest.approx(-np.log(20))
    assert loud[0] < quiet[0]


def test_the_threshold_refuses_one_known_window_in_a_hundred():
    logits, truth = sampled(5000, 1.0)
    calibration = Calibration.fitted(logits, truth)
    assert np.mean(calibration.energy(logits) > calibration.threshold) == pytest.approx(0.01)
    assert calibration.energy(np.full((1, 5), -9.0, dtype=np.float32))[0] > calibration.threshold

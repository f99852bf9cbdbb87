"""The 46 channels and their normalisation."""

import json

import numpy as np
import pytest

from core.channels import CHANNEL_INDEX, CHANNELS, N_CHANNELS
from core.diagnosis.features import (
    COMPRESSION,
    FEATURE_MODES,
    MIN_RESIDUAL_SD,
    MIRROR_SHAPE_GAIN,
    N_FEATURES,
    POOL_STEPS,
    Normalisation,
    baseline,
    contrasted,
    feature_mode,
    pooled,
)


@pytest.fixture
def flights(make_pair):
    shifts = [("E1 CHT1", 6.0, 10.0, 20.0), ("E1 EGT1", -200.0, 5.0, 20.0)]
    pairs = [make_pair(20.0, shift, seed=seed) for seed, shift in enumerate(shifts)]
    return [(FEATURE_MODES["paired"].residual(pair), pair.faulted.channels) for pair in pairs]


def test_constants_are_those_of_the_training_flights(flights):
    fitted = Normalisation.fitted(iter(flights), FEATURE_MODES["paired"])
    sensors = np.concatenate([pooled(sensors)[::5] for _, sensors in flights]).astype(np.float64)
    low, middle, high = np.percentile(sensors, (25, 50, 75), axis=0)
    assert fitted.sensor_mean == pytest.approx(middle)
    assert fitted.sensor_sd == pytest.approx((high - low) / 1.349)
    cht1 = CHANNEL_INDEX["E1 CHT1"]
    # A quarter of the samples stand at +6 degF, the rest at nothing.
    scale = COMPRESSION * CHANNELS[cht1].noise_sd
    assert fitted.residual_sd[cht1] == pytest.approx(np.arcsinh(6.0 / scale) / 2, rel=1e-4)
    assert fitted.residual_sd[CHANNEL_INDEX["volt1"]] == MIN_RESIDUAL_SD


def test_no_residual_stays_exactly_zero_and_sign_is_kept(flights):
    fitted = Normalisation.fitted(iter(flights), FEATURE_MODES["paired"])
    residual, sensors = flights[1]
    features = fitted.features(residual, sensors)
    assert features.shape == (N_FEATURES, len(residual) // POOL_STEPS)
    assert features.dtype == np.float32
    egt1 = CHANNEL_INDEX["E1 EGT1"]
    assert not features[:N_CHANNELS][np.arange(N_CHANNELS) != egt1].any()
    before_the_step = fitted.features(residual[:250], sensors[:250])
    assert not before_the_step[:N_CHANNELS].any()
    assert features[egt1, -1] < features[egt1, 0]  # it fell
    np.testing.assert_array_equal(
        fitted.features(-residual, sensors)[:N_CHANNELS], -features[:N_CHANNELS]
    )


def _steady(size):
    """A window that stands ``size`` off its mirror on every channel throughout."""
    return np.full((1500, N_CHANNELS), size, dtype=np.float32)


def test_a_ratio_of_residuals_becomes_a_difference(flights):
    fitted = Normalisation.fitted(iter(flights), FEATURE_MODES["paired"])
    cht1 = CHANNEL_INDEX["E1 CHT1"]
    level = {
        size: fitted.features(_steady(size), _steady(size))[cht1].mean()
        for size in (3.0, 6.0, 400.0, 800.0)
    }
    assert level[6.0] - level[3.0] == pytest.approx(level[800.0] - level[400.0], rel=1e-3)


def test_the_course_within_a_window_is_magnified(flights):
    fitted = Normalisation.fitted(iter(flights), FEATURE_MODES["paired"])
    cht1 = CHANNEL_INDEX["E1 CHT1"]
    growing = _steady(4.0) * np.linspace(0.99, 1.01, 1500, dtype=np.float32)[:, None]
    found = fitted.features(growing, growing)[cht1]
    # Two per cent of growth is 0.02 in the logarithm, times the gain.
    assert found[-1] - found[0] == pytest.approx(2 * np.arcsinh(0.01 * MIRROR_SHAPE_GAIN), rel=0.01)
    still = fitted.features(_steady(4.0), growing)[cht1]
    assert found.mean() == pytest.approx(still.mean(), abs=1e-3)
    assert np.ptp(still) < 1e-4


def test_the_card_keeps_every_constant(flights):
    fitted = Normalisation.fitted(iter(flights), FEATURE_MODES["paired"])
    read = Normalisation.from_dict(json.loads(json.dumps(fitted.to_dict())))
    residual, sensors = flights[0]
    np.testing.assert_array_equal(
        read.features(residual, sensors), fitted.features(residual, sensors)
    )


def test_the_course_of_a_sensor_is_magnified_too_and_dead_engines_are_held_back(flights):
    fitted = Normalisation.fitted(iter(flights), FEATURE_MODES["raw"])
    cht1 = CHANNEL_INDEX["E1 CHT1"]
    middle, sd = fitted.sensor_mean[cht1], fitted.sensor_sd[cht1]
    growing = np.full((1500, N_CHANNELS), middle, dtype=np.float32)
    growing[:, cht1] += sd * np.linspace(-0.05, 0.05, 1500, dtype=np.float32)
    found = fitted.features(growing, growing, "states")[cht1]
    assert np.ptp(found) == pytest.approx(2 * np.arcsinh(10 * 0.05), rel=0.02)
    far = np.full((1500, N_CHANNELS), middle + 100 * sd, dtype=np.float32)
    assert fitted.features(far, far, "states")[cht1] == pytest.approx(np.arcsinh(100), rel=0.01)


def test_steps_are_means_and_a_rest_is_left_out():
    rows = np.arange(2 * 25, dtype=np.float32).reshape(25, 2)
    np.testing.assert_array_equal(pooled(rows), [[9.0, 10.0], [29.0, 30.0]])


def test_a_card_of_other_steps_is_refused(flights):
    told = Normalisation.fitted(iter(flights), FEATURE_MODES["paired"]).to_dict()
    with pytest.raises(ValueError, match="1 samples were pooled, not 10"):
        Normalisation.from_dict(told | {"pool_steps": 1})


@pytest.mark.parametrize("inputs", ["residuals", "states"])
def test_either_half_is_that_of_the_whole(flights, inputs):
    fitted = Normalisation.fitted(iter(flights), FEATURE_MODES["paired"])
    both, half = (fitted.features(*flights[0], shown) for shown in ("both", inputs))
    rows = slice(0, N_CHANNELS) if inputs == "residuals" else slice(N_CHANNELS, None)
    np.testing.assert_array_equal(half, both[rows])


def test_differences_are_those_of_neighbouring_readings(make_pair):
    pair = make_pair(10.0)
    channels = pair.faulted.channels
    found = FEATURE_MODES["differencing"].residual(pair)
    np.testing.assert_array_equal(found[1:], np.diff(channels, axis=0))
    assert not found[0].any()
    assert not FEATURE_MODES["raw"].residual(pair).any()


def test_only_the_field_s_mirror_is_debiased(make_pair):
    pair = make_pair(35.0, ("E1 CHT1", 4.0, 0.0, 35.0))
    assert not feature_mode("paired", "lab").debiased
    assert feature_mode("surrogate", "field") is FEATURE_MODES["surrogate"]
    mode = feature_mode("paired", "field")
    assert mode.debiased
    found = baseline(mode, pair)
    assert found[CHANNEL_INDEX["E1 CHT1"]] == pytest.approx(4.0, abs=1e-3)
    assert np.count_nonzero(found) == 1


def test_in_field_what_all_cylinders_share_is_shown_small(flights):
    residual = np.zeros((1500, N_CHANNELS), dtype=np.float32)
    heads = [CHANNEL_INDEX[f"E1 CHT{number}"] for number in (1, 2, 3, 4)]
    residual[:, heads] = 4.0
    residual[:, heads[2]] = 8.0
    found = contrasted(residual, 0.9)[0, heads]
    np.testing.assert_allclose(found, [-0.5, -0.5, 3.5, -0.5], rtol=1e-5)
    np.testing.assert_array_equal(contrasted(residual, 0.0), residual)
    assert residual[0, heads[0]] == 4.0  # the residual itself is left as it was
    others = [column for column in range(N_CHANNELS) if column not in heads]
    noisy = flights[0][0]
    np.testing.assert_array_equal(contrasted(noisy, 0.9)[:, others[:5]], noisy[:, others[:5]])


def test_the_contrast_is_that_of_the_card(flights):
    mode = feature_mode("paired", "field")
    fitted = Normalisation.fitted(iter(flights), mode)
    assert fitted.contrast == mode.contrast > 0.0
    again = Normalisation.from_dict(json.loads(json.dumps(fitted.to_dict())))
    np.testing.assert_array_equal(again.features(*flights[0]), fitted.features(*flights[0]))
    plain = fitted.to_dict()
    del plain["contrast"]  # as cards were before there was any
    assert Normalisation.from_dict(plain).contrast == 0.0


def test_lab_sees_each_cylinder_as_it_is():
    assert feature_mode("paired", "lab").contrast == 0.0
    assert feature_mode("surrogate", "field").contrast == 0.0

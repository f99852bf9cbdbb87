"""The surrogate's residual: both forms, its three layers, and the commands it is told."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch

from core.channels import CHANNEL_INDEX, CHANNELS, N_CHANNELS
from core.dataset.generate import DatasetSpec, planned_runs
from core.errors import InputError, MirrorTwinError
from core.model_card import Card, load_model
from core.residual.controls import CONTROL_NAMES, controls
from core.residual.gru import GruNetwork
from core.residual.surrogate import (
    BASELINE_ROWS,
    CHUNK,
    FULL_SCALE,
    SMOOTH_STEPS,
    Surrogate,
    debiased,
    sliding_mean,
)
from core.residual.surrogate_training import FIRST_SEED, SurrogateSettings, train_surrogate
from core.twin.plan import Leg, Plan


@pytest.fixture(scope="module")
def surrogate() -> Surrogate:
    """One with random weights: both forms must agree whatever was learnt."""
    torch.set_num_threads(1)
    torch.manual_seed(1)
    noise = np.array([channel.noise_sd for channel in CHANNELS], dtype=np.float32)
    return Surrogate(
        name="untrained",
        conditions="lab",
        fingerprint="none",
        network=GruNetwork(10).eval(),
        channel_mean=np.full(N_CHANNELS, 100.0, dtype=np.float32),
        channel_sd=3.0 * noise,
        residual_sd=2.0 * noise,
        usual=np.full(N_CHANNELS, 0.1, dtype=np.float32),
    )


def recording(n_rows: int, seed: int = 0):
    """Noisy readings with a ramp in one channel, and the commands of a cruise."""
    rng = np.random.default_rng(seed)
    channels = 100.0 + rng.normal(size=(n_rows, N_CHANNELS)) * [c.noise_sd for c in CHANNELS]
    channels[:, CHANNEL_INDEX["E1 CHT1"]] += np.maximum(0, np.arange(n_rows) - 1800) * 0.01
    return channels.astype(np.float32), controls(Plan(), 0, n_rows)


@pytest.mark.parametrize(
    "cuts",
    [[], [1, 2, 123, 124, 125, 126, 249, 250, 251], list(range(1, 760)), list(range(37, 3000, 37))],
)
def test_streaming_equals_the_fast_form(surrogate, cuts):
    channels, commanded = recording(3000)
    fast = surrogate.smoothed(channels, commanded)
    stream = surrogate.stream()
    streamed = np.concatenate(
        [stream.push(channels[a:b], commanded[a:b]) for a, b in pairwise([0, *cuts, 3000])]
    )
    assert np.abs(fast[CHUNK:]).max() > 0.1
    np.testing.assert_allclose(streamed, fast, atol=1e-4)


def test_a_stretch_on_the_grid_has_the_residual_of_the_whole_flight(surrogate):
    channels, commanded = recording(4000)
    whole = surrogate.error(channels, commanded)
    stretch = surrogate.error(channels[1000:3100], commanded[1000:3100])
    np.testing.assert_allclose(stretch[CHUNK:], whole[1000 + CHUNK : 3100], atol=1e-5)
    assert not stretch[:CHUNK].any()


def test_the_prediction_of_a_reading_does_not_know_it(surrogate):
    channels, commanded = recording(2000)
    nudged = channels.copy()
    nudged[1500] += 7.0
    before, after = (surrogate.error(each, commanded) for each in (channels, nudged))
    np.testing.assert_array_equal(after[:1500], before[:1500])
    np.testing.assert_allclose(after[1500] - before[1500], 7.0, atol=1e-3)


def test_the_divisor_is_at_least_a_hundredth_of_the_range(surrogate):
    noisy = replace(surrogate, residual_sd=np.full(N_CHANNELS, 1.0, dtype=np.float32))
    assert noisy.divisor == pytest.approx(np.maximum(1.0, 0.01 * FULL_SCALE))
    assert noisy.divisor[CHANNEL_INDEX["volt1"]] == 1.0
    assert noisy.divisor[CHANNEL_INDEX["E1 EGT1"]] == pytest.approx(10.0)


def test_the_healthy_beginning_is_taken_away(surrogate):
    channels, commanded = recording(2500)
    biased = replace(surrogate, channel_mean=surrogate.channel_mean + 1.0)
    smoothed = biased.smoothed(channels, commanded)
    finished = biased.residual(channels, commanded)
    np.testing.assert_array_equal(finished, debiased(smoothed))
    np.testing.assert_allclose(finished[BASELINE_ROWS].mean(axis=0), 0.0, atol=1e-5)
    shift = smoothed - finished
    assert np.ptp(shift[BASELINE_ROWS.start :], axis=0) == pytest.approx(0.0, abs=1e-5)
    assert np.abs(shift).max() > 0.1
    assert not finished[: BASELINE_ROWS.start].any()


def test_smoothing_is_the_mean_of_the_last_second():
    values = np.random.default_rng(0).normal(size=(300, 2)).astype(np.float32)
    found = sliding_mean(values)
    assert found[200] == pytest.approx(values[201 - SMOOTH_STEPS : 201].mean(axis=0), abs=1e-6)


def test_commands_are_those_of_the_plan():
    plan = Plan(
        altitude_ft=4800.0, speed_kt=95.0, heading_deg=350.0, duration_s=120.0,
        legs=(Leg(20.0, heading_deg=20.0), Leg(60.0, altitude_ft=5000.0, speed_kt=100.0)),
    )  # fmt: skip
    commanded = controls(plan, 0, 6000)
    assert commanded.shape == (6000, len(CONTROL_NAMES))
    assert commanded[0].tolist() == pytest.approx([4800.0, 95.0, 0.0, 0.93])
    assert commanded[25 * 50].tolist() == pytest.approx([4800.0, 95.0, 30.0, 0.93])
    assert commanded[-1].tolist() == pytest.approx([5000.0, 100.0, 30.0, 0.93])
    climbing = commanded[70 * 50, 0]
    assert 4800.0 < climbing < 5000.0
    np.testing.assert_array_equal(controls(plan, 2500, 700), commanded[2500:3200])


def test_healthy_flights_are_in_no_data_set():
    spec = DatasetSpec.load()
    used = range(FIRST_SEED, FIRST_SEED + 10_000)
    assert not any(run.plan.seed in used for run in planned_runs(spec))
    assert not any(seed in used for seed in (7_000_000, 700_000))


TINY = SurrogateSettings(flights=2, held_out=1, duration_s=40.0, updates=24, batch=2, horizon=3)


class KilledError(Exception):
    """Stands for a kill between two checkpoints."""


@pytest.fixture(scope="module")
def trained(tmp_path_factory) -> tuple[Path, Card]:
    """An undisturbed small training: its folder and its card."""
    folder = tmp_path_factory.mktemp("surrogate")
    return folder, train_surrogate(folder, TINY, work_dir=folder)


@pytest.mark.slow
def test_a_killed_training_ends_with_the_same_weights(trained, tmp_path):
    def killed(step):
        raise KilledError

    with pytest.raises(KilledError):
        train_surrogate(tmp_path, TINY, work_dir=tmp_path, progress=killed)
    assert not list(tmp_path.glob("*.json"))
    steps = []
    again = train_surrogate(tmp_path, TINY, work_dir=tmp_path, progress=steps.append)
    assert [step.done for step in steps] == [24]
    _, card = trained
    assert again["weights_sha256"] == card["weights_sha256"]
    assert again["scores"] == card["scores"]


@pytest.mark.slow
def test_the_card_is_enough_to_predict(trained):
    folder, card = trained
    read = Surrogate.from_card(*load_model(folder, "gru-lab"))
    assert len(card["inputs"]) == 27
    assert read.residual_sd == pytest.approx(card["constants"]["residual_sd"])
    assert read.fingerprint == Surrogate.from_card(*load_model(folder, "gru-lab")).fingerprint
    course = card["training"]["loss_course"]
    assert course[-1] < course[0]


def test_a_card_of_another_version_is_a_clear_error():
    with pytest.raises(MirrorTwinError, match=r"model gru-lab: .*train it again"):
        Surrogate.from_card({"name": "gru-lab", "horizon": 10}, {})


def test_bad_settings_name_their_field():
    with pytest.raises(InputError, match="horizon"):
        SurrogateSettings(horizon=0)
    with pytest.raises(InputError, match="conditions"):
        SurrogateSettings(conditions="dream")

"""Windows, verdicts and models on disk; what the network has learnt is tested elsewhere."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from core.diagnosis.diagnosis import Diagnosis, Intervention
from core.diagnosis.features import feature_mode
from core.diagnosis.predict import Diagnoser, counted_windows, load_diagnoser
from core.errors import InputError, MirrorTwinError
from core.model_card import load_model, save_model
from core.twin.trajectory import Pair

FAULT = ("E1 CHT1", 8.0, 33.3, 300.0)


@pytest.mark.parametrize("cuts", [[1], [1499, 1500, 1501], [50 * k for k in range(1, 64)]])
def test_streaming_equals_the_whole_run(make_pair, untrained, cuts):
    pair = make_pair(64.0, FAULT)
    whole = untrained.diagnose(pair)
    stream = untrained.stream()
    edges = [0, *cuts, len(pair.faulted)]
    streamed = [
        window for start, stop in pairwise(edges) for window in stream.push(pair[start:stop])
    ]
    assert [end_s for end_s, _ in streamed] == list(whole.time_s)
    np.testing.assert_array_equal([p for _, p in streamed], whole.probabilities_over_time)
    assert stream.finish().to_dict() == whole.to_dict()


def test_a_window_is_reported_as_soon_as_it_has_flown(make_pair, untrained):
    pair = make_pair(40.0)
    stream = untrained.stream()
    completed = {
        second: [end_s for end_s, _ in stream.push(pair[50 * (second - 1) : 50 * second])]
        for second in range(1, 41)
    }
    assert {second: ends for second, ends in completed.items() if ends} == {
        30: [pytest.approx(30.0)],
        35: [pytest.approx(35.0)],
        40: [pytest.approx(40.0)],
    }


def test_probabilities_are_probabilities(make_pair, untrained):
    diagnosis = untrained.diagnose(make_pair(60.0, FAULT))
    assert diagnosis.probabilities.shape == (20,)
    assert diagnosis.probabilities_over_time.shape == (7, 20)
    assert diagnosis.probabilities.dtype == diagnosis.probabilities_over_time.dtype == np.float32
    np.testing.assert_allclose(diagnosis.probabilities_over_time.sum(axis=1), 1.0, rtol=1e-5)
    assert diagnosis.onset_s == pytest.approx(33.3)
    assert [item.channel for item in diagnosis.evidence] == ["E1 CHT1"]


def test_states_are_never_looked_at(make_pair, untrained):
    pair = make_pair(60.0, FAULT)
    blind = Pair(
        replace(pair.faulted, states=np.full_like(pair.faulted.states, np.nan)), pair.mirror
    )
    assert untrained.diagnose(blind).to_dict() == untrained.diagnose(pair).to_dict()


def test_less_than_a_window_is_refused(make_pair, untrained):
    with pytest.raises(InputError, match=r"flight: must last at least 30 s"):
        untrained.diagnose(make_pair(29.0))


ENDS_S = np.arange(30.0, 301.0, 5.0)


@pytest.mark.parametrize(
    ("onset_s", "flight_s", "first_s", "last_s"),
    [
        (None, 300, 30, 300),
        (60.0, 300, 90, 180),
        (61.3, 300, 95, 180),
        (0.0, 300, 30, 120),
        (250.0, 300, 280, 300),
        (280.0, 300, 300, 300),  # no window lies wholly after: the last one counts
        (299.0, 300, 300, 300),
        (12.0, 30, 30, 30),
    ],
)
def test_the_verdict_averages_the_effective_window(onset_s, flight_s, first_s, last_s):
    time_s = ENDS_S[: int(flight_s / 5) - 5]
    counted = np.flatnonzero(counted_windows(time_s, onset_s))
    assert (time_s[counted[0]], time_s[counted[-1]]) == (first_s, last_s)
    assert len(counted) == (last_s - first_s) / 5 + 1


@pytest.mark.parametrize(
    ("until_s", "first_s", "last_s"),
    [(150.0, 90, 150), (100.0, 90, 100), (80.0, 80, 80), (500.0, 90, 180)],
)
def test_the_verdict_ends_with_the_repair(until_s, first_s, last_s):
    counted = ENDS_S[counted_windows(ENDS_S, 60.0, until_s)]
    assert (counted[0], counted[-1]) == (first_s, last_s)


def test_a_repair_and_new_targets_are_kept_with_the_diagnosis(make_pair, untrained):
    """ux.md D4: an engine that was repaired was diagnosed from what came after."""
    pair = make_pair(300.0, ("E1 CHT1", 8.0, 60.0, 160.0), ("E1 EGT3", 50.0, 200.0, 300.0))
    done = (Intervention(220.0, "target", "5,000 ft"), Intervention(160.0, "repair"))
    diagnosis = untrained.diagnose(pair, interventions=done)
    assert [item.channel for item in diagnosis.evidence] == ["E1 CHT1"]
    assert diagnosis.judged_until_s == 160.0
    assert [item.time_s for item in diagnosis.interventions] == [160.0, 220.0]
    assert Diagnosis.from_dict(diagnosis.to_dict()).to_dict() == diagnosis.to_dict()
    ends = diagnosis.time_s
    counted = (ends >= 90.0) & (ends <= 160.0)
    np.testing.assert_allclose(
        diagnosis.probabilities, diagnosis.probabilities_over_time[counted].mean(axis=0), rtol=1e-5
    )


def test_a_diagnosis_of_before_is_read(make_pair, untrained):
    values = untrained.diagnose(make_pair(60.0, FAULT)).to_dict()
    del values["interventions"], values["evidence"][0]["settled_s"]
    read = Diagnosis.from_dict(values)
    assert (read.interventions, read.evidence[0].settled_s) == ((), None)


@pytest.fixture
def stored(tmp_path, untrained):
    """An untrained model on disk, as (folder, card)."""
    card = {
        "name": "cnn-paired-lab",
        "classes": list(untrained.classes),
        "conditions": "lab",
        "classifier": "cnn",
        "feature_mode": "paired",
        "normalisation": untrained.normalisation.to_dict(),
    }
    return tmp_path, save_model(tmp_path, card, untrained.network.state_dict())


def test_a_stored_model_predicts_as_before(make_pair, untrained, stored):
    folder, _ = stored
    pair = make_pair(45.0, FAULT)
    read = load_diagnoser("paired", folder)
    np.testing.assert_array_equal(
        read.diagnose(pair).probabilities_over_time,
        untrained.diagnose(pair).probabilities_over_time,
    )


@pytest.mark.parametrize("name", ["cnn-paired-lab.json", "cnn-paired-lab.safetensors"])
def test_a_missing_file_is_named(stored, name):
    folder, _ = stored
    (folder / name).unlink()
    with pytest.raises(MirrorTwinError, match=rf"{name} is missing; train it"):
        load_model(folder, "cnn-paired-lab")


def test_weights_of_another_card_are_refused(stored):
    folder, card = stored
    weights = folder / "cnn-paired-lab.safetensors"
    content = bytearray(weights.read_bytes())
    content[-1] ^= 1
    weights.write_bytes(content)
    with pytest.raises(MirrorTwinError, match="not those that its card describes"):
        load_model(folder, card["name"])


@pytest.mark.parametrize("lost", ["classes", "normalisation", "feature_mode", "classifier"])
def test_a_card_of_another_version_is_a_clear_error(stored, untrained, lost):
    folder, card = stored
    foreign = {name: value for name, value in card.items() if name != lost}
    save_model(folder, foreign, untrained.network.state_dict())
    with pytest.raises(MirrorTwinError, match=rf"cnn-paired-lab: .*{lost}.*train it again"):
        load_diagnoser("paired", folder)


def test_weights_of_another_shape_are_a_clear_error(stored, untrained):
    folder, card = stored
    save_model(folder, card | {"inputs": "states"}, untrained.network.state_dict())
    with pytest.raises(MirrorTwinError, match=r"cnn-paired-lab: .*train it again"):
        load_diagnoser("paired", folder)


def test_a_diagnoser_is_loaded_once(stored):
    folder, _ = stored
    first: Diagnoser = load_diagnoser("paired", folder)
    assert load_diagnoser("paired", folder) is first


def test_in_field_what_lasts_from_the_beginning_is_no_fault(untrained, make_pair):
    """A sensor that reads 6 degF high all along is no residual and no evidence."""
    in_field = replace(untrained, mode=feature_mode("paired", "field"), conditions="field")
    falls = ("E1 EGT2", -40.0, 60.0, 150.0)
    sound = make_pair(150.0, falls)
    high = make_pair(150.0, falls, ("E1 CHT1", 6.0, 0.0, 150.0))
    found = [in_field.stream(), in_field.stream()]
    for stream, pair in zip(found, (sound, high), strict=True):
        stream.push(pair)
        diagnosis = stream.finish()
        assert {item.channel for item in diagnosis.evidence} == {"E1 EGT2"}
        assert diagnosis.onset_s == pytest.approx(60.0, abs=5.0)
    assert [item.channel for item in untrained.diagnose(high).evidence] != ["E1 EGT2"]

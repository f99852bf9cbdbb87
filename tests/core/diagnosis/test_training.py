"""Training on a small made-up data set: it learns, stops and goes on, and writes its card."""

import json
from dataclasses import replace

import numpy as np
import pytest

from core.dataset.archive import Archive
from core.diagnosis.features import pooled
from core.diagnosis.predict import load_diagnoser
from core.diagnosis.settings import TrainingSettings
from core.diagnosis.training import train
from core.errors import InputError
from core.fmea.catalogue import class_ids
from core.model_card import load_model

pytestmark = pytest.mark.slow

SETTINGS = TrainingSettings(epochs=3, patience=3, batch=8, seed=5)


class KilledError(Exception):
    """Stands for a kill between two epochs."""


@pytest.fixture(scope="module")
def trained(dataset, tmp_path_factory):
    """(models folder, card) of an undisturbed training."""
    models = tmp_path_factory.mktemp("models")
    return models, train(dataset, models, SETTINGS, work_dir=models / "work")


def test_it_learns_and_says_so(trained):
    _, card = trained
    assert card["training"]["train_loss"][-1] < card["training"]["train_loss"][0]
    assert card["scores"]["validation_windows"]["macro_f1"] > 0.5  # chance is 0.05


def test_the_card_tells_what_was_done(dataset, trained):
    models, card = trained
    on_disk = json.loads((models / "cnn-paired-lab.json").read_text())
    assert on_disk == card == load_model(models, "cnn-paired-lab")[0]
    assert card["classes"] == list(class_ids())
    seeds = card["data"]["seeds"]
    n = len(class_ids())
    assert {part: len(found) for part, found in seeds.items()} == {
        "train": 2 * n, "validation": n, "test": n,
    }  # fmt: skip
    assert len(set().union(*map(set, seeds.values()))) == 4 * n
    test_runs = card["scores"]["test_runs"]
    assert test_runs["n"] == n
    assert np.array(test_runs["confusion"]).sum() == n
    assert card["training"]["settings"]["learning_rate"] == 5e-4


def test_normalisation_knows_only_training_runs(dataset, trained):
    _, card = trained
    sensors = np.stack([np.load(path)[0] for path in sorted((dataset / "runs").glob("*-[01].npy"))])
    assert card["normalisation"]["sensor_mean"] == pytest.approx(
        np.median(np.concatenate([pooled(each)[::5] for each in sensors]), axis=0)
    )


def test_a_killed_training_ends_with_the_same_weights(dataset, trained, tmp_path):
    _, card = trained

    def killed_after_two(epoch):
        if epoch.index == 2:
            raise KilledError

    with pytest.raises(KilledError):
        train(dataset, tmp_path, SETTINGS, work_dir=tmp_path / "w", progress=killed_after_two)
    assert not list(tmp_path.glob("*.json"))
    resumed = []
    again = train(dataset, tmp_path, SETTINGS, work_dir=tmp_path / "w", progress=resumed.append)
    assert [epoch.index for epoch in resumed] == [3]
    assert again["weights_sha256"] == card["weights_sha256"]
    assert again["scores"] == card["scores"]


def test_a_checkpoint_of_other_settings_is_not_used(dataset, trained):
    models, _ = trained
    epochs = []
    other = replace(SETTINGS, epochs=1, seed=6)
    train(dataset, models / "other", other, work_dir=models / "work", progress=epochs.append)
    assert [epoch.index for epoch in epochs] == [1]


def test_the_model_it_wrote_diagnoses(trained, make_pair):
    models, _ = trained
    diagnoser = load_diagnoser("paired", models)
    diagnosis = diagnoser.diagnose(make_pair(40.0, seed=999))
    assert diagnosis.classes == class_ids()
    assert diagnosis.model == "cnn-paired-lab"


@pytest.mark.parametrize(
    ("field", "value"), [("classifier", "oracle"), ("feature_mode", "x"), ("epochs", 0)]
)
def test_bad_settings_name_their_field(field, value):
    with pytest.raises(InputError, match=field):
        TrainingSettings(**{field: value})


def test_an_unfinished_data_set_is_refused(tmp_path):
    Archive.open(tmp_path, {})
    with pytest.raises(InputError, match="holds no complete data set"):
        train(tmp_path, tmp_path)

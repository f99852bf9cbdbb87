"""The cards beside the shipped weights agree with themselves: no number was typed by hand."""

import numpy as np
import pytest

from core.diagnosis.predict import load_diagnoser
from core.diagnosis.settings import CHOSEN_INPUTS
from core.fmea.catalogue import class_ids
from core.model_card import load_model
from core.paths import MODELS
from core.residual.surrogate_training import CHOSEN_HORIZON

PARTS = ("validation_windows", "test_windows", "test_runs")


@pytest.fixture(scope="module", params=["paired", "surrogate"])
def residual(request):
    """Each of the two residuals that the product offers."""
    return request.param


@pytest.fixture(scope="module", params=["lab", "field"])
def conditions(request):
    """Each of the conditions that it is trained for."""
    return request.param


@pytest.fixture(scope="module")
def shipped_card(residual, conditions):
    """The card of that classifier."""
    return load_model(MODELS, f"cnn-{residual}-{conditions}")[0]


def test_it_loads_for_the_catalogue_of_today(residual, conditions):
    diagnoser = load_diagnoser(residual, conditions=conditions)
    assert diagnoser.classes == class_ids()
    assert diagnoser.name == f"cnn-{residual}-{conditions}"
    assert diagnoser.conditions == conditions
    assert diagnoser.calibration.temperature > 0.0
    assert np.isfinite(diagnoser.calibration.threshold)


def test_it_sees_what_was_chosen_on_validation(residual, conditions):
    diagnoser = load_diagnoser(residual, conditions=conditions)
    assert diagnoser.inputs == CHOSEN_INPUTS.get((residual, conditions), "both")
    assert diagnoser.normalisation.contrast == diagnoser.mode.contrast


def test_no_seed_is_shared_between_the_parts(shipped_card):
    seeds = shipped_card["data"]["seeds"]
    everything = [seed for part in seeds.values() for seed in part]
    assert len(everything) == len(set(everything))
    assert (
        len(everything) == len(class_ids()) * shipped_card["data"]["spec"]["runs_per_class"] >= 800
    )
    assert len(seeds["test"]) == pytest.approx(0.3 * len(everything))


def test_scores_follow_from_the_confusion_matrices(shipped_card):
    for part in PARTS:
        _follows(shipped_card["scores"][part], shipped_card["classes"])


def _follows(scores, classes):
    confusion = np.array(scores["confusion"], dtype=float)
    right = np.diag(confusion)
    f1 = 2 * right / (confusion.sum(axis=0) + confusion.sum(axis=1))
    assert confusion.sum() == scores["n"]
    assert scores["accuracy"] == pytest.approx(right.sum() / scores["n"])
    assert list(scores["per_class_f1"]) == classes
    assert list(scores["per_class_f1"].values()) == pytest.approx(f1)
    assert scores["macro_f1"] == pytest.approx(f1.mean())


def test_every_test_run_was_scored_once(shipped_card):
    confusion = np.array(shipped_card["scores"]["test_runs"]["confusion"])
    n_test = len(shipped_card["data"]["seeds"]["test"])
    assert confusion.sum(axis=1).tolist() == [n_test / 20] * 20


def test_the_card_carries_the_course_of_training(shipped_card):
    training = shipped_card["training"]
    f1 = training["validation_macro_f1"]
    assert len(f1) == len(training["train_loss"]) == training["epochs_run"]
    assert f1[training["best_epoch"] - 1] == max(f1)


def test_calibration_was_measured_on_test_windows(shipped_card):
    error = shipped_card["scores"]["test_windows"]["calibration"]["expected_calibration_error"]
    assert 0.0 <= error["after"] < 0.1
    assert error["before"] >= 0.0


def test_the_mistakes_are_those_of_the_confusion_matrix(shipped_card):
    scores = shipped_card["scores"]["test_windows"]
    confusion = np.array(scores["confusion"])
    counted = np.zeros_like(confusion)
    classes = shipped_card["classes"]
    for mistake in scores["mistakes"]:
        place = classes.index(mistake["true"]), classes.index(mistake["predicted"])
        counted[place] += mistake["windows"]
        assert mistake["seed"] in shipped_card["data"]["seeds"]["test"]
    np.testing.assert_array_equal(counted, confusion - np.diag(np.diag(confusion)))


def test_the_surrogate_has_its_own_healthy_flights(shipped_card, conditions):
    card, _ = load_model(MODELS, f"gru-{conditions}")
    assert card["horizon"] == CHOSEN_HORIZON[conditions]
    learnt = set().union(*map(set, shipped_card["data"]["seeds"].values()))
    for first, last in card["data"]["seeds"].values():
        assert learnt.isdisjoint(range(first, last + 1))

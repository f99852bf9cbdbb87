"""The card beside the shipped weights agrees with itself: nothing on it was typed by hand."""

import numpy as np
import pytest

from core.diagnosis.predict import load_diagnoser
from core.fmea.catalogue import class_ids

PARTS = ("validation_windows", "test_windows", "test_runs")


def test_it_loads_for_the_catalogue_of_today():
    diagnoser = load_diagnoser()
    assert diagnoser.classes == class_ids()
    assert (diagnoser.name, diagnoser.conditions) == ("cnn-paired-lab", "lab")


def test_no_seed_is_shared_between_the_parts(shipped_card):
    seeds = shipped_card["data"]["seeds"]
    everything = [seed for part in seeds.values() for seed in part]
    assert len(everything) == len(set(everything))
    assert len(everything) == 20 * shipped_card["data"]["spec"]["runs_per_class"] >= 800
    assert len(seeds["test"]) == pytest.approx(0.3 * len(everything))


@pytest.mark.parametrize("part", PARTS)
def test_scores_follow_from_the_confusion_matrix(shipped_card, part):
    scores = shipped_card["scores"][part]
    confusion = np.array(scores["confusion"], dtype=float)
    right = np.diag(confusion)
    f1 = 2 * right / (confusion.sum(axis=0) + confusion.sum(axis=1))
    assert confusion.sum() == scores["n"]
    assert scores["accuracy"] == pytest.approx(right.sum() / scores["n"])
    assert list(scores["per_class_f1"]) == shipped_card["classes"]
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

"""The shipped classifier on flights that it has never seen: the product's main promise."""

import numpy as np
import pytest

from core.diagnosis.predict import load_diagnoser
from core.fmea.catalogue import class_ids
from core.fmea.fault import Fault
from core.paths import MODELS
from core.twin.flight import fly_pair
from core.twin.plan import Plan

pytestmark = pytest.mark.slow

SEVERITY = 0.8
ONSET_S = 60.0
FIRST_SEED = 7_000_000


@pytest.fixture(scope="module")
def diagnosed():
    """The diagnosis of one fresh flight a class, each on its own seed, in class order."""
    diagnoser = load_diagnoser()
    return {
        mode: diagnoser.diagnose(
            fly_pair(Plan.sampled(FIRST_SEED + number), Fault(mode, SEVERITY, ONSET_S))
        )
        for number, mode in enumerate(class_ids())
    }


def test_the_seeds_are_in_no_part_of_the_data_set(shipped_card):
    learnt = set().union(*map(set, shipped_card["data"]["seeds"].values()))
    assert learnt.isdisjoint(range(FIRST_SEED, FIRST_SEED + len(class_ids())))


def test_all_but_three_classes_at_most_are_named_first(diagnosed):
    confused = {mode: found.ranked(2) for mode, found in diagnosed.items() if found.top != mode}
    assert tuple(diagnosed) == class_ids()
    assert len(confused) <= 3, confused


def test_before_the_onset_every_window_is_nominal(diagnosed):
    for mode, found in diagnosed.items():
        before = found.probabilities_over_time[found.time_s < ONSET_S + 0.01]
        assert len(before) == 7
        assert (before.argmax(axis=1) == found.classes.index("nominal")).all(), mode


def test_a_strong_fault_is_called_a_fault_within_20_s(diagnosed):
    for mode in ("engine_failure", "engine_overspeed", "oil_cooler_maintenance"):
        found = diagnosed[mode]
        soon = np.flatnonzero(found.time_s >= ONSET_S + 20.0)[0]
        assert found.classes[int(found.probabilities_over_time[soon].argmax())] == mode


def test_the_onset_is_found_from_the_residual_alone(diagnosed):
    assert diagnosed["nominal"].onset_s is None
    assert diagnosed["engine_failure"].onset_s == pytest.approx(ONSET_S, abs=0.5)


def test_the_models_folder_stays_small():
    assert sum(path.stat().st_size for path in MODELS.rglob("*") if path.is_file()) < 40e6

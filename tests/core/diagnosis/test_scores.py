"""Scores against numbers worked out by hand."""

import numpy as np
import pytest

from core.diagnosis.scores import macro_f1, scores

TRUTH = np.array([0, 0, 0, 0, 1, 1, 2, 2])
FOUND = np.array([0, 0, 0, 1, 1, 1, 0, 0])


def test_scores_by_hand():
    found = scores(TRUTH, FOUND, ("a", "b", "c"))
    assert found["n"] == 8
    assert found["accuracy"] == 5 / 8
    assert found["confusion"] == [[3, 1, 0], [0, 2, 0], [2, 0, 0]]
    # a: precision 3/5, recall 3/4; b: 2/3 and 1; c: never found.
    assert found["per_class_f1"] == pytest.approx({"a": 2 / 3, "b": 0.8, "c": 0.0})
    assert found["macro_f1"] == pytest.approx((2 / 3 + 0.8) / 3)
    assert found["macro_precision"] == pytest.approx((3 / 5 + 2 / 3) / 3)
    assert found["macro_recall"] == pytest.approx((3 / 4 + 1) / 3)
    assert found["confused"] == ["c taken for a: 2", "a taken for b: 1"]


def test_macro_f1_counts_a_class_that_never_occurs():
    assert macro_f1(TRUTH, TRUTH, 3) == 1.0
    assert macro_f1(TRUTH, TRUTH, 4) == 0.75

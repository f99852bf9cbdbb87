"""How good a classifier is: accuracy, macro scores, per-class F1, confusions."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.metrics import accuracy_score, confusion_matrix, precision_recall_fscore_support

Labels = NDArray[np.int64]


def macro_f1(truth: Labels, found: Labels, n_classes: int) -> float:
    """Unweighted mean of the classes' F1; 0 for a class that is never right."""
    _, _, f1, _ = precision_recall_fscore_support(
        truth, found, labels=range(n_classes), zero_division=0.0
    )
    return float(np.mean(f1))


def scores(truth: Labels, found: Labels, classes: tuple[str, ...]) -> dict[str, Any]:
    """All scores of Tables 1 and 2 as JSON-ready values.

    ``truth``, ``found``: (n,) class numbers. Rows of ``confusion`` are the true classes;
    ``confused`` names its largest off-diagonal entries.
    """
    labels = range(len(classes))
    precision, recall, f1, _ = precision_recall_fscore_support(
        truth, found, labels=labels, zero_division=0.0
    )
    confusion = confusion_matrix(truth, found, labels=labels)
    return {
        "n": len(truth),
        "accuracy": float(accuracy_score(truth, found)),
        "macro_precision": float(np.mean(precision)),
        "macro_recall": float(np.mean(recall)),
        "macro_f1": float(np.mean(f1)),
        "per_class_f1": dict(zip(classes, map(float, f1), strict=True)),
        "confusion": confusion.tolist(),
        "confused": _confused(confusion, classes),
    }


def _confused(confusion: NDArray[np.int64], classes: tuple[str, ...]) -> list[str]:
    """The ten most frequent mistakes in words, most frequent first."""
    mistakes = confusion - np.diag(np.diag(confusion))
    order = np.argsort(-mistakes, axis=None, kind="stable")[:10]
    return [
        f"{classes[true]} taken for {classes[taken]}: {mistakes[true, taken]}"
        for true, taken in zip(*np.unravel_index(order, mistakes.shape), strict=True)
        if mistakes[true, taken]
    ]

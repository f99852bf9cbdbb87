"""The two classical classifiers: they read statistics of a window, not its course."""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax
from sklearn.ensemble import RandomForestClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC

from core.diagnosis.features import POOLED_A_SECOND
from core.diagnosis.scores import Labels

STATISTICS = ("mean", "standard deviation", "least", "greatest", "first second", "last second")
"""Of each channel over the window; differences of the last two tell which way it went."""

FLOOR = 1e-6


class Estimator(Protocol):
    """What is used of a scikit-learn classifier."""

    def fit(self, features: NDArray[np.float32], labels: Labels) -> Any:
        """Learn from (n, k) statistics and (n,) class numbers."""

    def predict_proba(self, features: NDArray[np.float32]) -> NDArray[np.float64]:
        """(n, classes) shares."""


def statistics(windows: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, features, steps) windows -> (n, features x `STATISTICS`)."""
    found = (
        windows.mean(axis=2),
        windows.std(axis=2),
        windows.min(axis=2),
        windows.max(axis=2),
        windows[:, :, :POOLED_A_SECOND].mean(axis=2),
        windows[:, :, -POOLED_A_SECOND:].mean(axis=2),
    )
    return np.concatenate(found, axis=1)


class _Svm:
    """A support vector machine whose one-against-rest margins serve as logits."""

    def __init__(self, seed: int) -> None:
        self._machine = make_pipeline(
            StandardScaler(), SVC(C=10.0, kernel="rbf", gamma="scale", random_state=seed)
        )

    def fit(self, features: NDArray[np.float32], labels: Labels) -> "_Svm":
        self._machine.fit(features, labels)
        return self

    def predict_proba(self, features: NDArray[np.float32]) -> NDArray[np.float64]:
        shares: NDArray[np.float64] = softmax(self._machine.decision_function(features), axis=1)
        return shares


def _forest(seed: int, threads: int) -> Estimator:
    forest: Estimator = RandomForestClassifier(
        n_estimators=400, min_samples_leaf=1, random_state=seed, n_jobs=threads
    )
    return forest


STATISTICAL: dict[str, Callable[[int, int], Estimator]] = {
    "svm": lambda seed, threads: _Svm(seed),
    "rf": _forest,
}
"""Each is built from a seed and a number of threads."""


def logits(estimator: Estimator, windows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Logarithms of the classes' shares, (n, classes), for (n, features, steps) windows."""
    shares = estimator.predict_proba(statistics(windows))
    return np.log(np.maximum(shares, FLOOR)).astype(np.float32)

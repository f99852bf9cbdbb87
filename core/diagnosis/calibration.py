"""Probabilities that mean what they say, and a score for what was never learnt.

A temperature, fitted on validation windows, divides the logits (Guo et al., 2017); it changes no
verdict, only how sure it sounds. The energy -log(sum(exp(logits))) is high where no class speaks up
(Liu et al., 2020): above the level that healthy validation leaves behind, the answer is "none of
these".
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.special import log_softmax, logsumexp, softmax

from core.diagnosis.scores import Labels

Logits = NDArray[np.float32]

BINS = 15
REFUSED_SHARE = 0.01
"""The share of known validation windows that the threshold would refuse."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """``temperature`` divides logits; an energy above ``threshold`` means none of these."""

    temperature: float = 1.0
    threshold: float = np.inf

    @classmethod
    def fitted(cls, logits: Logits, truth: Labels) -> "Calibration":
        """From validation windows: logits (n, c), class numbers (n,)."""
        temperature = _temperature(logits, truth)
        energies = energy(logits / temperature)
        return cls(temperature, float(np.quantile(energies, 1.0 - REFUSED_SHARE)))

    def probabilities(self, logits: Logits) -> NDArray[np.float32]:
        """(..., c) probabilities."""
        shares: NDArray[np.float32] = softmax(logits / self.temperature, axis=-1)
        return shares.astype(np.float32)

    def energy(self, logits: Logits) -> NDArray[np.float64]:
        """(...,) energies, comparable with the threshold."""
        return energy(logits / self.temperature)

    def report(self, logits: Logits, truth: Labels) -> dict[str, Any]:
        """How well calibrated, before and after, and how many are refused, for a card."""
        return {
            "temperature": self.temperature,
            "expected_calibration_error": {
                "before": calibration_error(softmax(logits, axis=-1), truth),
                "after": calibration_error(self.probabilities(logits), truth),
                "bins": BINS,
            },
            "energy_threshold": self.threshold,
            "refused_share": float(np.mean(self.energy(logits) > self.threshold)),
        }


def energy(logits: NDArray[Any]) -> NDArray[np.float64]:
    """-log(sum(exp(logits))) over the last axis."""
    return -np.asarray(logsumexp(np.asarray(logits, dtype=np.float64), axis=-1))


def calibration_error(probabilities: NDArray[Any], truth: Labels) -> float:
    """Expected calibration error: |confidence - accuracy| in equal bins, weighted by their share.

    ``probabilities``: (n, c), ``truth``: (n,).
    """
    confidence = probabilities.max(axis=1)
    right = probabilities.argmax(axis=1) == truth
    bins = np.minimum((confidence * BINS).astype(int), BINS - 1)
    count = np.bincount(bins, minlength=BINS)
    gap = np.bincount(bins, confidence, BINS) - np.bincount(bins, right, BINS)
    return float(np.abs(gap).sum() / count.sum())


def _temperature(logits: Logits, truth: Labels) -> float:
    """The temperature of least cross entropy, within 0.05 to 20."""

    def cross_entropy(log_temperature: float) -> float:
        shares = log_softmax(logits / np.exp(log_temperature), axis=1)
        return float(-shares[np.arange(len(truth)), truth].mean())

    found = minimize_scalar(cross_entropy, bounds=(np.log(0.05), np.log(20.0)), method="bounded")
    return float(np.exp(found.x))

"""The classifiers that can be trained: the one list of them, free of PyTorch and scikit-learn.

What builds each stands in `core.diagnosis.networks` or `core.diagnosis.statistical`, which is
checked where both are loaded (`core.diagnosis.settings`).
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Classifier:
    """One kind of classifier, titled as in the paper's Table 2.

    ``cost_rank``: its place among the others by the time that training takes, cheapest first.
    ``keeps_weights``: whether a trained one is kept; of the others only the card is.
    """

    id: str
    title: str
    cost_rank: int
    keeps_weights: bool = True


CLASSIFIERS: Mapping[str, Classifier] = {
    each.id: each
    for each in (
        Classifier("cnn", "1D-CNN", 3),
        Classifier("lstm", "LSTM", 5),
        Classifier("resnet", "ResNet", 4),
        Classifier("transformer", "Transformer", 6),
        Classifier("svm", "SVM", 1, keeps_weights=False),
        Classifier("rf", "RF", 2, keeps_weights=False),
    )
}


def cheapest_first() -> tuple[str, ...]:
    """The ids by the time that training takes."""
    return tuple(sorted(CLASSIFIERS, key=lambda name: CLASSIFIERS[name].cost_rank))

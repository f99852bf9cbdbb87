"""How a classifier is trained, and how far it has come."""

from dataclasses import dataclass

from core.checks import checked_number
from core.diagnosis.classifiers import CLASSIFIERS
from core.diagnosis.features import FEATURE_MODES, FEATURE_ROWS, Inputs
from core.diagnosis.networks import NETWORKS
from core.diagnosis.statistical import STATISTICAL
from core.errors import InputError
from core.twin.plan import Conditions

for _each in CLASSIFIERS.values():
    assert _each.id in (NETWORKS if _each.keeps_weights else STATISTICAL), _each.id
assert len(CLASSIFIERS) == len(NETWORKS) + len(STATISTICAL)


CHOSEN_INPUTS: dict[tuple[str, Conditions], Inputs] = {("paired", "field"): "residuals"}
"""The half of the 46 channels that a shipped model sees, where it is not its feature mode's own.

In field no two aircraft and no two days read alike, so that sensors tell the flights of the
training set apart better than their faults: on validation flights the classifier does better
without them (``models/results/table3-field.json``).
"""


@dataclass(frozen=True, slots=True)
class TrainingSettings:
    """How to train; the defaults are those of the shipped model.

    Optimiser, rate, decay, scheduler and early stopping on macro-F1 after 40 epochs without a
    better one are the paper's; the most epochs are ours, and a CNN has settled long before.
    ``inputs`` is the half of the 46 channels that is shown, by default the feature mode's own.

    ``bfloat16`` lets a network multiply in bfloat16 while it learns (weights and sums stay
    float32): up to twice as fast where the processor has it. Predictions are always float32.
    ``draws`` is how many epochs' worth of windows the classical classifiers learn from.
    ``shuffled`` deals the labels of the training runs out at random: a control that has to fail.
    """

    classifier: str = "cnn"
    feature_mode: str = "paired"
    inputs: Inputs | None = None
    seed: int = 0
    epochs: int = 120
    patience: int = 40
    batch: int = 32
    learning_rate: float = 5e-4
    weight_decay: float = 1e-4
    plateau_factor: float = 0.5
    plateau_patience: int = 6
    threads: int = 1
    bfloat16: bool = True
    draws: int = 6
    shuffled: bool = False

    def __post_init__(self) -> None:
        """Raise `InputError` for an unknown name or a number out of range."""
        for field, value, known in (
            ("classifier", self.classifier, CLASSIFIERS),
            ("feature_mode", self.feature_mode, FEATURE_MODES),
            ("inputs", self.inputs or "both", FEATURE_ROWS),
        ):
            if value not in known:
                raise InputError(field, f"unknown {value!r}; one of {', '.join(known)}")
        checked_number("epochs", self.epochs, 1, 10_000)
        checked_number("patience", self.patience, 1, 10_000)
        checked_number("batch", self.batch, 2, 4096)
        checked_number("threads", self.threads, 1, 256)
        checked_number("draws", self.draws, 1, 1000)

    @property
    def shown(self) -> Inputs:
        """The half of the 46 channels that the classifier sees."""
        return self.inputs or FEATURE_MODES[self.feature_mode].inputs


@dataclass(frozen=True, slots=True)
class Epoch:
    """What one pass over the training windows came to; ``index`` counts from 1."""

    index: int
    of: int
    train_loss: float
    validation_macro_f1: float
    best_macro_f1: float
    learning_rate: float
    seconds: float

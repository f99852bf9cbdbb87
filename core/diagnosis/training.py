"""Training of a classifier, resumable, and the card that comes of it (paper section 5.1)."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from core.diagnosis.card import Card, save_model
from core.diagnosis.corpus import Corpus
from core.diagnosis.features import FEATURE_MODES, N_FEATURES, Normalisation
from core.diagnosis.networks import CLASSIFIERS
from core.diagnosis.predict import Diagnoser
from core.diagnosis.scores import Labels, macro_f1, scores
from core.errors import InputError
from core.experiments.archive import Manifest, read_manifest
from core.experiments.provenance import provenance
from core.fmea.catalogue import class_ids
from core.paths import MODELS
from core.twin.plan import checked_number


@dataclass(frozen=True, slots=True)
class TrainingSettings:
    """How to train; the defaults are those of the shipped model.

    Optimiser, rate, decay, scheduler and early stopping on macro-F1 are the paper's, but for the
    patience: 15 epochs instead of 40, which on two cores keeps training under half an hour.

    ``bfloat16`` lets the network multiply in bfloat16 while it learns (weights and sums stay
    float32): 2.5 times faster where the processor has it. Predictions are always float32.
    """

    classifier: str = "cnn"
    feature_mode: str = "paired"
    seed: int = 0
    epochs: int = 60
    patience: int = 15
    batch: int = 32
    learning_rate: float = 5e-4
    weight_decay: float = 1e-4
    plateau_factor: float = 0.5
    plateau_patience: int = 6
    threads: int = 1
    bfloat16: bool = True

    def __post_init__(self) -> None:
        """Raise `InputError` for an unknown name or a number out of range."""
        for field, value, known in (
            ("classifier", self.classifier, CLASSIFIERS),
            ("feature_mode", self.feature_mode, FEATURE_MODES),
        ):
            if value not in known:
                raise InputError(field, f"unknown {value!r}; one of {', '.join(known)}")
        checked_number("epochs", self.epochs, 1, 10_000)
        checked_number("patience", self.patience, 1, 10_000)
        checked_number("batch", self.batch, 2, 4096)
        checked_number("threads", self.threads, 1, 256)


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


def train(
    dataset_dir: Path,
    models_dir: Path = MODELS,
    settings: TrainingSettings | None = None,
    *,
    work_dir: Path | None = None,
    progress: Callable[[Epoch], None] | None = None,
) -> Card:
    """Train a classifier on a data set, score it on the test split once, and save it.

    A checkpoint is kept in ``work_dir`` (default ``dataset_dir/training``) after every epoch;
    called again with the same settings and data, training goes on where it stopped and ends with
    the same weights. Returns the card saved in ``models_dir``. Raises `InputError` if the data set
    is incomplete or of other classes.
    """
    settings = settings or TrainingSettings()
    manifest = read_manifest(dataset_dir)
    classes = class_ids()
    if {run.mode for run in manifest.runs} != set(classes):
        raise InputError("data", f"{dataset_dir} was flown for other classes than the catalogue's")
    torch.set_num_threads(settings.threads)
    torch.use_deterministic_algorithms(True)
    mode = FEATURE_MODES[settings.feature_mode]
    learnt = Corpus(dataset_dir, manifest.part("train"), classes, mode)
    normalisation = Normalisation.fitted(learnt.flights())
    trainer = Trainer(
        settings,
        learnt,
        Corpus(dataset_dir, manifest.part("validation"), classes, mode),
        normalisation,
    )
    trainer.resume((work_dir or dataset_dir / "training") / "checkpoint.pt", manifest)
    trainer.run(progress or (lambda epoch: None))
    card: Card = {
        "name": f"{settings.classifier}-{settings.feature_mode}-{manifest.spec['conditions']}",
        "title": mode.title,
        "conditions": manifest.spec["conditions"],
        "feature_mode": settings.feature_mode,
        "classifier": settings.classifier,
        "classes": list(classes),
        "scores": {"validation_windows": trainer.validation_scores()},
        "training": trainer.summary(),
        "data": _data(manifest),
        "code": provenance(),
        "architecture": str(trainer.network).splitlines(),
        "normalisation": normalisation.to_dict(),
    }
    test = Corpus(dataset_dir, manifest.part("test"), classes, mode)
    card["scores"]["test_windows"] = scores(test.truth(), trainer.classified(test), classes)
    card["scores"]["test_runs"] = test.whole_run_scores(
        Diagnoser.from_card(card, trainer.best_weights)
    )
    return save_model(models_dir, card, trainer.best_weights)


def _data(manifest: Manifest) -> dict[str, Any]:
    """What the card says of the data: how it was flown, and the seeds of every part."""
    return {
        "spec": manifest.spec,
        "code": manifest.provenance,
        "seeds": {
            part: sorted(run.plan["seed"] for run in manifest.part(part))
            for part in ("train", "validation", "test")
        },
    }


class Trainer:
    """Fits one network to a corpus and keeps the weights that validate best."""

    def __init__(
        self,
        settings: TrainingSettings,
        learnt: Corpus,
        validation: Corpus,
        normalisation: Normalisation,
    ) -> None:
        """Start untrained; `resume` may put an earlier state in its place."""
        self.settings = settings
        self._learnt = learnt
        self._validation = validation
        self._normalisation = normalisation
        torch.manual_seed(settings.seed)
        self.network = CLASSIFIERS[settings.classifier](N_FEATURES, len(learnt.classes))
        self._optimiser = torch.optim.Adam(
            self.network.parameters(),
            lr=settings.learning_rate,
            weight_decay=settings.weight_decay,
        )
        self._scheduler = torch.optim.lr_scheduler.ReduceLROnPlateau(
            self._optimiser,
            mode="max",
            factor=settings.plateau_factor,
            patience=settings.plateau_patience,
        )
        self.best_weights: dict[str, Tensor] = {}
        self._history: list[dict[str, Any]] = []
        self._checkpoint: Path | None = None
        self._identity: dict[str, Any] = {}

    # Running

    def run(self, progress: Callable[[Epoch], None]) -> None:
        """Train until the epochs are used up or validation has not improved for ``patience``."""
        while not self._finished():
            epoch = self._one_epoch()
            self._save()
            progress(epoch)
        self.network.load_state_dict(self.best_weights)

    def _finished(self) -> bool:
        done = len(self._history)
        return done >= self.settings.epochs or done - self._best_index() > self.settings.patience

    def _best_index(self) -> int:
        """The epoch, from 1, with the best validation score; 0 before any."""
        f1 = [epoch["validation_macro_f1"] for epoch in self._history]
        return f1.index(max(f1)) + 1 if f1 else 0

    def _one_epoch(self) -> Epoch:
        started = time.perf_counter()
        index = len(self._history) + 1
        learning_rate = float(self._optimiser.param_groups[0]["lr"])
        train_loss = self._learn(index)
        with self._precision():
            found = self.classified(self._validation)
        f1 = macro_f1(self._validation.truth(), found, len(self._validation.classes))
        best = max((epoch["validation_macro_f1"] for epoch in self._history), default=-1.0)
        if f1 > best:
            self.best_weights = {
                name: tensor.detach().clone() for name, tensor in self.network.state_dict().items()
            }
        self._scheduler.step(f1)
        epoch = Epoch(
            index=index,
            of=self.settings.epochs,
            train_loss=train_loss,
            validation_macro_f1=f1,
            best_macro_f1=max(f1, best),
            learning_rate=learning_rate,
            seconds=time.perf_counter() - started,
        )
        self._history.append(asdict(epoch))
        return epoch

    def _learn(self, index: int) -> float:
        """One pass over freshly drawn windows; the mean loss."""
        self.network.train()
        rng = np.random.default_rng([self.settings.seed, index])
        total, count = 0.0, 0
        batches = self._learnt.training_batches(self._normalisation, self.settings.batch, rng)
        for features, labels in batches:
            with self._precision():
                logits = self.network(torch.from_numpy(features))
            loss = nn.functional.cross_entropy(logits.float(), torch.from_numpy(labels))
            self._optimiser.zero_grad()
            loss.backward()
            self._optimiser.step()
            total += float(loss.detach()) * len(labels)
            count += len(labels)
        return total / count

    def _precision(self) -> torch.autocast:
        return torch.autocast("cpu", torch.bfloat16, enabled=self.settings.bfloat16)

    def classified(self, corpus: Corpus) -> Labels:
        """The class number found for each scored window of a corpus, (n,)."""
        self.network.eval()
        with torch.inference_mode():
            found = [
                self.network(torch.from_numpy(features)).argmax(dim=1).numpy()
                for features in corpus.scored_batches(self._normalisation, self.settings.batch)
            ]
        return np.concatenate(found)

    def validation_scores(self) -> dict[str, Any]:
        """Scores of the present weights on the validation windows."""
        found = self.classified(self._validation)
        return scores(self._validation.truth(), found, self._validation.classes)

    def summary(self) -> dict[str, Any]:
        """Settings and course of the training, for the card."""
        return {
            "settings": asdict(self.settings),
            "loss": "cross entropy",
            "optimiser": "Adam",
            "scheduler": "ReduceLROnPlateau on validation macro-F1",
            "epochs_run": len(self._history),
            "best_epoch": self._best_index(),
            "seconds": round(sum(epoch["seconds"] for epoch in self._history), 1),
            "train_loss": [round(epoch["train_loss"], 5) for epoch in self._history],
            "validation_macro_f1": [
                round(epoch["validation_macro_f1"], 5) for epoch in self._history
            ],
        }

    # Stopping and going on

    def resume(self, checkpoint: Path, manifest: Manifest) -> None:
        """Keep checkpoints at that path, and go on from the one there if it is of this training."""
        self._checkpoint = checkpoint
        self._identity = {
            "settings": asdict(self.settings),
            "runs": [run.sha256 for run in manifest.runs],
        }
        if not checkpoint.exists():
            return
        state = torch.load(checkpoint, weights_only=True)
        if state["identity"] != self._identity:
            return
        self.network.load_state_dict(state["network"])
        self._optimiser.load_state_dict(state["optimiser"])
        self._scheduler.load_state_dict(state["scheduler"])
        self.best_weights = state["best_weights"]
        self._history = state["history"]
        torch.set_rng_state(state["rng"])

    def _save(self) -> None:
        if self._checkpoint is None:
            return
        self._checkpoint.parent.mkdir(parents=True, exist_ok=True)
        partial = self._checkpoint.with_suffix(".partial")
        torch.save(
            {
                "identity": self._identity,
                "network": self.network.state_dict(),
                "optimiser": self._optimiser.state_dict(),
                "scheduler": self._scheduler.state_dict(),
                "best_weights": self.best_weights,
                "history": self._history,
                "rng": torch.get_rng_state(),
            },
            partial,
        )
        partial.replace(self._checkpoint)

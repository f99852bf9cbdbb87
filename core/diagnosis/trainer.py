"""Fitting one classifier to a corpus: networks epoch by epoch, the classical ones at once."""

import hashlib
import json
import platform
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from core.checkpoint import read_checkpoint, write_checkpoint
from core.dataset.archive import Manifest
from core.diagnosis.calibration import Logits
from core.diagnosis.corpus import Corpus
from core.diagnosis.features import Normalisation, feature_mode, n_features
from core.diagnosis.networks import NETWORKS
from core.diagnosis.scores import macro_f1
from core.diagnosis.settings import Epoch, TrainingSettings
from core.diagnosis.statistical import STATISTICAL, STATISTICS, logits, statistics


class Fit(Protocol):
    """What training needs of any classifier, neural or not."""

    def resume(self, checkpoint: Path, identity: str) -> None:
        """Keep checkpoints at that path; go on from the one there if it is of this training."""

    def run(self, progress: Callable[[Epoch], None]) -> None:
        """Learn until done."""

    def logits(self, corpus: Corpus) -> Logits:
        """Logits of each scored window of a corpus, (n, classes)."""

    def summary(self) -> dict[str, Any]:
        """Settings and course of the training, for the card."""

    @property
    def architecture(self) -> list[str]:
        """What was fitted, in lines."""

    @property
    def weights(self) -> dict[str, Tensor] | None:
        """What a network has learnt; None for the classical classifiers, which are not kept."""


def fit_for(
    settings: TrainingSettings, learnt: Corpus, validation: Corpus, normalisation: Normalisation
) -> Fit:
    """The trainer that the settings ask for, untrained."""
    kind = NetworkFit if settings.classifier in NETWORKS else StatisticalFit
    return kind(settings, learnt, validation, normalisation)


def identity_of(settings: TrainingSettings, manifest: Manifest, surrogate: str) -> str:
    """A digest of what makes a training this one: settings, features, data, surrogate."""
    mode = feature_mode(settings.feature_mode, manifest.spec["conditions"])
    parts = [asdict(settings), mode.identity(), [run.sha256 for run in manifest.runs], surrogate]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]


def device() -> torch.device:
    """The GPU where there is one."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def device_name() -> str:
    """What computes, in words."""
    if torch.cuda.is_available():
        return torch.cuda.get_device_name()
    return f"CPU, {platform.machine()}, {torch.get_num_threads()} thread(s)"


class NetworkFit:
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
        self._device = device()
        torch.manual_seed(settings.seed)
        network = NETWORKS[settings.classifier](n_features(learnt.shown), len(learnt.classes))
        self.network: nn.Module = network.to(self._device)
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
        self._best: dict[str, Tensor] = {}
        self._history: list[dict[str, Any]] = []
        self._checkpoint: Path | None = None
        self._identity = ""

    # Running

    def run(self, progress: Callable[[Epoch], None]) -> None:
        """Train until the epochs are used up or validation has not improved for ``patience``."""
        while not self._finished():
            epoch = self._one_epoch()
            self._save()
            progress(epoch)
        self.network.load_state_dict(self._best)

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
            found = self.logits(self._validation).argmax(axis=1)
        f1 = macro_f1(self._validation.truth(), found, len(self._validation.classes))
        best = max((epoch["validation_macro_f1"] for epoch in self._history), default=-1.0)
        if f1 > best:
            self._best = {
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
                found = self.network(torch.from_numpy(features).to(self._device))
            truth = torch.from_numpy(labels).to(self._device)
            loss = nn.functional.cross_entropy(found.float(), truth)
            self._optimiser.zero_grad()
            loss.backward()
            self._optimiser.step()
            total += float(loss.detach()) * len(labels)
            count += len(labels)
        return total / count

    def _precision(self) -> torch.autocast:
        return torch.autocast(self._device.type, torch.bfloat16, enabled=self.settings.bfloat16)

    def logits(self, corpus: Corpus) -> Logits:
        """Logits of each scored window of a corpus, (n, classes)."""
        self.network.eval()
        with torch.inference_mode():
            found = [
                self.network(torch.from_numpy(features).to(self._device)).float().cpu().numpy()
                for features in corpus.scored_batches(self._normalisation, self.settings.batch)
            ]
        return np.concatenate(found)

    # Telling

    @property
    def architecture(self) -> list[str]:
        """The network, layer by layer."""
        return str(self.network).splitlines()

    @property
    def weights(self) -> dict[str, Tensor]:
        """The weights that validated best."""
        return {name: tensor.cpu() for name, tensor in self._best.items()}

    def summary(self) -> dict[str, Any]:
        """Settings and course of the training, for the card."""
        return {
            "settings": asdict(self.settings),
            "loss": "cross entropy",
            "optimiser": "Adam",
            "scheduler": "ReduceLROnPlateau on validation macro-F1",
            "device": device_name(),
            "epochs_run": len(self._history),
            "best_epoch": self._best_index(),
            "seconds": round(sum(epoch["seconds"] for epoch in self._history), 1),
            "train_loss": [round(epoch["train_loss"], 5) for epoch in self._history],
            "validation_macro_f1": [
                round(epoch["validation_macro_f1"], 5) for epoch in self._history
            ],
        }

    # Stopping and going on

    def resume(self, checkpoint: Path, identity: str) -> None:
        """Keep checkpoints at that path, and go on from the one there if it is of this training."""
        self._checkpoint, self._identity = checkpoint, identity
        state = read_checkpoint(checkpoint, identity, self._device)
        if state is None:
            return
        self.network.load_state_dict(state["network"])
        self._optimiser.load_state_dict(state["optimiser"])
        self._scheduler.load_state_dict(state["scheduler"])
        self._best = state["best_weights"]
        self._history = state["history"]
        torch.set_rng_state(state["rng"].cpu())

    def _save(self) -> None:
        if self._checkpoint is None:
            return
        state = {
            "network": self.network.state_dict(),
            "optimiser": self._optimiser.state_dict(),
            "scheduler": self._scheduler.state_dict(),
            "best_weights": self._best,
            "history": self._history,
            "rng": torch.get_rng_state(),
        }
        write_checkpoint(self._checkpoint, self._identity, state)


class StatisticalFit:
    """Fits one scikit-learn classifier to statistics of windows; a minute, so never half done."""

    def __init__(
        self,
        settings: TrainingSettings,
        learnt: Corpus,
        validation: Corpus,
        normalisation: Normalisation,
    ) -> None:
        """Start untrained."""
        self.settings = settings
        self._learnt = learnt
        self._normalisation = normalisation
        self._estimator = STATISTICAL[settings.classifier](settings.seed, settings.threads)
        self._windows = 0
        self._seconds = 0.0

    def resume(self, checkpoint: Path, identity: str) -> None:
        """Nothing to go on from."""

    def run(self, progress: Callable[[Epoch], None]) -> None:
        """Learn from ``draws`` epochs' worth of windows."""
        started = time.perf_counter()
        features, truths = [], []
        for draw in range(1, self.settings.draws + 1):
            rng = np.random.default_rng([self.settings.seed, draw])
            batches = self._learnt.training_batches(self._normalisation, self.settings.batch, rng)
            for windows, labels in batches:
                features.append(statistics(windows))
                truths.append(labels)
        truth = np.concatenate(truths)
        self._estimator.fit(np.concatenate(features), truth)
        self._windows = len(truth)
        self._seconds = time.perf_counter() - started

    def logits(self, corpus: Corpus) -> Logits:
        """Logarithms of the shares that the classifier gives each class, (n, classes)."""
        return np.concatenate(
            [
                logits(self._estimator, windows)
                for windows in corpus.scored_batches(self._normalisation, self.settings.batch)
            ]
        )

    @property
    def architecture(self) -> list[str]:
        """What was fitted."""
        return [repr(self._estimator), "on " + ", ".join(STATISTICS) + " of each channel"]

    @property
    def weights(self) -> None:
        """Not kept."""
        return None

    def summary(self) -> dict[str, Any]:
        """Settings and extent of the training, for the card."""
        return {
            "settings": asdict(self.settings),
            "device": device_name(),
            "windows": self._windows,
            "seconds": round(self._seconds, 1),
        }

"""Resumable training of a classifier, and the model card it writes (paper section 5.1)."""

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch

from core.dataset.archive import Manifest, read_manifest
from core.diagnosis.calibration import Calibration
from core.diagnosis.corpus import Corpus
from core.diagnosis.features import FEATURE_MODES, Normalisation, feature_mode
from core.diagnosis.predict import Diagnoser
from core.diagnosis.scores import Labels, scores
from core.diagnosis.settings import Epoch, TrainingSettings
from core.diagnosis.trainer import Fit, fit_for, identity_of
from core.errors import InputError
from core.fmea.catalogue import class_ids
from core.model_card import Card, save_card, save_model
from core.paths import MODELS
from core.provenance import provenance
from core.residual.surrogate import Surrogate

FLOWN_AGAIN = ("severity", "onset_s", "cylinder")
"""What, beside its seed, a flight of the data set needs to be flown again."""


def train(
    dataset_dir: Path,
    models_dir: Path = MODELS,
    settings: TrainingSettings | None = None,
    *,
    surrogate: Surrogate | None = None,
    work_dir: Path | None = None,
    whole_runs: bool = True,
    progress: Callable[[Epoch], None] | None = None,
) -> Card:
    """Train a classifier on a data set, score it on the test split once, and save it.

    A checkpoint is kept in ``work_dir`` (default ``dataset_dir/training``) after every epoch;
    called again with the same settings and data, training goes on where it stopped and ends with
    the same weights. ``surrogate`` is needed by the feature mode of that name. With ``whole_runs``
    the test flights are also diagnosed as a user's flight is. Returns the card saved in
    ``models_dir``; beside it lie the weights of a network. Raises `InputError` if the data set is
    incomplete or of other classes, or a surrogate is needed and not given.
    """
    settings = settings or TrainingSettings()
    manifest = read_manifest(dataset_dir)
    classes = class_ids()
    if {run.mode for run in manifest.runs} != set(classes):
        raise InputError("data", f"{dataset_dir} was flown for other classes than the catalogue's")
    torch.set_num_threads(settings.threads)
    torch.use_deterministic_algorithms(True, warn_only=torch.cuda.is_available())
    mode = feature_mode(settings.feature_mode, manifest.spec["conditions"])
    rng = np.random.default_rng([settings.seed, 0x5AFF]) if settings.shuffled else None

    def part(split: str) -> Corpus:
        return Corpus(
            dataset_dir, manifest.part(split), classes, mode, settings.shown, surrogate,
            shuffled=None if split == "test" else rng,
        )  # fmt: skip

    learnt, validation = part("train"), part("validation")
    normalisation = Normalisation.fitted(learnt.flights(), mode)
    fit = fit_for(settings, learnt, validation, normalisation)
    fingerprint = surrogate.fingerprint if surrogate and mode.residual is None else ""
    identity = identity_of(settings, manifest, fingerprint)
    fit.resume((work_dir or dataset_dir / "training") / "checkpoint.pt", identity)
    fit.run(progress or (lambda epoch: None))
    card = _card(settings, manifest, fit, normalisation) | {"identity": identity}
    if fingerprint and surrogate is not None:
        card["surrogate"] = {"name": surrogate.name, "fingerprint": fingerprint}
    _score(card, fit, validation, part("test"))
    if fit.weights is None:
        return save_card(models_dir, card)
    if whole_runs:
        test = part("test")
        diagnoser = Diagnoser.from_card(card, fit.weights, surrogate)
        card["scores"]["test_runs"] = whole_run_scores(diagnoser, test)
    return save_model(models_dir, card, fit.weights)


def _card(
    settings: TrainingSettings, manifest: Manifest, fit: Fit, normalisation: Normalisation
) -> Card:
    mode = FEATURE_MODES[settings.feature_mode]
    return {
        "name": f"{settings.classifier}-{settings.feature_mode}-{manifest.spec['conditions']}",
        "title": mode.title,
        "conditions": manifest.spec["conditions"],
        "feature_mode": settings.feature_mode,
        "inputs": settings.shown,
        "classifier": settings.classifier,
        "classes": list(class_ids()),
        "scores": {},
        "training": fit.summary(),
        "data": {
            "spec": manifest.spec,
            "code": manifest.provenance,
            "seeds": {
                part: sorted(run.plan["seed"] for run in manifest.part(part))
                for part in ("train", "validation", "test")
            },
        },
        "code": provenance(),
        "architecture": fit.architecture,
        "normalisation": normalisation.to_dict(),
    }


def _score(card: Card, fit: Fit, validation: Corpus, test: Corpus) -> None:
    """Scores of both parts and the calibration, which is fitted to the validation part alone."""
    classes = validation.classes
    known, found = fit.logits(validation), fit.logits(test)
    calibration = Calibration.fitted(known, validation.truth())
    card["calibration"] = {"temperature": calibration.temperature}
    if np.isfinite(calibration.threshold):
        card["calibration"]["energy_threshold"] = calibration.threshold
    for name, corpus, logits in (
        ("validation_windows", validation, known),
        ("test_windows", test, found),
    ):
        truth, answer = corpus.truth(), logits.argmax(axis=1)
        card["scores"][name] = scores(truth, answer, classes) | {
            "calibration": calibration.report(logits, truth),
            "mistakes": mistakes(corpus, answer),
        }


def mistakes(corpus: Corpus, found: Labels) -> list[dict[str, Any]]:
    """The flights behind the confusion matrix: those with windows taken for another class.

    ``found``: (n,) class numbers of the scored windows. Each flight is described so that it can be
    flown again: its seed, class, severity, onset and cylinder, and how many windows were taken for
    what.
    """
    counts = Counter(
        (window.run, int(taken))
        for window, taken in zip(corpus.scored, found, strict=True)
        if taken != window.label
    )
    return [
        {
            "true": corpus.runs[run].mode,
            "predicted": corpus.classes[taken],
            "windows": count,
            "seed": corpus.runs[run].plan["seed"],
            **{name: corpus.runs[run].fault.get(name) for name in FLOWN_AGAIN},
        }
        for (run, taken), count in sorted(counts.items())
    ]


def whole_run_scores(diagnoser: Diagnoser, corpus: Corpus) -> dict[str, Any]:
    """Scores of the product's own verdict: each run diagnosed as a flight is."""
    verdicts = [
        diagnoser.diagnose(pair, residual=residual)
        for pair, (residual, _) in zip(corpus.pairs, corpus.flights(), strict=True)
    ]
    found = np.array([corpus.classes.index(verdict.top) for verdict in verdicts])
    truth = np.array([stretch.label for stretch in corpus.stretches])
    refused = float(np.mean([verdict.none_of_these for verdict in verdicts]))
    return scores(truth, found, corpus.classes) | {"refused_share": refused}

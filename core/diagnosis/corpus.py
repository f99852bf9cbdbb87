"""One part of a data set as the classifiers read it: windows, features, labels."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from core.arrays import Array32
from core.dataset.archive import StoredRun, read_run
from core.diagnosis.features import (
    WINDOW_POOLED,
    FeatureMode,
    Inputs,
    Normalisation,
    baseline,
    n_features,
)
from core.diagnosis.scores import Labels
from core.diagnosis.windows import Stretch, Window, scored_windows, training_windows
from core.errors import InputError
from core.files import whole_file
from core.residual.controls import controls
from core.residual.surrogate import Surrogate
from core.residual.window import WINDOW_STEPS
from core.twin.plan import Plan
from core.twin.trajectory import Pair

Batch = tuple[NDArray[np.float32], Labels]

ResidualRows = Callable[[slice], Array32]
"""Residuals of any rows of one run, (n, 23)."""


class Corpus:
    """The runs of one split. Files stay on disk, mapped; only windows in use are in memory."""

    def __init__(
        self,
        folder: Path,
        runs: tuple[StoredRun, ...],
        classes: tuple[str, ...],
        mode: FeatureMode,
        shown: Inputs = "both",
        surrogate: Surrogate | None = None,
        *,
        shuffled: np.random.Generator | None = None,
    ) -> None:
        """Map every run's file; surrogate residuals are computed once and kept beside the runs.

        ``shown`` is the half of the 46 channels in use. ``shuffled`` deals the labels out at
        random among the runs. Raises `InputError` where the mode needs a surrogate and has none.
        """
        self.classes = classes
        self.runs = runs
        self.shown = shown
        self.pairs = [read_run(folder, run) for run in runs]
        self._residuals = [
            _residual_rows(folder, run, pair, mode, surrogate)
            for run, pair in zip(runs, self.pairs, strict=True)
        ]
        self._nominal = classes.index("nominal")
        labels = [classes.index(run.mode) for run in runs]
        if shuffled is not None:
            shuffled.shuffle(labels)
        self.stretches = [
            Stretch(label, len(pair.faulted), run.shown_row)
            for label, run, pair in zip(labels, runs, self.pairs, strict=True)
        ]
        self.scored = scored_windows(self.stretches)

    def flights(self) -> Iterator[tuple[Array32, Array32]]:
        """(residual, sensors), (n, 23) each, of every run: what the normalisation is fitted to."""
        for residual, pair in zip(self._residuals, self.pairs, strict=True):
            yield residual(slice(None)), pair.faulted.channels

    def truth(self) -> Labels:
        """Class numbers of the scored windows, (n,)."""
        return np.array([window.label for window in self.scored])

    def scored_batches(
        self, normalisation: Normalisation, size: int
    ) -> Iterator[NDArray[np.float32]]:
        """Features of the scored windows in order, (size, 46, 150) at a time."""
        for start in range(0, len(self.scored), size):
            yield self._batch(normalisation, self.scored[start : start + size])[0]

    def training_batches(
        self, normalisation: Normalisation, size: int, rng: np.random.Generator
    ) -> Iterator[Batch]:
        """One epoch of freshly drawn windows: features (size, 46, 150) and labels (size,)."""
        windows = training_windows(self.stretches, self._nominal, rng)
        # A last batch of one cannot be batch-normalised; leave so small a rest for next time.
        for start in range(0, len(windows) - 1, size):
            yield self._batch(normalisation, windows[start : start + size])

    def _batch(self, normalisation: Normalisation, windows: list[Window]) -> Batch:
        size = (len(windows), n_features(self.shown), WINDOW_POOLED)
        features = np.full(size, np.nan, dtype=np.float32)
        for row, window in enumerate(windows):
            rows = slice(window.start_row, window.start_row + WINDOW_STEPS)
            sensors = self.pairs[window.run].faulted.channels[rows]
            residual = self._residuals[window.run](rows)
            features[row] = normalisation.features(residual, sensors, self.shown)
        return features, np.array([window.label for window in windows])


def _residual_rows(
    folder: Path, run: StoredRun, pair: Pair, mode: FeatureMode, surrogate: Surrogate | None
) -> ResidualRows:
    formed = mode.residual
    if formed is not None and mode.debiased:
        usual = baseline(mode, pair)  # a stretch begins 30 s before the fault
        return lambda rows: formed(pair[rows]) - usual
    if formed is not None:
        return lambda rows: formed(pair[rows])
    if surrogate is None:
        raise InputError("surrogate", f"{mode.title} need one; train it with --surrogate")
    return _surrogate_residual(folder, run, pair, surrogate).__getitem__


def _surrogate_residual(folder: Path, run: StoredRun, pair: Pair, surrogate: Surrogate) -> Array32:
    """The finished residual of a stored stretch, mapped from disk; computed where it is not there.

    A stretch begins on the grid of the surrogate's chunks and at least 30 s before the fault, so
    that it has the residual of the whole flight, its baseline taken right before the fault.
    """
    path = folder / "residuals" / surrogate.fingerprint / f"{run.id}-{run.sha256[:12]}.npy"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        channels = np.asarray(pair.faulted.channels)
        commanded = controls(Plan.from_dict(run.plan), run.start_row, len(channels))
        with whole_file(path) as temporary, temporary.open("wb") as file:
            np.save(file, surrogate.residual(channels, commanded))
    residual: Array32 = np.load(path, mmap_mode="r")
    return residual

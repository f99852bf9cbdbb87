"""One part of a data set as the classifiers read it: windows, features, labels."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.diagnosis.features import N_FEATURES, FeatureMode, Normalisation
from core.diagnosis.predict import Diagnoser
from core.diagnosis.scores import Labels, scores
from core.diagnosis.windows import Stretch, Window, scored_windows, training_windows
from core.experiments.archive import StoredRun, read_run
from core.residual.window import WINDOW_STEPS
from core.twin.trajectory import Array32

Batch = tuple[NDArray[np.float32], Labels]


class Corpus:
    """The runs of one split. Files stay on disk, mapped; only windows in use are in memory."""

    def __init__(
        self,
        folder: Path,
        runs: tuple[StoredRun, ...],
        classes: tuple[str, ...],
        mode: FeatureMode,
    ) -> None:
        """Map every run's file."""
        self.classes = classes
        self.runs = runs
        self._mode = mode
        self._pairs = [read_run(folder, run) for run in runs]
        self._nominal = classes.index("nominal")
        self._stretches = [
            Stretch(classes.index(run.mode), len(pair.faulted), run.shown_row)
            for run, pair in zip(runs, self._pairs, strict=True)
        ]
        self._scored = scored_windows(self._stretches)

    def flights(self) -> Iterator[tuple[Array32, Array32]]:
        """(residual, sensors), (n, 23) each, of every run: what the normalisation is fitted to."""
        for pair in self._pairs:
            yield self._mode.residual(pair), pair.faulted.channels

    def truth(self) -> Labels:
        """Class numbers of the scored windows, (n,)."""
        return np.array([window.label for window in self._scored])

    def scored_batches(
        self, normalisation: Normalisation, size: int
    ) -> Iterator[NDArray[np.float32]]:
        """Features of the scored windows in order, (size, 46, 1500) at a time."""
        for start in range(0, len(self._scored), size):
            yield self._batch(normalisation, self._scored[start : start + size])[0]

    def training_batches(
        self, normalisation: Normalisation, size: int, rng: np.random.Generator
    ) -> Iterator[Batch]:
        """One epoch of freshly drawn windows: features (size, 46, 1500) and labels (size,)."""
        windows = training_windows(self._stretches, self._nominal, rng)
        # A last batch of one cannot be batch-normalised; leave so small a rest for next time.
        for start in range(0, len(windows) - 1, size):
            yield self._batch(normalisation, windows[start : start + size])

    def whole_run_scores(self, diagnoser: Diagnoser) -> dict[str, Any]:
        """Scores of the product's own verdict: each run diagnosed as a flight is."""
        verdicts = [diagnoser.diagnose(pair) for pair in self._pairs]
        found = np.array([self.classes.index(verdict.top) for verdict in verdicts])
        truth = np.array([stretch.label for stretch in self._stretches])
        return scores(truth, found, self.classes)

    def _batch(self, normalisation: Normalisation, windows: list[Window]) -> Batch:
        features = np.empty((len(windows), N_FEATURES, WINDOW_STEPS), dtype=np.float32)
        for row, window in enumerate(windows):
            pair = self._pairs[window.run][window.start_row : window.start_row + WINDOW_STEPS]
            features[row] = normalisation.features(self._mode.residual(pair), pair.faulted.channels)
        return features, np.array([window.label for window in windows])

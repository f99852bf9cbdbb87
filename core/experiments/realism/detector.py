"""Can a classifier tell our field flights from real ones? What it relies on is what to correct.

It sees ten seconds of steady cruise at a time, each channel by itself and without its level and
trend: no altitude, no speed, no season, only how the channel moves from second to second.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import RandomForestClassifier
from sklearn.metrics import roc_auc_score

from core.arrays import Array
from core.channels import CHANNEL_INDEX, CHANNEL_NAMES
from core.exchange.log import Log
from core.experiments.realism.cruise import steady_stretches

Labels = NDArray[np.int64]

CRUISE_WINDOW_S = 10
STATISTICS: tuple[str, ...] = (
    "spread about its trend", "step from second to second", "bend from second to second",
    "likeness of successive steps", "seconds without change", "largest step",
)  # fmt: skip
"""Of each channel in a window: sd about its line, sd of first and of second differences, lag-one
correlation of first differences, share of zero differences, largest difference by their sd."""

MOST_FOLDS = 5
N_TREES = 200
MOST_OF_A_FLIGHT = 10
"""Windows that one of our flights contributes: there are enough flights."""
CONTROLS = 5
APART_S = 60.0
"""Where all real windows come from one log, stretches this far apart count as different groups."""
LISTED = 12


def statistics(window: Array) -> Array:
    """The statistics of a window (10, channels) as one row, channel by channel (channels * 6,)."""
    time = np.arange(len(window)) - (len(window) - 1) / 2.0
    level = window - window.mean(axis=0)
    about_line = level - np.outer(time, time @ level) / (time @ time)
    step, bend = np.diff(window, axis=0), np.diff(window, 2, axis=0)
    moving = step - step.mean(axis=0)
    power = np.maximum((moving**2).mean(axis=0), 1e-12)
    return np.stack(
        [
            about_line.std(axis=0),
            step.std(axis=0),
            bend.std(axis=0),
            (moving[1:] * moving[:-1]).mean(axis=0) / power,
            (np.abs(step) < 1e-6).mean(axis=0),
            np.abs(moving).max(axis=0) / np.sqrt(power),
        ],
        axis=1,
    ).ravel()


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Statistics (n, channels * 6) and the group (n,) that each window belongs to."""

    features: Array
    groups: NDArray[np.str_]

    def __len__(self) -> int:
        """Number of windows."""
        return len(self.groups)


def windows_of(
    flights: Sequence[Log], channels: Sequence[str] = CHANNEL_NAMES, *, by_stretch: bool = False
) -> Windows:
    """Windows of steady cruise, end to end in each stretch, whose channels are all known.

    The group is the flight; ``by_stretch``, it is the flight's stretches within `APART_S`.
    """
    columns = [CHANNEL_INDEX[name] for name in channels]
    rows: list[Array] = []
    groups: list[str] = []
    for flight in flights:
        number, until_s = 0, -np.inf
        for stretch in steady_stretches(flight):
            number += flight.time_s[stretch.start] - until_s > APART_S
            until_s = flight.time_s[stretch.stop - 1]
            for start in range(stretch.start, stretch.stop - CRUISE_WINDOW_S + 1, CRUISE_WINDOW_S):
                window = flight.channels[start : start + CRUISE_WINDOW_S, columns]
                if np.isfinite(window).all():
                    rows.append(statistics(window))
                    groups.append(f"{flight.name} {number}" if by_stretch else flight.name)
    n_features = len(columns) * len(STATISTICS)
    return Windows(np.array(rows).reshape(-1, n_features), np.array(groups, dtype=np.str_))


@dataclass(frozen=True, slots=True)
class Tell:
    """A statistic of a channel that tells ours from real, and how well it does so alone.

    ``auc``: chance that ours is the larger, 0.5 if it tells nothing. ``ours`` and ``real`` are
    medians.
    """

    channel: str
    statistic: str
    auc: float
    ours: float
    real: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """How well the classifier did on flights it had not seen.

    ``auc`` is the mean over folds, weighted by their real windows; None where there is too little
    to tell. ``leans_on`` is the AUC lost, channel by channel, when its statistics are shuffled;
    ``tells`` are the most telling statistics by themselves.
    """

    auc: float | None
    fold_aucs: tuple[float, ...]
    groups: str
    channels: tuple[str, ...]
    n_ours: int
    n_real: int
    leans_on: dict[str, float]
    tells: tuple[Tell, ...]


def tell_apart(
    ours: Sequence[Log], real: Sequence[Log], *, explained: bool = True, seed: int = 0
) -> Verdict:
    """Train on some flights, ask about others; no flight is ever on both sides.

    Without ``explained``, what it leans on is not looked for, which takes most of the time.
    """
    shown = [log for log in real if _n_windows(log)]
    channels = tuple(
        name for name in CHANNEL_NAMES if all(np.isfinite(log.channel(name)).any() for log in shown)
    )
    one_log = len(shown) == 1
    a = _thinned(windows_of(ours, channels))
    b = windows_of(shown, channels, by_stretch=one_log)
    n_folds = min(MOST_FOLDS, len(set(a.groups)), len(set(b.groups)))
    verdict = Verdict(
        auc=None,
        fold_aucs=(),
        groups=f"stretches {APART_S:g} s apart of the only log with windows" if one_log else "logs",
        channels=channels,
        n_ours=len(a),
        n_real=len(b),
        leans_on={},
        tells=_tells(a.features, b.features, channels) if len(b) else (),
    )
    if n_folds < 2:
        return verdict
    x = np.concatenate([a.features, b.features])
    is_ours = np.repeat([1, 0], [len(a), len(b)])
    fold = np.concatenate([_folds(a.groups, n_folds), _folds(b.groups, n_folds)])
    rng = np.random.default_rng(seed)
    aucs, drops, weights = [], [], []
    for number in range(n_folds):
        test = fold == number
        forest = RandomForestClassifier(
            N_TREES, min_samples_leaf=3, class_weight="balanced_subsample", random_state=seed
        ).fit(x[~test], is_ours[~test])
        auc = _auc(forest, x[test], is_ours[test])
        looked_at = range(len(channels) if explained else 0)
        shuffled = (_shuffled(x[test], k, rng) for k in looked_at)
        aucs.append(auc)
        drops.append([auc - _auc(forest, mixed, is_ours[test]) for mixed in shuffled])
        weights.append(int((is_ours[test] == 0).sum()))
    lost: Array = np.average(np.array(drops), axis=0, weights=weights)
    return replace(
        verdict,
        auc=round(float(np.average(aucs, weights=weights)), 4),
        fold_aucs=tuple(round(auc, 4) for auc in aucs),
        leans_on={channels[k]: round(float(lost[k]), 4) for k in np.argsort(-lost)[:LISTED]},
    )


def tell_own_apart(ours: Sequence[Log], real: Sequence[Log]) -> tuple[float, ...]:
    """What the same classifier makes of some of ours, labelled as the real ones.

    Any few aircraft differ from a fleet: an AUC as high as these says no more than that. As many
    flights, with about as many windows, as the real logs have; a new choice each time.
    """
    counts = [n for n in map(_n_windows, real) if n]
    if not counts:
        return ()
    typical, k = float(np.mean(counts)), len(counts)
    order = sorted(range(len(ours)), key=lambda index: abs(_n_windows(ours[index]) - typical))
    found: list[float] = []
    for first in range(0, CONTROLS * k, k):
        chosen = set(order[first : first + k])
        rest = [log for index, log in enumerate(ours) if index not in chosen]
        pretended = [ours[index] for index in chosen]
        auc = tell_apart(rest, pretended, explained=False).auc if rest else None
        if auc is not None:
            found.append(auc)
    return tuple(found)


def _n_windows(log: Log) -> int:
    return sum((rows.stop - rows.start) // CRUISE_WINDOW_S for rows in steady_stretches(log))


def _thinned(windows: Windows) -> Windows:
    """At most `MOST_OF_A_FLIGHT` windows of each group, evenly spread."""
    kept: list[int] = []
    for name in dict.fromkeys(windows.groups):
        rows = np.flatnonzero(windows.groups == name)
        number = min(len(rows), MOST_OF_A_FLIGHT)
        kept += rows[np.linspace(0, len(rows) - 1, number).round().astype(int)].tolist()
    return Windows(windows.features[kept], windows.groups[kept])


def _folds(groups: NDArray[np.str_], n_folds: int) -> Labels:
    """The fold of each window (n,): groups whole, the largest first into the emptiest fold."""
    names, counts = np.unique(groups, return_counts=True)
    filled = np.zeros(n_folds)
    fold_of: dict[str, int] = {}
    for k in np.argsort(-counts, kind="stable"):
        fold_of[str(names[k])] = emptiest = int(filled.argmin())
        filled[emptiest] += counts[k]
    return np.array([fold_of[str(name)] for name in groups])


def _auc(forest: RandomForestClassifier, x: Array, is_ours: Labels) -> float:
    return float(roc_auc_score(is_ours, forest.predict_proba(x)[:, 1]))


def _shuffled(x: Array, channel: int, rng: np.random.Generator) -> Array:
    """``x`` with the statistics of one channel taken from other windows."""
    width = len(STATISTICS)
    columns = slice(channel * width, (channel + 1) * width)
    mixed = x.copy()
    mixed[:, columns] = mixed[rng.permutation(len(mixed)), columns]
    return mixed


def _tells(ours: Array, real: Array, channels: Sequence[str]) -> tuple[Tell, ...]:
    is_ours = np.repeat([1, 0], [len(ours), len(real)])
    found = [
        Tell(
            channel,
            statistic,
            round(float(roc_auc_score(is_ours, np.concatenate([ours[:, k], real[:, k]]))), 3),
            round(float(np.median(ours[:, k])), 5),
            round(float(np.median(real[:, k])), 5),
        )
        for k, (channel, statistic) in enumerate(
            (channel, statistic) for channel in channels for statistic in STATISTICS
        )
    ]
    return tuple(sorted(found, key=lambda tell: -abs(tell.auc - 0.5))[:LISTED])

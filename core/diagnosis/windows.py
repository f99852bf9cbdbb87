"""Which windows of a run are learnt from, and what they are called."""

from dataclasses import dataclass

import numpy as np

from core.clock import DT_S
from core.residual.window import EFFECTIVE_STEPS, WINDOW_STEPS

MIN_FAULTED_STEPS = round(5.0 / DT_S)
"""A training window that begins before the fault shows holds at least this much of it: 5 s."""

SCORED_STARTS = tuple(range(0, EFFECTIVE_STEPS, WINDOW_STEPS))
"""Starts, after the fault first shows, of the scored windows: four that tile the 120 s."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """What window choice needs to know of a run: class number, rows, row where its fault shows."""

    label: int
    n_rows: int
    shown_row: int


@dataclass(frozen=True, slots=True)
class Window:
    """1,500 rows of a run from ``start_row``, and the class they show."""

    run: int
    start_row: int
    label: int


def training_windows(
    stretches: list[Stretch], nominal: int, rng: np.random.Generator
) -> list[Window]:
    """One epoch's windows in random order: one a run, and before-onset ones called nominal.

    A faulted run gives a window that starts anywhere from 25 s before its fault shows to 90 s
    after, so that a live diagnosis knows what a fault looks like while it enters the window; a
    nominal run gives one from anywhere. From before the faults show, as many healthy windows are
    drawn again as there are nominal runs.
    """
    windows = []
    healthy = [
        number for number, stretch in enumerate(stretches)
        if stretch.label != nominal and stretch.shown_row >= WINDOW_STEPS
    ]  # fmt: skip
    for number, stretch in enumerate(stretches):
        last = stretch.n_rows - WINDOW_STEPS
        first = 0
        if stretch.label != nominal:
            last = min(last, stretch.shown_row + EFFECTIVE_STEPS - WINDOW_STEPS)
            first = min(last, max(0, stretch.shown_row + MIN_FAULTED_STEPS - WINDOW_STEPS))
        windows.append(Window(number, int(rng.integers(first, last + 1)), stretch.label))
    n_nominal = len(stretches) - sum(stretch.label != nominal for stretch in stretches)
    for number in rng.choice(healthy, size=min(n_nominal, len(healthy)), replace=False):
        start = int(rng.integers(0, stretches[number].shown_row - WINDOW_STEPS + 1))
        windows.append(Window(int(number), start, nominal))
    return [windows[index] for index in rng.permutation(len(windows))]


def scored_windows(stretches: list[Stretch]) -> list[Window]:
    """The windows that validation and test scores count: those that tile each effective window."""
    return [
        Window(number, stretch.shown_row + start, stretch.label)
        for number, stretch in enumerate(stretches)
        for start in SCORED_STARTS
        if stretch.shown_row + start + WINDOW_STEPS <= stretch.n_rows
    ]

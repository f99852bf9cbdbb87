"""Which windows are learnt from and what they are called."""

from itertools import chain

import numpy as np

from core.diagnosis.windows import Stretch, scored_windows, training_windows
from core.residual.window import EFFECTIVE_STEPS, WINDOW_STEPS

NOMINAL = 0
STRETCHES = [
    Stretch(NOMINAL, 7750, 1600),
    Stretch(NOMINAL, 7500, 1510),
    *(Stretch(label, 7750, 1600) for label in range(1, 8)),
    Stretch(8, 9250, 3100),  # a defect that shows late
    Stretch(9, 7000, 1000),  # too early for a healthy window before it
]


def _epoch(seed):
    return training_windows(STRETCHES, NOMINAL, np.random.default_rng(seed))


def test_every_run_gives_one_window_an_epoch_and_nominal_is_doubled():
    for windows in map(_epoch, range(20)):
        assert len(windows) == len(STRETCHES) + 2
        assert sum(window.label == NOMINAL for window in windows) == 4


def test_labels_say_what_the_window_shows():
    for window in chain(*map(_epoch, range(200))):
        stretch = STRETCHES[window.run]
        stop = window.start_row + WINDOW_STEPS
        assert window.start_row >= 0
        assert stop <= stretch.n_rows
        if stretch.label == NOMINAL:
            assert window.label == NOMINAL
        elif window.label == NOMINAL:
            assert stop <= stretch.shown_row
        else:
            assert window.label == stretch.label
            assert stretch.shown_row + 250 <= stop <= stretch.shown_row + EFFECTIVE_STEPS


def test_windows_enter_and_leave_the_effective_window():
    begins = [
        window.start_row - STRETCHES[window.run].shown_row
        for window in chain(*map(_epoch, range(300)))
        if window.label == 8
    ]
    assert min(begins) < -1100 and max(begins) > 4300


def test_same_generator_same_windows():
    assert _epoch(3) == _epoch(3) != _epoch(4)


def test_scored_windows_tile_the_effective_window():
    starts = [window.start_row for window in scored_windows(STRETCHES) if window.run == 9]
    assert starts == [3100, 4600, 6100, 7600]
    assert len(scored_windows(STRETCHES)) == 4 * len(STRETCHES) - 1  # run 1 ends 10 rows short

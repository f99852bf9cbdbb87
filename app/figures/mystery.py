"""The data of a mystery flight for the browser: sensors, and the mirror only once revealed."""

from typing import Any

import numpy as np

from app.figures.axes import base64_floats, kept_rows
from app.figures.sensors import TILE_POINTS, tile_specs
from core.arrays import Array, Array32
from core.channels import CHANNEL_INDEX, CHANNELS, channel
from core.teach.scoring import Mark
from core.twin.trajectory import Trajectory

DIRECTION_WORDS = {"+": "rises", "-": "falls"}


def mystery_flight(
    readings: Trajectory, mirror: Trajectory | None, onset_s: float | None
) -> dict[str, Any]:
    """The charts of `teach/teach.js`; ``mirror`` and ``onset_s`` are None while they are hidden.

    The samples are chosen by the lines that are shown: one kept because of the mirror would reveal
    it.
    """
    time_s = readings.time_s
    drawn: list[list[str]] = []
    for index in range(len(CHANNELS)):
        lines: list[Array32] = [readings.channels[:, index]]
        if mirror is not None:
            lines.append(mirror.channels[:, index])
        kept = [kept_rows(time_s, line, TILE_POINTS) for line in lines]
        rows = np.unique(np.concatenate(kept))
        columns: list[Array | Array32] = [time_s, *lines]
        drawn.append([base64_floats(values[rows]) for values in columns])
    return {
        "specs": tile_specs(),
        "duration_s": float(np.ceil(time_s[-1])),
        "onset_s": onset_s,
        "channels": drawn,
    }


def shown_marks(marks: tuple[Mark, ...]) -> list[dict[str, Any]]:
    """The marks as the charts draw them: by index of the channel."""
    return [
        {
            "index": CHANNEL_INDEX[mark.channel],
            "time_s": mark.time_s,
            "direction": mark.direction,
        }
        for mark in marks
    ]


def mark_words(mark: Mark) -> str:
    """The claim of a mark, without its time.

    >>> mark_words(Mark("E1 EGT1", 130.0, "-"))
    'EGT 1 falls'
    """
    return f"{channel(mark.channel).label} {DIRECTION_WORDS[mark.direction]}"

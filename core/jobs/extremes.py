"""What a thinned flight must not lose: the samples at which a line is at its least or its greatest.

A line here is a channel of the faulted flight, of its mirror, or their residual. Kept are samples
as flown, time and both readings, so that what is drawn of them was all there at one moment.
"""

import numpy as np

from core.arrays import Array32
from core.channels import N_CHANNELS
from core.clock import DT_S
from core.twin.trajectory import Pair

PER_BUCKET = 6
"""Samples kept of a bucket: the least and the greatest of three lines."""

SECOND = round(1.0 / DT_S)
"""Samples of a flight in the smallest bucket."""


def extremes(samples: Array32) -> Array32:
    """Of buckets of w samples, (3, ..., w), those with an extreme of a line: (3, ..., 6).

    The first axis is time, faulted, mirror; in order of time, one that is several extremes repeats.
    """
    _, faulted, mirror = samples
    lines = np.stack([faulted, mirror, faulted - mirror])
    places = np.concatenate([lines.argmin(axis=-1), lines.argmax(axis=-1)])
    in_order = np.sort(np.moveaxis(places, 0, -1), axis=-1)
    return np.take_along_axis(samples, in_order[np.newaxis], axis=-1)


def none_yet() -> Array32:
    """The extremes of no second: (3, 23, 0, 6)."""
    return np.empty((3, N_CHANNELS, 0, PER_BUCKET), dtype=np.float32)


class Seconds:
    """The extremes of every whole second of a flight that comes in blocks from its beginning."""

    def __init__(self) -> None:
        """Start with nothing."""
        self._left = np.empty((3, N_CHANNELS, 0), dtype=np.float32)

    def push(self, block: Pair) -> Array32:
        """The extremes of the seconds that end in this block, (3, 23, seconds, 6)."""
        faulted, mirror = block.faulted.channels.T, block.mirror.channels.T
        time_s = np.broadcast_to(block.faulted.time_s.astype(np.float32), faulted.shape)
        lines = np.concatenate([self._left, np.stack([time_s, faulted, mirror])], axis=-1)
        n = lines.shape[-1] // SECOND
        whole, self._left = np.split(lines, [n * SECOND], axis=-1)
        return extremes(whole.reshape(3, N_CHANNELS, n, SECOND)) if n else none_yet()

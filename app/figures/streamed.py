"""The samples of a flight in progress as the page shows them: thinned, with every spike.

The page holds every n-th of the 5 Hz samples, and beside them, of each of up to `GROUPS` stretches
of the whole flight, the samples at which a line is at its least or its greatest at 50 Hz.
"""

import math
from typing import Any

import numpy as np

from app.figures.axes import Array, Array32, base64_floats
from core.channels import N_CHANNELS
from core.jobs.events import Samples
from core.jobs.extremes import PER_BUCKET, extremes, none_yet

LIVE_POINTS = 1500
"""Samples a line is streamed with, whatever the length of the flight; all of 300 s at 5 Hz."""

GROUPS = 200
"""Most stretches whose extremes are shown."""

LEAST_GROUP_S = 3
"""The shortest stretch. Its extremes are sent when it is over, those of longer ones at once."""

STREAM_HZ = 5


class Streamed:
    """The samples of one flight so far, and those that a page does not hold yet."""

    def __init__(self, duration_s: float) -> None:
        """Start with no sample of a flight of that length."""
        self.stride = max(1, round(duration_s * STREAM_HZ / LIVE_POINTS))
        """Every ``stride``-th sample is sent."""
        self._seconds_a_group = max(LEAST_GROUP_S, math.ceil(duration_s / GROUPS))
        self._n = self._n_seconds = 0
        seconds = math.ceil(duration_s) + 1
        self._time_s = np.empty(seconds * STREAM_HZ, dtype=np.float32)
        self._channels = np.empty((2, seconds * STREAM_HZ, N_CHANNELS), dtype=np.float32)
        self._extremes = np.empty((3, N_CHANNELS, seconds, PER_BUCKET), dtype=np.float32)

    def push(self, samples: Samples) -> None:
        """Take the next samples."""
        came = slice(self._n, self._n + len(samples.time_s))
        self._time_s[came] = samples.time_s
        self._channels[:, came] = samples.faulted, samples.mirror
        ended = slice(self._n_seconds, self._n_seconds + samples.extremes.shape[2])
        self._extremes[:, :, ended] = samples.extremes
        self._n, self._n_seconds = came.stop, ended.stop

    @property
    def time_s(self) -> Array:
        """The times of all 5 Hz samples, (n,)."""
        return self._time_s[: self._n]

    @property
    def faulted(self) -> Array:
        """Their channels, (n, n_channels)."""
        return self._channels[0, : self._n]

    @property
    def mirror(self) -> Array:
        """Those of the mirror, (n, n_channels)."""
        return self._channels[1, : self._n]

    def since(self, start: int) -> dict[str, Any]:
        """The samples after the first ``start`` that a page holds, for ``fly/flight.js``."""
        shown = slice(start * self.stride, self._n, self.stride)
        # What was sent along with the last of them covers every second that had ended by then.
        covered_s = ((start - 1) * self.stride + 1) // STREAM_HZ if start else 0
        group = covered_s // self._seconds_a_group
        return {
            "start": start,
            "time_s": base64_floats(self._time_s[shown]),
            "faulted": base64_floats(self._channels[0, shown].T),
            "mirror": base64_floats(self._channels[1, shown].T),
            "group": group,
            "extremes": [base64_floats(row) for row in self._grouped(group)],
        }

    def _grouped(self, first: int) -> Array32:
        """Extremes of the groups from ``first`` on, the last of which may grow.

        (3, n_channels, groups, 6).
        """
        per = self._seconds_a_group
        seconds = self._extremes[:, :, first * per : self._n_seconds]
        n = seconds.shape[2] // per
        whole, rest = np.split(seconds, [n * per], axis=2)
        groups = none_yet()
        if n:
            groups = extremes(whole.reshape(3, N_CHANNELS, n, -1))
        if rest.size and per > LEAST_GROUP_S:
            last = extremes(rest.reshape(3, N_CHANNELS, 1, -1))
            groups = np.concatenate([groups, last], axis=2)
        return groups

"""Sensor noise, drawn from the plan's seed so that a lab pair shares it bit for bit."""

import numpy as np
from numpy.typing import NDArray

from core.channels import CHANNELS, N_CHANNELS

Array = NDArray[np.float64]

_WHITE_SD = np.array([channel.noise_sd for channel in CHANNELS])


class SensorNoise:
    """White noise of each channel at its measured level (``core.channels``)."""

    def __init__(self, seed: int) -> None:
        """The stream of ``seed``."""
        self._rng = np.random.default_rng([seed, 0x0153])

    def next(self, n: int) -> Array:
        """The next n samples, (n, 23); the stream does not depend on how it is cut."""
        noise: Array = self._rng.standard_normal((n, N_CHANNELS)) * _WHITE_SD
        return noise

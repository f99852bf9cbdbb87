"""What the classifiers see: 46 channels, 23 residuals and 23 sensors, normalised (section 5.1)."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from core.channels import CHANNELS, N_CHANNELS
from core.twin.trajectory import Array, Array32, Pair

N_FEATURES = 2 * N_CHANNELS

COMPRESSION = 0.1
"""Where the residual scale turns from linear to logarithmic, in white-noise deviations.

A plugged baffle lifts one CHT by 3 degF, a dead engine drops an EGT by 800: over the faults and
the time since the onset, residuals span six decades of the sensor's noise. ``asinh(r / s)`` keeps
the sign, is linear below ``s`` and logarithmic above, so that a ratio of two channels, which is
what tells many faults apart, becomes a difference whatever the severity.
"""

SHAPE_GAIN = 10.0
"""How much the course of a residual within its window is magnified.

A plugged and a cracked baffle heat the same head by the same few degrees; only the course differs,
a step that levels off or a growth that goes on. Within 30 s that is a tenth of the level or less,
and the network, which averages over the window, would hardly see it. So each residual is split
into its mean over the window, kept, and its departure from that mean, magnified.
"""

MIN_RESIDUAL_SD = 0.1
MIN_SENSOR_SD = 1e-3
"""Floors of the divisors, so that a channel that no fault moves is not blown up."""


@dataclass(frozen=True, slots=True)
class FeatureMode:
    """One way to form the 23 residuals, named as in Table 1 of the paper.

    ``residual`` maps a flight, (n, 23) channels of it and of its mirror, to (n, 23).
    """

    name: str
    title: str
    residual: Callable[[Pair], Array32]


FEATURE_MODES: dict[str, FeatureMode] = {
    "paired": FeatureMode("paired", "Paired-mirror residuals", lambda pair: pair.residual),
}


@dataclass(frozen=True, slots=True, eq=False)
class Normalisation:
    """Constants that bring 46 channels to comparable size; all (23,) and from training data only.

    A residual r is compressed, c = asinh(r / residual_scale); with its mean m over the window it
    becomes ``m / residual_sd + asinh(shape_gain (c - m))``: no centring, so that a residual of
    exactly zero stays zero. A sensor value x becomes ``(x - sensor_mean) / sensor_sd``.
    """

    residual_scale: Array
    residual_sd: Array
    shape_gain: Array
    sensor_mean: Array
    sensor_sd: Array

    @classmethod
    def fitted(cls, flights: Iterable[tuple[Array32, Array32]]) -> Self:
        """From (residual, sensors) arrays, (n, 23) each, of the training flights."""
        scale = np.array([COMPRESSION * channel.noise_sd for channel in CHANNELS])
        count = 0
        squares, total, total_squares = np.zeros((3, N_CHANNELS))
        for residual, sensors in flights:
            count += len(residual)
            squares += np.square(np.arcsinh(residual / scale)).sum(axis=0)
            total += sensors.sum(axis=0, dtype=np.float64)
            total_squares += np.square(sensors, dtype=np.float64).sum(axis=0)
        mean = total / count
        variance = np.maximum(total_squares / count - np.square(mean), 0.0)
        return cls(
            residual_scale=scale,
            residual_sd=np.maximum(np.sqrt(squares / count), MIN_RESIDUAL_SD),
            shape_gain=np.full(N_CHANNELS, SHAPE_GAIN),
            sensor_mean=mean,
            sensor_sd=np.maximum(np.sqrt(variance), MIN_SENSOR_SD),
        )

    def features(self, residual: Array32, sensors: Array32) -> NDArray[np.float32]:
        """(46, n) float32, residuals first, of one window's (n, 23) residuals and sensors."""
        compressed = np.arcsinh(residual / self.residual_scale)
        level = compressed.mean(axis=0)
        shape = np.arcsinh(self.shape_gain * (compressed - level))
        features = np.empty((N_FEATURES, len(residual)), dtype=np.float32)
        features[:N_CHANNELS] = (level / self.residual_sd + shape).T
        features[N_CHANNELS:] = ((sensors - self.sensor_mean) / self.sensor_sd).T
        return features

    def to_dict(self) -> dict[str, list[float]]:
        """Plain JSON-ready values, in channel order; `from_dict` reads them back."""
        return {name: getattr(self, name).tolist() for name in self.__dataclass_fields__}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """Read what `to_dict` wrote."""
        return cls(**{name: np.asarray(values[name]) for name in cls.__dataclass_fields__})

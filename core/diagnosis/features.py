"""What the classifiers see: 46 channels, 23 residuals and 23 sensors, normalised (section 5.1).

There are four ways to form the residuals, those of the paper's Table 1, and either half can be
shown alone, as in its Table 3.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from core.arrays import Array, Array32
from core.channels import CHANNEL_INDEX, CHANNELS, N_CHANNELS, cht_name, egt_name
from core.clock import DT_S
from core.cylinders import CYLINDERS
from core.residual.window import WINDOW_STEPS
from core.twin.plan import Conditions
from core.twin.trajectory import Pair

N_FEATURES = 2 * N_CHANNELS

Inputs = Literal["both", "residuals", "states"]
"""Which half of the 46 channels a classifier is shown."""

FEATURE_ROWS: dict[Inputs, slice] = {
    "both": slice(0, N_FEATURES),
    "residuals": slice(0, N_CHANNELS),
    "states": slice(N_CHANNELS, N_FEATURES),
}


def n_features(inputs: Inputs) -> int:
    """How many channels that is."""
    rows = FEATURE_ROWS[inputs]
    return int(rows.stop - rows.start)


POOL_STEPS = 10
"""Samples whose mean is one step of what the classifiers see: 0.2 s.

Faults of the FMEA change an engine over seconds to minutes, sensor noise from sample to sample:
means lose nothing of the one and two thirds of the other. Taken before anything that is not linear,
they also leave a tenth of the multiplications. The window stays the paper's 1,500 samples.
"""

WINDOW_POOLED = WINDOW_STEPS // POOL_STEPS
POOLED_A_SECOND = round(1.0 / (POOL_STEPS * DT_S))

QUARTILES_PER_SD = 1.349
"""How many standard deviations lie between the quartiles of a normal distribution."""

NOISE_SD = np.array([channel.noise_sd for channel in CHANNELS])

COMPRESSION = 0.1
"""Where the residual scale turns from linear to logarithmic, in white-noise deviations.

A plugged baffle lifts one CHT by 3 degF, a dead engine drops an EGT by 800: over the faults and
the time since the onset, residuals span six decades of the sensor's noise. ``asinh(r / s)`` keeps
the sign, is linear below ``s`` and logarithmic above, so that a ratio of two channels, which is
what tells many faults apart, becomes a difference whatever the severity.
"""

SHAPE_GAIN = 10.0
MIRROR_SHAPE_GAIN = 30.0
"""How much the course of a channel within its window is magnified; the mirror's residual, which has
no noise, can take more of it.

A plugged and a cracked baffle heat the same head by the same few degrees; only the course differs,
a step that levels off or a growth that goes on. Within 30 s that is a tenth of the level or less,
and the network, which averages over the window, would hardly see it. So each channel is split
into its mean over the window, kept, and its departure from that mean, magnified.
"""

MIN_RESIDUAL_SD = 0.1
MIN_SENSOR_SD = 1e-3
"""Floors of the divisors, so that a channel that no fault moves is not blown up."""


SURROGATE_COMPRESSION = 0.1
"""The same for surrogate residuals, in thousandths of the sensor's range: above their noise."""


@dataclass(frozen=True, slots=True, eq=False)
class FeatureMode:
    """One way to form residuals, titled as in Table 1 of the paper.

    ``residual`` maps any stretch of a flight, (n, 23) channels of it and of its mirror, to (n, 23);
    None where it needs the flight's past, as the surrogate does. ``inputs`` is what the paper
    shows of this mode. ``scale``, (23,), ``gain`` and ``contrast`` are those of `Normalisation`.
    Where it is ``debiased``, the mean over the first 30 s of a recording, `baseline`, is taken off
    first.
    """

    name: str
    title: str
    inputs: Inputs
    scale: Array
    gain: float
    residual: Callable[[Pair], Array32] | None
    debiased: bool = False
    contrast: float = 0.0

    def identity(self) -> list[Any]:
        """All that the features of a residual depend on, JSON-ready."""
        return [self.name, self.scale.tolist(), self.gain, self.debiased, self.contrast]


def _differences(pair: Pair) -> Array32:
    """Each reading minus the one before, (n, 23); the first row is 0."""
    differences = np.zeros_like(pair.faulted.channels)
    np.subtract(pair.faulted.channels[1:], pair.faulted.channels[:-1], out=differences[1:])
    return differences


def pooled(rows: Array32) -> Array32:
    """Means of `POOL_STEPS` rows each, (n, k) -> (n // POOL_STEPS, k); a rest is left out."""
    n = len(rows) // POOL_STEPS
    means: Array32 = rows[: n * POOL_STEPS].reshape(n, POOL_STEPS, rows.shape[1]).mean(axis=1)
    return means


def _nothing(pair: Pair) -> Array32:
    return np.zeros_like(pair.faulted.channels)


FEATURE_MODES: dict[str, FeatureMode] = {
    mode.name: mode
    for mode in (
        FeatureMode(
            "paired", "Paired-mirror residuals", "both",
            COMPRESSION * NOISE_SD, MIRROR_SHAPE_GAIN, lambda pair: pair.residual,
        ),
        FeatureMode(
            "surrogate", "GRU surrogate prediction residuals", "both",
            np.full(N_CHANNELS, SURROGATE_COMPRESSION), SHAPE_GAIN, None,
        ),
        FeatureMode("raw", "Raw states", "states", NOISE_SD, SHAPE_GAIN, _nothing),
        FeatureMode(
            "differencing", "Simple differencing", "residuals",
            NOISE_SD, SHAPE_GAIN, _differences,
        ),
    )
}  # fmt: skip
"""The two residuals are shown beside the sensors; the other two stand for themselves."""

FIELD_COMPRESSION = 5.0
"""Where sensors and mirror have noise of their own, there is nothing to see far below it."""

FIELD_SHAPE_GAIN = 1.0
"""Nor is there in the course within a window, which noise would fill if it were magnified."""

FIELD_CONTRAST = 0.9
"""A gust, a hand on the throttle or a wrong forecast moves all four cylinders, a fault mostly one.

What they have in common is therefore shown small. Not at nothing, or else a fault of all four, such
as a leaking baffle seal, would not be seen.
"""

CYLINDER_COLUMNS = tuple(
    np.array([CHANNEL_INDEX[name(cylinder)] for cylinder in CYLINDERS])
    for name in (cht_name, egt_name)
)
"""Columns of the channels that every cylinder has, (4,) for each."""


def contrasted(residual: Array32, share: float) -> Array32:
    """Residuals (n, 23) with each cylinder less that share of the mean of the four."""
    contrasts = residual.copy()
    for columns in CYLINDER_COLUMNS:
        contrasts[:, columns] -= share * residual[:, columns].mean(axis=1, keepdims=True)
    return contrasts


def feature_mode(name: str, conditions: Conditions) -> FeatureMode:
    """The mode of that name as it is formed in those conditions.

    In field no mirror is this very aircraft: its engine and its sensors differ by a little that
    lasts, which is taken off as the surrogate's is (paper section 4.2), and what its weather and
    its pilot do to all cylinders alike is shown small.
    """
    mode = FEATURE_MODES[name]
    if name == "paired" and conditions == "field":
        return replace(
            mode,
            scale=FIELD_COMPRESSION * NOISE_SD,
            gain=FIELD_SHAPE_GAIN,
            debiased=True,
            contrast=FIELD_CONTRAST,
        )
    return mode


def baseline(mode: FeatureMode, pair: Pair) -> Array32:
    """The mean residual of a recording's first 30 s, taken to be healthy, (23,)."""
    assert mode.residual is not None
    mean: Array32 = mode.residual(pair[:WINDOW_STEPS]).mean(axis=0)
    return mean


@dataclass(frozen=True, slots=True, eq=False)
class Normalisation:
    """Constants that bring 46 channels to comparable size; all (23,) and from training data only.

    A `pooled` residual r, `contrasted` first, is compressed, c = asinh(r / residual_scale); with
    its mean m over the window it becomes ``m / residual_sd + asinh(shape_gain (c - m))``: no
    centring, so that a residual of exactly zero stays zero. A sensor value x is treated alike, c =
    asinh((x - sensor_mean) / sensor_sd) becoming ``m + asinh(sensor_gain (c - m))``; mean and
    deviation are those of the middle half of the training data, or else a few dead engines would
    set the scale for all.
    """

    residual_scale: Array
    residual_sd: Array
    shape_gain: Array
    sensor_mean: Array
    sensor_sd: Array
    sensor_gain: Array
    contrast: float = 0.0

    @classmethod
    def fitted(cls, flights: Iterable[tuple[Array32, Array32]], mode: FeatureMode) -> Self:
        """From (residual, sensors) arrays, (n, 23) each, of the training flights."""
        count, squares = 0, np.zeros(N_CHANNELS)
        seen = []
        for residual, sensors in flights:
            steps = contrasted(pooled(residual), mode.contrast)
            count += len(steps)
            squares += np.square(np.arcsinh(steps / mode.scale)).sum(axis=0)
            seen.append(pooled(sensors)[::POOLED_A_SECOND])  # enough to find quartiles
        low, middle, high = np.percentile(np.concatenate(seen), (25, 50, 75), axis=0)
        return cls(
            residual_scale=mode.scale,
            residual_sd=np.maximum(np.sqrt(squares / count), MIN_RESIDUAL_SD),
            shape_gain=np.full(N_CHANNELS, mode.gain),
            sensor_mean=middle,
            sensor_sd=np.maximum((high - low) / QUARTILES_PER_SD, MIN_SENSOR_SD),
            sensor_gain=np.full(N_CHANNELS, SHAPE_GAIN),
            contrast=mode.contrast,
        )

    def features(
        self, residual: Array32, sensors: Array32, inputs: Inputs = "both"
    ) -> NDArray[np.float32]:
        """Of one window's (n, 23) residuals and sensors: (46, n / 10) float32, residuals first.

        With ``inputs`` other than both, only that half, (23, n / 10).
        """
        features = np.full(
            (n_features(inputs), len(residual) // POOL_STEPS), np.nan, dtype=np.float32
        )
        if inputs != "states":
            steps = contrasted(pooled(residual), self.contrast)
            compressed = np.arcsinh(steps / self.residual_scale)
            level = compressed.mean(axis=0)
            shape = np.arcsinh(self.shape_gain * (compressed - level))
            features[:N_CHANNELS] = (level / self.residual_sd + shape).T
        if inputs != "residuals":
            compressed = np.arcsinh((pooled(sensors) - self.sensor_mean) / self.sensor_sd)
            level = compressed.mean(axis=0)
            shape = np.arcsinh(self.sensor_gain * (compressed - level))
            features[-N_CHANNELS:] = (level + shape).T
        return features

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values, in channel order; `from_dict` reads them back."""
        constants = {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name in self.__dataclass_fields__
            for value in (getattr(self, name),)
        }
        return {"pool_steps": POOL_STEPS, **constants}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Self:
        """Read what `to_dict` wrote; raises `ValueError` where steps were pooled otherwise."""
        if values["pool_steps"] != POOL_STEPS:
            raise ValueError(f"{values['pool_steps']} samples were pooled, not {POOL_STEPS}")
        arrays = [name for name in cls.__dataclass_fields__ if name != "contrast"]
        return cls(
            contrast=float(values.get("contrast", 0.0)),
            **{name: np.asarray(values[name]) for name in arrays},
        )

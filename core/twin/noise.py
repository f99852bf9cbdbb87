"""Sensor noise: white in lab; white, slowly wandering and partly shared in field.

The levels of lab are those of the logged channels (``core.channels``). In field they are those of
the sensors alone: gusts, the pilot's hand and the heat of the engine reach the channels through
the physics, and the avionics (``core.twin.avionics``) smooth and step what the sensors read, so
that all of it together gives the measured levels. That is checked by ``mirrortwin experiment
realism``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.channels import CHANNEL_INDEX, CHANNELS, N_CHANNELS
from core.clock import DT_S
from core.twin.avionics import EXHAUSTS, HEADS
from core.twin.conditions import Setting
from core.twin.hand import Wander

Array = NDArray[np.float64]

_LAB_WHITE_SD = np.array([channel.noise_sd for channel in CHANNELS])


@dataclass(frozen=True, slots=True)
class Sensor:
    """How noisy the sensors of one kind are: white sd, and the sd of a smooth wander.

    The wander is a critically damped second-order process. ``spread`` is by how much both differ
    between two aircraft, the sd of their logarithm.
    """

    channels: tuple[str, ...]
    white_sd: float
    wander_sd: float = 0.0
    wander_tau_s: float = 1.0
    spread: float = 0.15


SENSORS: tuple[Sensor, ...] = (
    Sensor(("volt1", "volt2"), 0.010, 0.012, 15.0, spread=0.3),
    Sensor(("amp1", "amp2"), 0.040, 0.012, 15.0, spread=0.2),
    # Floats in sloshing fuel.
    Sensor(("FQtyL", "FQtyR"), 0.20, 0.09, 4.0, spread=0.3),
    Sensor(("E1 FFlow",), 0.045, 0.025, 1.0),
    Sensor(("E1 OilT",), 0.09, 0.4, 30.0, spread=0.3),
    Sensor(("E1 OilP",), 0.25),
    Sensor(("E1 RPM",), 1.3, 3.4, 2.0, spread=0.2),
    Sensor(HEADS, 0.07, 0.01, 3.0, spread=0.3),
    # No two combustions are alike; No. 4 is the steadiest in every log.
    Sensor(EXHAUSTS[:1], 0.19, 1.0, 1.9),
    Sensor(EXHAUSTS[1:2], 0.13, 1.0, 1.9),
    Sensor(EXHAUSTS[2:3], 0.16, 1.0, 1.9),
    Sensor(EXHAUSTS[3:], 0.06, 0.9, 1.8),
    Sensor(("OAT",), 0.3, 0.08, 15.0, spread=0.3),
    Sensor(("IAS",), 0.25),
    Sensor(("VSpd",), 20.0),
    Sensor(("NormAc",), 0.010, spread=0.3),
    Sensor(("AltMSL",), 0.25),
)

SHARED: tuple[tuple[tuple[str, ...], float], ...] = (
    (("volt1", "volt2"), 0.6),
    (("amp1", "amp2"), 0.3),
)
"""Channels on one converter and the share of their white noise that it brings."""

_SETTLING_STEPS = 6000
"""Steps after which the wander has forgotten that it started at zero (120 s)."""


class SensorNoise:
    """The noise of one aircraft's sensors; the stream does not depend on how it is cut."""

    def __init__(self, setting: Setting) -> None:
        """The noise that the setting names; none where it names none."""
        self._rng = None if setting.noise_stream is None else _stream(setting.noise_stream)
        self._field = None
        if self._rng is not None and setting.is_field:
            self._field = _FieldNoise(self._rng, setting.airframe.noise_rank)

    def next(self, n: int) -> Array:
        """The next n samples of additive noise, (n, 23)."""
        if self._rng is None:
            return np.zeros((n, N_CHANNELS))
        if self._field is not None:
            return self._field.next(n)
        white: Array = self._rng.standard_normal((n, N_CHANNELS)) * _LAB_WHITE_SD
        return white


def _stream(seed: tuple[int, int]) -> np.random.Generator:
    return np.random.default_rng(seed)


class _FieldNoise:
    """White noise and wander of the sensors of one aircraft."""

    def __init__(self, rng: np.random.Generator, noise_rank: Array) -> None:
        self._rng = rng
        noisiness = np.exp(_per_channel("spread") * noise_rank)
        self._white_sd = noisiness * _per_channel("white_sd")
        self._wanders: list[tuple[list[int], Wander]] = []
        for sensor in SENSORS:
            if sensor.wander_sd:
                columns = [CHANNEL_INDEX[name] for name in sensor.channels]
                sd = sensor.wander_sd * noisiness[columns]
                self._wanders.append((columns, Wander(sd, sensor.wander_tau_s, DT_S)))
        self._n_draws = N_CHANNELS + sum(len(columns) for columns, _ in self._wanders)
        self.next(_SETTLING_STEPS)

    def next(self, n: int) -> Array:
        draws = self._rng.standard_normal((n, self._n_draws))
        white = draws[:, :N_CHANNELS]
        for names, share in SHARED:
            first, *others = (CHANNEL_INDEX[name] for name in names)
            own = np.sqrt(1.0 - share**2)
            white[:, others] = share * white[:, [first]] + own * white[:, others]
        noise: Array = white * self._white_sd
        drawn = N_CHANNELS
        for columns, wander in self._wanders:
            k = len(columns)
            noise[:, columns] += wander(draws[:, drawn : drawn + k])
            drawn += k
        return noise


def _per_channel(level: str) -> Array:
    """One of the levels of `SENSORS` by channel, (23,)."""
    levels = np.zeros(N_CHANNELS)
    for sensor in SENSORS:
        levels[[CHANNEL_INDEX[name] for name in sensor.channels]] = getattr(sensor, level)
    return levels

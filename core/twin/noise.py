"""Sensor noise: white in lab; white, slowly wandering and partly shared in field.

The levels of lab are those of the logged channels (``core.channels``). In field they are those of
the sensors alone: gusts, the pilot's hand and the heat of the engine reach the channels through
the physics, and the avionics (``core.twin.avionics``) smooth and step what the sensors read, so
that all of it together gives the measured levels. That is checked by ``mirrortwin experiment
realism``.
"""

from itertools import groupby

import numpy as np

from core.arrays import Array
from core.channels import CHANNEL_INDEX, CHANNELS, N_CHANNELS
from core.clock import DT_S
from core.twin.conditions import Setting
from core.twin.hand import Wander

_LAB_WHITE_SD = np.array([channel.noise_sd for channel in CHANNELS])


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
        noisiness = np.exp(np.array([one.field.spread for one in CHANNELS]) * noise_rank)
        self._white_sd = noisiness * np.array([one.field.white_sd for one in CHANNELS])
        self._wanders: list[tuple[list[int], Wander]] = []
        wandering = [index for index, one in enumerate(CHANNELS) if one.field.wander_sd]
        for tau_s, group in groupby(wandering, lambda index: CHANNELS[index].field.wander_tau_s):
            columns = list(group)
            sd = np.array([CHANNELS[index].field.wander_sd for index in columns])
            self._wanders.append((columns, Wander(sd * noisiness[columns], tau_s, DT_S)))
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

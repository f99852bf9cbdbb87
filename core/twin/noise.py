"""Sensor noise: white in lab; white, slowly wandering and stepped as logged in field.

Levels are those of real logs (``core.channels``). Gusts reach IAS, RPM, VSpd, AltMSL and NormAc
through JSBSim, so in field the sensor itself adds only part of the measured level there.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from core.channels import CHANNEL_INDEX, CHANNELS, N_CHANNELS
from core.twin.conditions import Setting
from core.twin.plan import DT_S

Array = NDArray[np.float64]

_WHITE_SD = np.array([channel.noise_sd for channel in CHANNELS])
_WANDER_SD = np.array([channel.wander_sd for channel in CHANNELS])
_WANDER_TAU_S = np.array([channel.wander_tau_s for channel in CHANNELS])
_WANDER_KEEP = np.exp(-DT_S / _WANDER_TAU_S)
_RESOLUTION = np.array([channel.resolution for channel in CHANNELS])

# Share of the measured (white, wander) level that the sensor adds where something else, mostly the
# gusts, brings the rest.
_SENSOR_SHARE = {
    "IAS": (0.25, 0.0),
    "VSpd": (0.25, 0.0),
    "NormAc": (0.5, 0.0),
    "AltMSL": (0.9, 0.0),
    "E1 RPM": (1.0, 0.85),
    # Steps of 0.1 bring most of what the log shows.
    "volt1": (0.35, 0.0),
    "volt2": (0.35, 0.0),
    "amp1": (0.7, 0.0),
    "amp2": (0.7, 0.0),
}


def _sensor_levels() -> tuple[Array, Array]:
    """White and wander sd that the sensor itself adds in field, (23,) each.

    The measured white level is a second difference at 1 Hz, to which the wander contributes
    sd**2 (6 - 8 r1 + 2 r2) / 6 with its correlations r1, r2 over one and two seconds.
    """
    white, wander = _WHITE_SD.copy(), _WANDER_SD.copy()
    for name, (white_share, wander_share) in _SENSOR_SHARE.items():
        white[CHANNEL_INDEX[name]] *= white_share
        wander[CHANNEL_INDEX[name]] *= wander_share
    r1, r2 = ((1.0 + s / _WANDER_TAU_S) * np.exp(-s / _WANDER_TAU_S) for s in (1.0, 2.0))
    from_wander = wander**2 * (6.0 - 8.0 * r1 + 2.0 * r2) / 6.0
    return np.sqrt(np.maximum(white**2 - from_wander, (0.2 * white) ** 2)), wander


_FIELD_WHITE_SD, _FIELD_WANDER_SD = _sensor_levels()
# Two equal first-order stages of unit white input have this variance.
_KICK_SD = _FIELD_WANDER_SD * np.sqrt((1.0 - _WANDER_KEEP**2) ** 3 / (1.0 + _WANDER_KEEP**2))

_CHT1 = CHANNEL_INDEX["E1 CHT1"]
_OTHER_CHT = slice(_CHT1 + 1, _CHT1 + 4)
_COMMON_HEAD_SHARE = 0.9
"""The heads wander together: one engine under one cowling (CHT pairs correlate 0.7-0.96)."""

_SETTLING_STEPS = 1000
"""Steps after which the wander has forgotten that it started at zero (20 s)."""


class SensorNoise:
    """The noise of one aircraft's sensors; the stream does not depend on how it is cut."""

    def __init__(self, setting: Setting) -> None:
        """The noise that the setting names; none where it names none."""
        self._is_field = setting.is_field
        self._rng = None if setting.noise_stream is None else _stream(setting.noise_stream)
        self._stages = np.zeros((2, N_CHANNELS))
        if self._rng is not None and self._is_field:
            self._wandering(self._rng.standard_normal((_SETTLING_STEPS, N_CHANNELS)))

    def next(self, n: int) -> Array:
        """The next n samples of additive noise, (n, 23)."""
        if self._rng is None:
            return np.zeros((n, N_CHANNELS))
        if not self._is_field:
            white: Array = self._rng.standard_normal((n, N_CHANNELS)) * _WHITE_SD
            return white
        draws = self._rng.standard_normal((n, 2 * N_CHANNELS))
        noise: Array = draws[:, :N_CHANNELS] * _FIELD_WHITE_SD + self._wandering(
            draws[:, N_CHANNELS:]
        )
        return noise

    def _wandering(self, draws: Array) -> Array:
        """Wander of each channel, (n, 23): white noise through two equal first-order stages."""
        own_share = np.sqrt(1.0 - _COMMON_HEAD_SHARE**2)
        draws[:, _OTHER_CHT] = (
            _COMMON_HEAD_SHARE * draws[:, [_CHT1]] + own_share * draws[:, _OTHER_CHT]
        )
        wander = draws * _KICK_SD
        for column, keep in enumerate(_WANDER_KEEP):
            for stage in self._stages:
                state = np.array([keep * stage[column]])
                wander[:, column], _ = lfilter([1.0], [1.0, -keep], wander[:, column], zi=state)
                stage[column] = wander[-1, column]
        wandering: Array = wander
        return wandering


def _stream(seed: tuple[int, int]) -> np.random.Generator:
    return np.random.default_rng(seed)


def as_logged(channels: Array, setting: Setting) -> Array:
    """Channels as the log keeps them: in steps of the channel's resolution in field."""
    if not setting.is_field:
        return channels
    stepped: Array = np.round(channels / _RESOLUTION) * _RESOLUTION
    return stepped

"""From the sensor to the log: converter steps, smoothing and decimals of the Garmin avionics.

Field only; in lab a channel is what its sensor reads (paper section 3.1). What the parts do was
read from real logs: which steps their values move in, how a step is approached, and what several
channels do at the same instant.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter
from scipy.stats import norm

from core.arrays import Array
from core.channels import CHANNEL_INDEX, CHANNELS, cht_name, egt_name
from core.clock import DT_S
from core.cylinders import CYLINDERS
from core.twin.conditions import Setting


@dataclass(frozen=True, slots=True)
class Chain:
    """What channels of one kind go through: converter step, then lag, then reporting step.

    A step of 0 leaves the value as it is.
    """

    channels: tuple[str, ...]
    smoothing_s: float
    converter_step: float = 0.0
    report_step: float = 0.0


HEADS = tuple(cht_name(cylinder) for cylinder in CYLINDERS)
EXHAUSTS = tuple(egt_name(cylinder) for cylinder in CYLINDERS)

CHAINS: tuple[Chain, ...] = (
    Chain(HEADS, smoothing_s=0.5, converter_step=0.14),
    Chain(("E1 OilT",), smoothing_s=3.0, converter_step=0.1),
    # The probe lags in its housing; the display computer reports quarters of a degree.
    Chain(("OAT",), smoothing_s=5.0, report_step=0.25),
    # The senders resolve a few hundredths of a gallon.
    Chain(("FQtyL", "FQtyR"), smoothing_s=1.0, report_step=0.04),
    # Static and pitot lines, and the air data computer's own smoothing.
    Chain(("VSpd",), smoothing_s=1.0),
    Chain(("IAS",), smoothing_s=0.1),
    Chain(("NormAc",), smoothing_s=0.06),
)

JUNCTION_STEP_DEGF = 0.1
JUNCTION_WANDER_DEGF, JUNCTION_WANDER_TAU_S = 0.15, 60.0
JUNCTION_WHITE_DEGF = 0.006
JUNCTION_TURN_DEGF, JUNCTION_TURN_S = 0.008, 2.0
JUNCTION_SPIKE_SHARE, JUNCTION_SPIKE_DEGF = 0.006, 0.6
"""All thermocouples are read against one cold junction, whose reading flickers between two codes
and now and then is off by more: real CHT agree in 97 % of what they do within a second."""

_STEP = np.array([channel.resolution for channel in CHANNELS])
_PER_STEP = 1.0 / _STEP


class Avionics:
    """The avionics of one flight, fed with consecutive blocks of what its sensors read."""

    def __init__(self, setting: Setting) -> None:
        """Settled on the first reading, as after a long steady flight."""
        self._stages = [_Stage(chain) for chain in CHAINS] if setting.is_field else []
        self._junction = None
        if setting.is_field and setting.noise_stream is not None:
            self._junction = _ColdJunction(setting.noise_stream)

    def log(self, readings: Array) -> Array:
        """The log (n, 23) of readings (n, 23)."""
        if not self._stages:
            return readings
        logged = readings.copy()  # what a sensor read is not changed by logging it
        for stage in self._stages:
            logged[:, stage.columns] = stage(readings[:, stage.columns])
        if self._junction is not None:
            logged[:, _THERMOCOUPLES] += self._junction.next(len(readings))[:, None]
        logged *= _PER_STEP
        np.rint(logged, out=logged)
        logged *= _STEP
        return logged


_THERMOCOUPLES = [CHANNEL_INDEX[name] for name in HEADS + EXHAUSTS]


class _ColdJunction:
    """What the reference junction adds to every thermocouple."""

    def __init__(self, stream: tuple[int, int]) -> None:
        self._rng = np.random.default_rng([*stream, 0xC01D])
        self._keep = float(np.exp(-DT_S / JUNCTION_WANDER_TAU_S))
        self._samples = 0
        start = self._rng.normal(0.0, JUNCTION_WANDER_DEGF)
        self._state = np.array([self._keep * start])

    def next(self, n: int) -> Array:
        draws = self._rng.standard_normal((n, 3))
        kick = JUNCTION_WANDER_DEGF * np.sqrt(1.0 - self._keep**2)
        warmth, self._state = lfilter([kick], [1.0, -self._keep], draws[:, 0], zi=self._state)
        time_s = (self._samples + np.arange(n)) * DT_S
        self._samples += n
        turn = np.where(time_s % JUNCTION_TURN_S < JUNCTION_TURN_S / 2.0, 1.0, -1.0)
        felt = warmth + JUNCTION_TURN_DEGF * turn + JUNCTION_WHITE_DEGF * draws[:, 1]
        codes = _stepped(felt, JUNCTION_STEP_DEGF)
        spikes = np.abs(draws[:, 2]) > _SPIKE_QUANTILE
        off: Array = codes + np.where(spikes, np.sign(draws[:, 2]) * JUNCTION_SPIKE_DEGF, 0.0)
        return off


_SPIKE_QUANTILE = float(norm.isf(JUNCTION_SPIKE_SHARE / 2.0))


class _Stage:
    def __init__(self, chain: Chain) -> None:
        self.columns = [CHANNEL_INDEX[name] for name in chain.channels]
        self._chain = chain
        self._keep = float(np.exp(-DT_S / chain.smoothing_s))
        self._state: Array | None = None

    def __call__(self, readings: Array) -> Array:
        """Readings (n, k) on their way to the log, (n, k)."""
        codes = _stepped(readings, self._chain.converter_step)
        if self._state is None:
            self._state = self._keep * codes[:1]
        smooth, self._state = lfilter(
            [1.0 - self._keep], [1.0, -self._keep], codes, axis=0, zi=self._state
        )
        return _stepped(smooth, self._chain.report_step)


def _stepped(values: Array, step: float) -> Array:
    return np.round(values / step) * step if step else values

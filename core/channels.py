"""The 23 logged channels: the one table of names, units, limits and noise.

Names and order are those of the NGAFID benchmark (Garmin G1000 logs). Limits are those of a
Cessna 172P with an O-320-D2J (green arc and red lines; ``assets/facts/fmea.md`` section 1).
``noise_sd`` is the white noise measured in real logs at 1 Hz (section 5 there), ``wander_sd`` the
slow wander on top of it and ``wander_tau_s`` the time constant of a critically damped second-order
process with the measured correlation r between seconds, (1 + 1/tau) exp(-1/tau) = r;
``full_scale`` is the span of the gauge, used for the 1 % floor of the residual normalisation
(paper section 4.2).
"""

from dataclasses import dataclass
from typing import Literal

from core.cylinders import CYLINDERS as CYLINDERS

Subsystem = Literal["electrical", "fuel", "oil", "engine", "flight"]


_UNIT_LABELS = {"degF": "°F", "degC": "°C", "deg": "°", "fpm": "ft/min", "gph": "gal/h"}


def unit_label(unit: str) -> str:
    """A unit as printed for people.

    >>> unit_label("degF"), unit_label("psi")
    ('°F', 'psi')
    """
    return _UNIT_LABELS.get(unit, unit)


@dataclass(frozen=True, slots=True)
class Channel:
    """One sensor channel of the log.

    ``green`` is the normal operating range and ``red`` the (low, high) limits, in ``unit``;
    ``None`` where the aircraft has none. ``resolution`` is the step of the real log.
    """

    name: str
    unit: str
    label: str
    subsystem: Subsystem
    full_scale: float
    noise_sd: float
    wander_sd: float
    wander_tau_s: float
    resolution: float
    decimals: int
    green: tuple[float, float] | None = None
    red: tuple[float | None, float | None] = (None, None)


def _cht(cylinder: int) -> Channel:
    return Channel(
        f"E1 CHT{cylinder}", "degF", f"CHT {cylinder}", "engine",
        400.0, 0.025, 0.2, 2.5, 0.01, 1, (150.0, 400.0), (None, 500.0),
    )  # fmt: skip


def _egt(cylinder: int) -> Channel:
    return Channel(
        f"E1 EGT{cylinder}", "degF", f"EGT {cylinder}", "engine",
        1000.0, 0.25, 1.2, 1.6, 0.01, 0, (1200.0, 1600.0),
    )  # fmt: skip


CHANNELS: tuple[Channel, ...] = (
    # name, unit, label, subsystem, full scale, white sd, wander sd, wander tau s, step, decimals
    Channel("volt1", "V", "Main bus", "electrical", 10.0, 0.027, 0.0, 1.0, 0.1, 1,
            (25.0, 29.0), (24.5, 32.0)),
    Channel("volt2", "V", "Essential bus", "electrical", 10.0, 0.027, 0.0, 1.0, 0.1, 1,
            (25.0, 29.0), (24.5, 32.0)),
    Channel("amp1", "A", "Battery current", "electrical", 60.0, 0.061, 0.0, 1.0, 0.1, 1,
            (-2.0, 30.0)),
    Channel("amp2", "A", "Standby battery current", "electrical", 10.0, 0.061, 0.0, 1.0, 0.1, 1,
            (-2.0, 2.0)),
    Channel("FQtyL", "gal", "Fuel left", "fuel", 27.0, 0.024, 0.042, 1.05, 0.01, 1,
            (3.0, 27.0)),
    Channel("FQtyR", "gal", "Fuel right", "fuel", 27.0, 0.024, 0.042, 1.05, 0.01, 1,
            (3.0, 27.0)),
    Channel("E1 FFlow", "gph", "Fuel flow", "fuel", 20.0, 0.048, 0.02, 0.4, 0.01, 2,
            (0.0, 12.0)),
    Channel("E1 OilT", "degF", "Oil temperature", "oil", 200.0, 0.006, 0.032, 3.0, 0.01, 1,
            (100.0, 245.0), (None, 245.0)),
    Channel("E1 OilP", "psi", "Oil pressure", "oil", 115.0, 0.25, 0.0, 1.0, 0.01, 1,
            (60.0, 90.0), (25.0, 115.0)),
    Channel("E1 RPM", "rpm", "Engine speed", "engine", 2700.0, 1.5, 5.0, 1.2, 0.1, 0,
            (2100.0, 2700.0), (None, 2700.0)),
    *map(_cht, CYLINDERS),
    *map(_egt, CYLINDERS),
    Channel("OAT", "degC", "Outside air", "flight", 80.0, 0.027, 0.05, 1.1, 0.1, 1),
    Channel("IAS", "kt", "Airspeed (IAS)", "flight", 160.0, 0.15, 0.5, 1.2, 0.01, 1,
            (44.0, 127.0), (None, 158.0)),
    Channel("VSpd", "fpm", "Vertical speed", "flight", 4000.0, 7.7, 40.0, 1.4, 0.01, 0),
    Channel("NormAc", "g", "Normal acceleration", "flight", 2.0, 0.018, 0.008, 0.3, 0.01, 2,
            None, (-1.52 - 1.0, 3.8 - 1.0)),
    Channel("AltMSL", "ft", "Altitude", "flight", 10000.0, 0.3, 3.2, 2.3, 0.1, 0),
)  # fmt: skip

CHANNEL_NAMES: tuple[str, ...] = tuple(channel.name for channel in CHANNELS)
CHANNEL_INDEX: dict[str, int] = {name: index for index, name in enumerate(CHANNEL_NAMES)}
N_CHANNELS = len(CHANNELS)


def channel(name: str) -> Channel:
    """The channel of that name; raises ``KeyError`` for an unknown one."""
    return CHANNELS[CHANNEL_INDEX[name]]


def cht_name(cylinder: int) -> str:
    """The CHT channel of a cylinder (numbered as in `core.cylinders`)."""
    return f"E1 CHT{cylinder}"


def egt_name(cylinder: int) -> str:
    """The EGT channel of a cylinder (numbered as in `core.cylinders`)."""
    return f"E1 EGT{cylinder}"

"""The logged channels: the one table of names, units, limits, gauges and noise.

The table is ``assets/data/channels.toml``, whose head says what each entry means; it is checked
when this module is imported.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from core.cylinders import CYLINDERS, N_CYLINDERS
from core.errors import InputError
from core.files import read_toml
from core.paths import DATA

Subsystem = Literal["electrical", "fuel", "oil", "engine", "flight"]


_UNIT_LABELS = {"degF": "°F", "degC": "°C", "deg": "°", "fpm": "ft/min", "gph": "gal/h"}


def unit_label(unit: str) -> str:
    """A unit as printed for people.

    >>> unit_label("degF"), unit_label("psi")
    ('°F', 'psi')
    """
    return _UNIT_LABELS.get(unit, unit)


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """The noise of a sensor in field flights: white sd, and the sd of a smooth wander.

    The wander is a critically damped second-order process. ``spread`` is by how much both differ
    between two aircraft, the sd of their logarithm.
    """

    white_sd: float
    spread: float
    wander_sd: float = 0.0
    wander_tau_s: float = 1.0


@dataclass(frozen=True, slots=True)
class LogColumn:
    """The column of a Garmin G1000 log: its unit, its width in characters, its decimals."""

    unit: str
    width: int
    decimals: int


@dataclass(frozen=True, slots=True)
class Gauge:
    """From where to where the gauge of the engine monitor goes; its limits are the channel's.

    ``low_matters``: whether falling out of the green arc calls for caution.
    """

    low: float
    high: float
    low_matters: bool = True


@dataclass(frozen=True, slots=True)
class Channel:
    """One sensor channel of the log; numbers are in ``unit``.

    ``green`` is the normal operating range and ``red`` the (low, high) limits; ``None`` where the
    aircraft has none. ``noise_sd``, ``wander_sd`` and ``wander_tau_s`` are what real logs do, and
    ``resolution`` is their step. ``full_scale`` is the span of the gauge.
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
    green: tuple[float, float] | None
    red: tuple[float | None, float | None]
    field: SensorNoise
    g1000: LogColumn
    gauge: Gauge | None

    @property
    def sigma(self) -> float:
        """Standard deviation of one healthy reading: white noise and slow wander together."""
        return math.hypot(self.noise_sd, self.wander_sd)


def read_channels(path: Path) -> tuple[Channel, ...]:
    """Read and check a table of channels; raises `InputError` naming the channel."""
    rows = read_toml(path, "channels")
    return tuple(
        _read_channel(name, row, index)
        for name, row in rows.items()
        for index in (range(N_CYLINDERS) if _CYLINDER in name else (0,))
    )


_CYLINDER = "#"


def _read_channel(name: str, row: Any, index: int) -> Channel:
    """The channel of a row; ``index`` is that of the cylinder in a row for each."""
    number = str(CYLINDERS[index])
    try:
        rest = dict(row)
        real = rest.pop("real")
        field = {key: _of_cylinder(value, index) for key, value in rest.pop("field").items()}
        gauge = rest.pop("gauge", None)
        green = rest.pop("green", None)
        read = Channel(
            name=name.replace(_CYLINDER, number),
            label=rest.pop("label").replace(_CYLINDER, number),
            noise_sd=real["noise_sd"],
            wander_sd=real["wander_sd"],
            wander_tau_s=real["wander_tau_s"],
            resolution=real["step"],
            green=None if green is None else (green[0], green[1]),
            red=(rest.pop("red_low", None), rest.pop("red_high", None)),
            field=SensorNoise(**field),
            g1000=LogColumn(**rest.pop("g1000")),
            gauge=None if gauge is None else Gauge(**gauge),
            **rest,
        )
    except KeyError as error:
        raise InputError(f"channels.{name}.{error.args[0]}", "is missing") from None
    except (AttributeError, IndexError, TypeError, ValueError) as error:
        raise InputError(f"channels.{name}", str(error)) from None
    if read.subsystem not in get_args(Subsystem):
        known = ", ".join(get_args(Subsystem))
        raise InputError(f"channels.{name}.subsystem", f"must be one of {known}")
    return read


def _of_cylinder(value: Any, index: int) -> float:
    return float(value[index] if isinstance(value, list) else value)


CHANNELS: tuple[Channel, ...] = read_channels(DATA / "channels.toml")
CHANNEL_NAMES: tuple[str, ...] = tuple(channel.name for channel in CHANNELS)
CHANNEL_INDEX: Mapping[str, int] = {name: index for index, name in enumerate(CHANNEL_NAMES)}
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


def check_covers(what: str, names: Iterable[str]) -> None:
    """Raise `InputError` unless ``names`` are the channels, each once, in any order.

    >>> check_covers("the equations", CHANNEL_NAMES[1:])
    Traceback (most recent call last):
    core.errors.InputError: the equations: volt1 is missing
    """
    given = list(names)
    for name in CHANNEL_NAMES:
        if given.count(name) != 1:
            times = "is missing" if name not in given else "is there twice"
            raise InputError(what, f"{name} {times}")
    for name in given:
        if name not in CHANNEL_INDEX:
            raise InputError(what, f"{name} is not a channel")

"""Logs written for tests, in whatever units, separators and order, and what they say in truth."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from core.channels import CHANNEL_NAMES, CHANNELS

FROM_OURS: Mapping[str, Mapping[str, Callable[[float], float]]] = {
    "degF": {
        "deg F": lambda value: value,
        "deg C": lambda value: (value - 32.0) / 1.8,
        "°C": lambda value: (value - 32.0) / 1.8,
        "degC": lambda value: (value - 32.0) / 1.8,
        "K": lambda value: (value - 32.0) / 1.8 + 273.15,
    },
    "degC": {"deg C": lambda value: value, "°F": lambda value: value * 1.8 + 32.0},
    "psi": {
        "psi": lambda value: value,
        "bar": lambda value: value * 0.0689475729,
        "hPa": lambda value: value * 68.9475729,
        "kPa": lambda value: value * 6.89475729,
    },
    "gph": {
        "gph": lambda value: value,
        "lph": lambda value: value * 3.785411784,
        "l/h": lambda value: value * 3.785411784,
        "gal/hour": lambda value: value,
    },
    "gal": {
        "gals": lambda value: value,
        "litres": lambda value: value * 3.785411784,
        "L": lambda value: value * 3.785411784,
    },
    "ft": {"ft msl": lambda value: value, "m": lambda value: value * 0.3048},
    "kt": {
        "kt": lambda value: value,
        "km/h": lambda value: value * 1.852,
        "m/s": lambda value: value * 1.852 / 3.6,
        "mph": lambda value: value * 1852.0 / 1609.344,
    },
    "fpm": {
        "fpm": lambda value: value,
        "ft/min": lambda value: value,
        "m/s": lambda value: value * 0.3048 / 60.0,
        "m/min": lambda value: value * 0.3048,
    },
    "g": {"G": lambda value: value, "m/s^2": lambda value: value * 9.80665},
    "V": {"volts": lambda value: value, "mV": lambda value: value * 1000.0},
    "A": {"amps": lambda value: value, "mA": lambda value: value * 1000.0},
    "rpm": {"rpm": lambda value: value, "1/min": lambda value: value},
}
"""By our unit: other ways to state it, the device's first, and a reading of ours in each."""
for _channel in CHANNELS:
    FROM_OURS.setdefault(_channel.unit, {_channel.g1000.unit: lambda value: value})

UNIT = {channel.name: channel.unit for channel in CHANNELS}
DEVICE = {name: next(iter(FROM_OURS[UNIT[name]])) for name in CHANNEL_NAMES}
AIRFRAME = '#airframe_info, log_version="1.00", airframe_name="Cessna 172S", mode=NORMAL, '
STEADY = {"IAS": 105.0, "VSpd": 10.0, "E1 RPM": 2400.0, "AltMSL": 3000.5, "NormAc": -0.02}


def truth(name: str, second: int) -> float:
    """A steady cruise in our units, told apart from channel to channel by its level."""
    return STEADY.get(name, 40.0 + CHANNEL_NAMES.index(name)) + 0.001 * second


@dataclass(frozen=True)
class LogText:
    """A small log as text, from 29 October 2014, 10:00:00, a row a second.

    ``units`` replaces the device's for some channels; ``order`` is that of the channels;
    ``point`` stands before the decimals; ``date_cell`` and ``time_cell`` write the clock.
    """

    rows: int = 20
    airframe: str = AIRFRAME
    units: Mapping[str, str] = field(default_factory=dict)
    units_at: str = "above"
    order: tuple[str, ...] = CHANNEL_NAMES
    separator: str = ", "
    point: str = "."
    newline: str = "\n"
    date_cell: str = "2014-10-29"
    date_unit: str = "#yyy-mm-dd"
    clocks: tuple[str, ...] | None = None
    offsets: tuple[str, ...] | None = None

    def cell(self, name: str, second: int) -> str:
        """One reading as the file has it."""
        stated = self.units.get(name, DEVICE[name])
        value = FROM_OURS[UNIT[name]].get(stated, lambda same: same)(truth(name, second))
        return f"{value:.6f}".replace(".", self.point)

    def row(self, second: int) -> str:
        """One line of the table."""
        clock = f"10:{second // 60:02d}:{second % 60:02d}"
        if self.clocks is not None:
            clock = self.clocks[second]
        offset = self.offsets[second] if self.offsets else "-05:00"
        cells = [self.date_cell, clock, offset, *(self.cell(name, second) for name in self.order)]
        return self.separator.join(cells)

    def head(self) -> list[str]:
        """The lines above the rows."""
        stated = [self.units.get(name, DEVICE[name]) for name in self.order]
        units = self.separator.join([self.date_unit, "hh:mm:ss", "hh:mm", *stated])
        named = ["Lcl Date", "Lcl Time", "UTCOfst"]
        if self.units_at == "in the names":
            named += [f"{name} ({unit})" for name, unit in zip(self.order, stated, strict=True)]
        else:
            named += self.order
        names = self.separator.join(named)
        if self.units_at == "above":
            return [self.airframe, units, names]
        return [self.airframe, names, units] if self.units_at == "below" else [self.airframe, names]

    def __str__(self) -> str:
        """The file."""
        lines = [*self.head(), *(self.row(second) for second in range(self.rows))]
        return "".join(line + self.newline for line in lines if line)

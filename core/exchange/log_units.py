"""Units that logs state: what each is in the unit that we log a channel in.

A unit is looked up by the channel's own: ``m/s`` is a speed for the airspeed and a climb for the
vertical speed. One that is not in the table is refused by the reader, never taken for ours.
"""

import re
from dataclasses import dataclass

from core.channels import CHANNELS
from core.units import FOOT_M, GALLON_L, PSI_BAR

_KNOT_KMH = 1.852
_MILE_KM = 1.609344
_STANDARD_G = 9.80665
_IMPERIAL_GALLON_L = 4.54609
_INHG_HPA = 33.8638867


@dataclass(frozen=True, slots=True)
class Scale:
    """A unit and how a reading in it becomes one of ours: ``value * factor + offset``."""

    unit: str
    factor: float = 1.0
    offset: float = 0.0

    @property
    def is_ours(self) -> bool:
        """Whether nothing is to be converted."""
        return self.factor == 1.0 and self.offset == 0.0


_CELSIUS = "c celsius centigrade"
_FAHRENHEIT = "f fahrenheit"

_TABLE: dict[str, tuple[tuple[Scale, str], ...]] = {
    "degF": (
        (Scale("degF"), _FAHRENHEIT),
        (Scale("degC", 1.8, 32.0), _CELSIUS),
        (Scale("K", 1.8, -459.67), "k kelvin"),
    ),
    "degC": (
        (Scale("degC"), _CELSIUS),
        (Scale("degF", 1.0 / 1.8, -32.0 / 1.8), _FAHRENHEIT),
        (Scale("K", 1.0, -273.15), "k kelvin"),
    ),
    "psi": (
        (Scale("psi"), "psi psig lb/in2 lbf/in2"),
        (Scale("bar", 1.0 / PSI_BAR), "bar bars"),
        (Scale("hPa", 1e-3 / PSI_BAR), "hpa mbar"),
        (Scale("kPa", 1e-2 / PSI_BAR), "kpa"),
        (Scale("inHg", _INHG_HPA * 1e-3 / PSI_BAR), "inhg"),
    ),
    "gph": (
        (Scale("gph"), "gph usgph gal/h gal/hr gal/hour gals/h gals/hr gals/hour usgal/h usgal/hr"),
        (Scale("L/h", 1.0 / GALLON_L),
         "lph l/h l/hr l/hour ltr/h ltr/hr liters/h litres/h liters/hour litres/hour"),
    ),
    "gal": (
        (Scale("gal"), "gal gals gallon gallons usg usgal usgals usgallon usgallons"),
        (Scale("L", 1.0 / GALLON_L), "l ltr lit liter liters litre litres"),
        (Scale("imperial gal", _IMPERIAL_GALLON_L / GALLON_L),
         "impgal impgals imperialgal imperialgallons ukgal"),
    ),
    "ft": (
        (Scale("ft"), "ft feet foot ftmsl feetmsl ftamsl"),
        (Scale("m", 1.0 / FOOT_M), "m mt meter meters metre metres mmsl mamsl"),
    ),
    "kt": (
        (Scale("kt"), "kt kts kn knot knots kias"),
        (Scale("km/h", 1.0 / _KNOT_KMH), "km/h kmh kmph kph km/hr km/hour"),
        (Scale("m/s", 3.6 / _KNOT_KMH), "m/s mps m/sec"),
        (Scale("mph", _MILE_KM / _KNOT_KMH), "mph mi/h"),
    ),
    "fpm": (
        (Scale("fpm"), "fpm ft/min feet/min ft/minute ftmin"),
        (Scale("m/s", 60.0 / FOOT_M), "m/s mps m/sec"),
        (Scale("m/min", 1.0 / FOOT_M), "m/min"),
        (Scale("ft/s", 60.0), "ft/s fps ft/sec"),
    ),
    "g": ((Scale("g"), "g gs"), (Scale("m/s2", 1.0 / _STANDARD_G), "m/s2 m/sec2")),
    "V": ((Scale("V"), "v volt volts vdc"), (Scale("mV", 1e-3), "mv")),
    "A": ((Scale("A"), "a amp amps ampere amperes"), (Scale("mA", 1e-3), "ma")),
    "rpm": ((Scale("rpm"), "rpm 1/min r/min rev/min"),),
}  # fmt: skip
"""By our unit: the scale of each that is understood, ours first, and the ways to write it."""


def _plain(stated: str) -> str:
    """A unit without what differs in writing: case, blanks, points, the sign of a degree.

    >>> _plain(" deg C"), _plain("°C"), _plain("US Gal/hr"), _plain("m/s²"), _plain("deg")
    ('c', 'c', 'usgal/hr', 'm/s2', 'deg')
    """
    kept = re.sub(r"[^a-z0-9/]", "", stated.lower().replace("²", "2"))
    return re.sub(r"^deg(rees|ree|s)?(?=.)", "", kept)


_OTHERS: dict[str, tuple[tuple[Scale, str], ...]] = {
    channel.unit: ((Scale(channel.unit), f"{_plain(channel.unit)} {_plain(channel.g1000.unit)}"),)
    for channel in CHANNELS
    if channel.unit not in _TABLE
}
_SCALES = _TABLE | _OTHERS
"""The table, and of a unit of ours that it lacks the one scale that needs no conversion."""

_BY_NAME: dict[str, dict[str, Scale]] = {
    unit: {name: scale for scale, names in scales for name in names.split()}
    for unit, scales in _SCALES.items()
}
_KNOWN = frozenset(name for names in _BY_NAME.values() for name in names)


def scale_of(stated: str, unit: str) -> Scale | None:
    """The scale of a unit as a log states it for a channel in our ``unit``; None if not known.

    >>> scale_of("bar", "psi").unit, scale_of("bar", "degF"), scale_of("deg", "degF")
    ('bar', None, None)
    """
    return _BY_NAME[unit].get(_plain(stated))


def is_unit(text: str) -> bool:
    """Whether this is how some unit of the table is written."""
    return _plain(text) in _KNOWN


def understood(unit: str) -> str:
    """The units understood for a channel in our ``unit``, in words.

    >>> understood("rpm"), understood("degC")
    ('rpm', 'degC, degF or K')
    """
    *first, last = (scale.unit for scale, _ in _SCALES[unit])
    return f"{', '.join(first)} or {last}" if first else last

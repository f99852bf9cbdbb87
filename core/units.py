"""Quantities as people read them: shares in percent, and other units than the logged ones.

Data, limits and files stay in the units of `core.channels`; only what is shown is converted.
"""

import math
from dataclasses import dataclass

from core.channels import unit_label


@dataclass(frozen=True, slots=True)
class OtherUnit:
    """How a reading in ``unit`` is shown instead: ``value * factor + offset``.

    ``quantity`` is what people choose by: units of one quantity change together. ``label`` is the
    other unit as printed.
    """

    quantity: str
    unit: str
    label: str
    factor: float
    offset: float = 0.0

    @property
    def extra_decimals(self) -> int:
        """Digits after the point to add, so that the other unit is about as fine."""
        return math.trunc(-math.log10(self.factor))

    def value(self, logged: float) -> float:
        """A reading in the other unit."""
        return logged * self.factor + self.offset

    def difference(self, logged: float) -> float:
        """A difference between two readings in the other unit: no offset."""
        return logged * self.factor


FOOT_M = 0.3048
GALLON_L = 3.785411784
PSI_BAR = 0.0689475729

OTHER_UNITS: dict[str, OtherUnit] = {
    other.unit: other
    for other in (
        OtherUnit("temperature", "degF", unit_label("degC"), 5.0 / 9.0, -160.0 / 9.0),
        OtherUnit("altitude", "ft", "m", FOOT_M),
        OtherUnit("altitude", "fpm", "m/s", FOOT_M / 60.0),
        OtherUnit("speed", "kt", "km/h", 1.852),
        OtherUnit("pressure", "psi", "bar", PSI_BAR),
        OtherUnit("volume", "gal", "L", GALLON_L),
        OtherUnit("volume", "gph", "L/h", GALLON_L),
    )
}
"""By logged unit. Outside air is logged in degrees Celsius, as pilots read it, and stays so."""

QUANTITIES: tuple[str, ...] = tuple(dict.fromkeys(other.quantity for other in OTHER_UNITS.values()))


def percent(share: float) -> str:
    """A share of 1, such as a probability, in percent; an estimate never reads as 0 or 100 %.

    >>> percent(0.8124), percent(0.0002), percent(0.9999)
    ('81.2 %', '< 0.1 %', '> 99.9 %')
    """
    if share < 0.0005:
        return "< 0.1 %"
    return "> 99.9 %" if share >= 0.9995 else f"{100.0 * share:.1f} %"


def distance_words(distance_m: float) -> str:
    """A distance as pilots and everybody else say it.

    >>> distance_words(70.1), distance_words(4321.0)
    ('230 ft (70 m)', '14,177 ft (4.3 km)')
    """
    metric = f"{distance_m:.0f} m" if distance_m < 1000.0 else f"{distance_m / 1000.0:.1f} km"
    return f"{distance_m / FOOT_M:,.0f} ft ({metric})"

"""Layer 3: the physical intermediate variables between the defects and the sensors.

Paper section 3.2: per-cylinder cooling efficiency and compression, mixture offset, oil volume,
friction, oil-cooler efficiency. The sensor equations receive these and nothing else of a fault.
"""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from core.arrays import Array
from core.fmea.defects import DEFECT_SLICE, N_DEFECTS
from core.fmea.plenum import cooling

FLAME_EXPONENT = 2.5
"""Combustion weakens before it goes out: half the power lost leaves four flames in five."""


@dataclass(frozen=True, slots=True)
class Effects:
    """Intermediate variables over n samples; per-cylinder arrays are (n, 4), others (n,).

    ``cooling_efficiency``, ``cooler_efficiency``: 1 when healthy. ``lean``: relative leaning by
    unmetered air. ``exhaust_leak``, ``charge_loss``,
    ``gas_jet``: shares, 0 when healthy. ``firing``: share of the charges that burn.
    ``oil_lost_qt``: quarts. ``friction``: relative rise.
    """

    cooling_efficiency: Array
    cooler_efficiency: Array
    lean: Array
    exhaust_leak: Array
    charge_loss: Array
    gas_jet: Array
    firing: Array
    oil_lost_qt: Array
    friction: Array

    def held(self, n_each: int, n: int) -> Self:
        """Each sample held over ``n_each`` samples, the first n of them."""
        series = (getattr(self, field.name) for field in fields(self))
        return type(self)(*(np.repeat(values, n_each, axis=0)[:n] for values in series))


def effects_of(defects: Array) -> Effects:
    """The effects of a series of defect vectors, (n, N_DEFECTS)."""

    def whole(name: str) -> Array:
        column: Array = defects[:, DEFECT_SLICE[name]][:, 0]
        return column

    def each(name: str) -> Array:
        columns: Array = defects[:, DEFECT_SLICE[name]]
        return columns

    air = cooling(defects)
    misfire = each("misfire")
    return Effects(
        cooling_efficiency=air.heads,
        cooler_efficiency=air.cooler,
        lean=each("air_leak_lean"),
        exhaust_leak=each("valve_leak"),
        charge_loss=each("charge_loss"),
        gas_jet=each("gas_jet"),
        firing=np.clip((1.0 - whole("power_lost") ** FLAME_EXPONENT)[:, None] - misfire, 0.0, 1.0),
        oil_lost_qt=whole("oil_lost_qt"),
        friction=whole("friction"),
    )


def healthy(n: int) -> Effects:
    """The effects of no defect over n samples."""
    return effects_of(np.zeros((1, N_DEFECTS))).held(n, n)

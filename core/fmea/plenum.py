"""The cooling-air network: inlet, four fin passages, oil cooler, leaks, exit.

Each part is an orifice: flow = area * sqrt(pressure drop). Inlet, deck and exit stand in series,
the fin passages, the cooler and the leaks in parallel between the two decks. With areas A1, A2,
A3 the deck takes (1/A2^2) / (1/A1^2 + 1/A2^2 + 1/A3^2) of the pressure drop. Areas are effective
areas for an O-320 cowling (``assets/facts/fmea.md`` section 2).
"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Array
from core.cylinders import CYLINDERS, N_CYLINDERS, mate
from core.fmea.defects import DEFECT_SLICE

INLET_IN2 = 45.0
EXIT_IN2 = 38.0
FINS_IN2 = 26.0
COOLER_IN2 = 4.0
BASE_LEAK_IN2 = 5.0

COOLING_EXPONENT = 0.34
"""Head cooling against pressure drop (NACA correlation, NACA TN 1092)."""

COOLER_EXPONENT = 0.75
"""Oil-cooler heat rejection against pressure drop."""

LOCAL_SHARE_OF_DECK = 0.12
"""Share of a local leak that the whole deck feels; the rest is air stolen from one cylinder."""

LOCAL_LOSS = np.array([0.40, 0.52, 0.52, 0.40])
"""Cooling lost per share of a cylinder's air stolen; No. 2 and 3 have the shallowest fins."""

MATE_SHARE = 0.06
"""Share of a local leak felt by the cylinder behind or ahead of it on the bank."""

_MATES = [CYLINDERS.index(mate(cylinder)) for cylinder in CYLINDERS]
"""The column of each cylinder's mate."""


@dataclass(frozen=True, slots=True)
class Cooling:
    """``heads``: (n, 4) cooling efficiency by cylinder; ``cooler``: (n,); both 1 when healthy."""

    heads: Array
    cooler: Array


def _deck_share(deck_in2: Array) -> Array:
    resistance = 1.0 / deck_in2**2
    share: Array = resistance / (1.0 / INLET_IN2**2 + resistance + 1.0 / EXIT_IN2**2)
    return share


_HEALTHY_DECK_IN2 = FINS_IN2 + COOLER_IN2 + BASE_LEAK_IN2
_HEALTHY_SHARE = _deck_share(np.array([_HEALTHY_DECK_IN2]))


def cooling(defects: Array) -> Cooling:
    """Solve the network for a series of defect vectors, (n, N_DEFECTS)."""
    local = defects[:, DEFECT_SLICE["local_leak_in2"]]
    leak_in2 = defects[:, DEFECT_SLICE["plenum_leak_in2"]][:, 0]
    deck_in2 = _HEALTHY_DECK_IN2 + leak_in2 + LOCAL_SHARE_OF_DECK * local.sum(axis=1)
    pressure = _deck_share(deck_in2) / _HEALTHY_SHARE
    # A leak between the two cylinders of a bank robs both, the nearer one far more.
    reach = local + MATE_SHARE * local[:, _MATES]
    stolen = reach / (FINS_IN2 / N_CYLINDERS + reach)
    heads = (
        (pressure**COOLING_EXPONENT)[:, None]
        * (1.0 - LOCAL_LOSS * stolen)
        * (1.0 - defects[:, DEFECT_SLICE["wrap_loss"]])
        * (1.0 - defects[:, DEFECT_SLICE["fin_dirt"]])
    )
    beside = defects[:, DEFECT_SLICE["cooler_leak_in2"]][:, 0]
    fouling = defects[:, DEFECT_SLICE["cooler_fouling"]][:, 0]
    cooler = pressure**COOLER_EXPONENT * (COOLER_IN2 / (COOLER_IN2 + beside)) * (1.0 - fouling)
    return Cooling(heads, cooler)

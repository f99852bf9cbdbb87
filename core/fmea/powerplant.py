"""Layer 2: what the defects do to the JSBSim engine (paper section 3.2).

The paper acts on the throttle alone. JSBSim's piston model lets a defect act where it really
does, so each is handed to the parameter that carries it (and each mode of the catalogue says which
of them carry it and why):

- a misfire divides ``bsfc-lbs_hphr``: the fuel still flows, less of it becomes power;
- a leaking valve, a lost charge and unmetered air do half of that and half scale
  ``volumetric-efficiency``: part of the charge, fuel included, is never drawn in;
- friction adds to ``friction-hp``;
- metering faults scale ``fcs/mixture-cmd-norm``: fuel flow follows;
- loss of all combustion and a creeping throttle are the paper's throttle correction.
"""

from typing import NamedTuple

from core.cylinders import N_CYLINDERS
from core.fmea.defects import DEFECT_SLICE

LEAN_WORK_LOSS = 0.70
"""Relative work lost by a cylinder per relative leaning by unmetered air (rich of peak)."""

UNDRAWN_SHARE = 0.5
"""Share of a leak that reduces the charge drawn in, and with it the fuel flow."""

CRUISE_FRICTION_HP = 14.0
"""Friction power of an O-320 at cruise; JSBSim's own value covers only the static part."""


class EngineFactors(NamedTuple):
    """Corrections applied to the JSBSim engine; the defaults leave it untouched."""

    throttle: float = 1.0
    work: float = 1.0
    charge: float = 1.0
    mixture: float = 1.0
    friction_hp: float = 0.0


HEALTHY = EngineFactors()

CARRIERS: dict[str, str] = {
    "throttle correction": "throttle",
    "bsfc-lbs_hphr": "work",
    "volumetric-efficiency": "charge",
    "mixture-cmd-norm": "mixture",
    "friction-hp": "friction_hp",
}
"""The JSBSim parameters that may carry a mode, and the field of `EngineFactors` that moves each."""

_POWER_LOST, _CREEP, _ENRICHMENT, _FRICTION = (
    DEFECT_SLICE[name].start for name in ("power_lost", "throttle_creep", "enrichment", "friction")
)
_CYLINDERS = tuple(
    zip(
        *(
            range(DEFECT_SLICE[name].start, DEFECT_SLICE[name].stop)
            for name in ("valve_leak", "charge_loss", "air_leak_lean", "misfire")
        ),
        strict=True,
    )
)
"""Where the four defects of each cylinder stand."""


def engine_factors(d: list[float]) -> EngineFactors:
    """The engine corrections of one defect vector, `N_DEFECTS` long.

    Called at every tick of a flight, hence in plain floats: ten times faster than arrays of four.
    """
    undrawn = lost = 0.0
    for valve, charge_loss, lean, misfire in _CYLINDERS:
        leaked = d[valve] + d[charge_loss] + LEAN_WORK_LOSS * d[lean]
        undrawn += min(leaked, 1.0)
        lost += min(leaked + d[misfire], 1.0)
    indicated = 1.0 - lost / N_CYLINDERS
    charge = 1.0 - UNDRAWN_SHARE * (undrawn / N_CYLINDERS)
    return EngineFactors(
        throttle=(1.0 - d[_POWER_LOST]) * (1.0 + d[_CREEP]),
        work=max(indicated / charge, 0.05),
        charge=charge,
        mixture=1.0 + d[_ENRICHMENT],
        friction_hp=CRUISE_FRICTION_HP * d[_FRICTION],
    )

"""Layer 2: what the defects do to the JSBSim engine (paper section 3.2).

The paper acts on the throttle alone. JSBSim's piston model lets a defect act where it really
does, so each is handed to the parameter that carries it:

- a misfire divides ``bsfc-lbs_hphr``: the fuel still flows, less of it becomes power;
- a leaking valve, a lost charge and unmetered air do half of that and half scale
  ``volumetric-efficiency``: part of the charge, fuel included, is never drawn in;
- friction adds to ``friction-hp``;
- metering faults scale ``fcs/mixture-cmd-norm``: fuel flow follows;
- loss of all combustion and a creeping throttle are the paper's throttle correction.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.fmea.defects import DEFECT_SLICE

Array = NDArray[np.float64]

LEAN_WORK_LOSS = 0.70
"""Relative work lost by a cylinder per relative leaning by unmetered air (rich of peak)."""

UNDRAWN_SHARE = 0.5
"""Share of a leak that reduces the charge drawn in, and with it the fuel flow."""

CRUISE_FRICTION_HP = 14.0
"""Friction power of an O-320 at cruise; JSBSim's own value covers only the static part."""


@dataclass(frozen=True, slots=True)
class EngineFactors:
    """Corrections applied to the JSBSim engine; the defaults leave it untouched."""

    throttle: float = 1.0
    work: float = 1.0
    charge: float = 1.0
    mixture: float = 1.0
    friction_hp: float = 0.0


HEALTHY = EngineFactors()


_POWER_LOST, _CREEP, _ENRICHMENT, _FRICTION = (
    DEFECT_SLICE[name].start for name in ("power_lost", "throttle_creep", "enrichment", "friction")
)
_VALVE, _CHARGE, _LEAN, _MISFIRE = (
    DEFECT_SLICE[name] for name in ("valve_leak", "charge_loss", "air_leak_lean", "misfire")
)


def engine_factors(defects: Array) -> EngineFactors:
    """The engine corrections of one defect vector, (N_DEFECTS,).

    Called at every tick of a flight, hence in plain floats: ten times faster than arrays of four.
    """
    d = defects.tolist()
    leaked = [
        valve + charge + LEAN_WORK_LOSS * lean
        for valve, charge, lean in zip(d[_VALVE], d[_CHARGE], d[_LEAN], strict=True)
    ]
    lost = [min(leak + miss, 1.0) for leak, miss in zip(leaked, d[_MISFIRE], strict=True)]
    indicated = 1.0 - sum(lost) / 4.0
    charge = 1.0 - UNDRAWN_SHARE * (sum(min(leak, 1.0) for leak in leaked) / 4.0)
    return EngineFactors(
        throttle=(1.0 - d[_POWER_LOST]) * (1.0 + d[_CREEP]),
        work=max(indicated / charge, 0.05),
        charge=charge,
        mixture=1.0 + d[_ENRICHMENT],
        friction_hp=CRUISE_FRICTION_HP * d[_FRICTION],
    )

"""Layer 2: what the defects do to the JSBSim engine (paper section 3.2).

The paper acts on the throttle alone. JSBSim's piston model lets a defect act where it really
does, so each is handed to the parameter that carries it:

- lost work (leaking valve, lost charge, misfire, lean charge) divides ``bsfc-lbs_hphr``: the fuel
  still flows, less of it becomes power;
- friction adds to ``friction-hp``;
- metering faults scale ``fcs/mixture-cmd-norm``: fuel flow follows;
- loss of all combustion and a creeping throttle are the paper's throttle correction.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from core.fmea.defects import DEFECT_SLICE

Array = NDArray[np.float64]

LEAN_WORK_LOSS = 0.95
"""Relative work lost by a cylinder per relative leaning by unmetered air (rich of peak)."""

RICH_WORK_LOSS = 0.25
"""Relative work lost per relative fuel excess, beyond what JSBSim's mixture table takes."""

CRUISE_FRICTION_HP = 14.0
"""Friction power of an O-320 at cruise; JSBSim's own value covers only the static part."""


@dataclass(frozen=True, slots=True)
class EngineFactors:
    """Corrections applied to the JSBSim engine; the defaults leave it untouched."""

    throttle: float = 1.0
    work: float = 1.0
    mixture: float = 1.0
    friction_hp: float = 0.0


HEALTHY = EngineFactors()


def engine_factors(defects: Array) -> EngineFactors:
    """The engine corrections of one defect vector, (N_DEFECTS,)."""

    def whole(name: str) -> float:
        return float(defects[DEFECT_SLICE[name]][0])

    lost = (
        defects[DEFECT_SLICE["valve_leak"]]
        + defects[DEFECT_SLICE["charge_loss"]]
        + defects[DEFECT_SLICE["misfire"]]
        + LEAN_WORK_LOSS * defects[DEFECT_SLICE["air_leak_lean"]]
    )
    work = 1.0 - float(np.minimum(lost, 1.0).mean()) - RICH_WORK_LOSS * whole("enrichment")
    return EngineFactors(
        throttle=(1.0 - whole("power_lost")) * (1.0 + whole("throttle_creep")),
        work=max(work, 0.05),
        mixture=1.0 + whole("enrichment"),
        friction_hp=CRUISE_FRICTION_HP * whole("friction"),
    )

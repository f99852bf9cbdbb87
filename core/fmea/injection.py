"""Layer 1 of the fault engine: the fault's defects, evolving from onset (paper section 3.2)."""

import numpy as np
from numpy.typing import NDArray

from core.fmea.catalogue import catalogue
from core.fmea.defects import N_DEFECTS, entries
from core.fmea.fault import Fault
from core.fmea.laws import TICK_S, Drivers, Law

Array = NDArray[np.float64]


class FaultState:
    """The evolving defects of one injected fault. Deterministic in (fault, seed, drivers)."""

    def __init__(self, fault: Fault, seed: int) -> None:
        """A healthy engine; nothing moves before ``fault.onset_s``."""
        mode = catalogue()[fault.mode]
        self.reaches_engine = mode.moves_engine
        self._onset_tick = round(fault.onset_s / TICK_S)
        self._tick = 0
        self._defects = np.zeros(N_DEFECTS)
        self._grown: list[tuple[Law, Array]] = []
        for drive in mode.drives if fault.severity > 0.0 else ():
            # Drives of one law and one mode share a stream, so that bursts on the target and on
            # its neighbours are the same bursts.
            rng = np.random.default_rng([seed, 0xFA17])
            full = np.zeros(N_DEFECTS)
            full[entries(drive.defect, drive.where, fault.target_cylinder)] = drive.size(
                fault.severity
            )
            self._grown.append((drive.law.start(rng), full))

    @property
    def is_active(self) -> bool:
        """Whether the fault has set in."""
        return bool(self._grown) and self._tick > self._onset_tick

    def step(self, drivers: Drivers) -> Array:
        """Advance by one tick (0.1 s); the defect vector, (N_DEFECTS,), not to be modified."""
        self._tick += 1
        if self.is_active:
            self._defects = np.zeros(N_DEFECTS)
            for law, full in self._grown:
                self._defects += law.step(drivers) * full
        return self._defects

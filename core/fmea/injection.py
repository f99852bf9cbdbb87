"""Layer 1 of the fault engine: the fault's defects, evolving from onset (paper section 3.2)."""

from dataclasses import replace

import numpy as np

from core.clock import TICK_S
from core.fmea.catalogue import Drive, catalogue
from core.fmea.defects import N_DEFECTS, entries
from core.fmea.fault import Fault
from core.fmea.laws import Drivers, Law


class FaultState:
    """The evolving defects of one injected fault. Deterministic in (fault, seed, drivers)."""

    def __init__(self, fault: Fault, seed: int, tick: int = 0) -> None:
        """A healthy engine, ``tick`` ticks into the flight; nothing moves before the onset."""
        mode = catalogue()[fault.mode]
        self.fault = fault
        self.reaches_engine = mode.moves_engine
        self._drives: tuple[Drive, ...] = mode.drives if fault.severity > 0.0 else ()
        self._onset_tick = round(fault.onset_s / TICK_S)
        self._tick = tick
        self._grown: list[tuple[Law, float, list[int]]] = []
        for drive in self._drives:
            # Drives of one law and one mode share a stream, so that bursts on the target and on
            # its neighbours are the same bursts.
            rng = np.random.default_rng([seed, 0xFA17])
            places = entries(drive.defect, drive.where, fault.target_cylinder)
            self._grown.append((drive.law.start(rng), drive.size(fault.severity), places))

    @property
    def is_active(self) -> bool:
        """Whether the fault has set in."""
        return bool(self._grown) and self._tick > self._onset_tick

    def regrade(self, severity: float) -> None:
        """Go on from where the fault has come to, at another severity above 0."""
        self.fault = replace(self.fault, severity=severity)
        self._grown = [
            (law, drive.size(severity), places)
            for drive, (law, _, places) in zip(self._drives, self._grown, strict=True)
        ]

    def step(self, drivers: Drivers) -> list[float]:
        """Advance by one tick (0.1 s) and return the defect vector, `N_DEFECTS` long.

        In plain floats, for the same reason as `core.fmea.powerplant.engine_factors`.
        """
        self._tick += 1
        defects = [0.0] * N_DEFECTS
        if self.is_active:
            for law, size, places in self._grown:
                level = law.step(drivers)
                for place in places:
                    defects[place] += level * size
        return defects

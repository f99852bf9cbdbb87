"""The flights of the paper's section 6.2: five faults beside the nominal flight.

Every flight has the same plan and seed, so what differs between two of them is the fault. Faults
of one cylinder all strike No. 1, so that one CHT and one EGT channel can be compared across them.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from core.experiments.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION, Line
from core.experiments.results import Progress
from core.fmea.fault import Fault
from core.twin.flight import fly
from core.twin.plan import Plan
from core.twin.trajectory import Pair, Trajectory

NOMINAL = "nominal"
REPRESENTATIVE: tuple[str, ...] = (
    "engine_failure", "cylinder_compression", "baffle_crack", "oil_cooler_maintenance",
    "intake_gasket_leak",
)  # fmt: skip

FIGURES_SEVERITY = 0.8
FIGURES_ONSET_S = 60.0
CYLINDER = 1
FIGURES_PLAN = Plan(altitude_ft=5000.0, speed_kt=100.0, heading_deg=60.0, duration_s=300.0, seed=1)

LINES: dict[str, Line] = {
    NOMINAL: Line(GREY, "solid", 5.0),
    "engine_failure": Line(VERMILION, "solid", 2.0),
    "cylinder_compression": Line(BLUE, "solid", 2.0),
    "baffle_crack": Line(ORANGE, "dash", 2.0),
    "oil_cooler_maintenance": Line(GREEN, "dot", 2.5),
    "intake_gasket_leak": Line(PURPLE, "dashdot", 2.0),
}
"""Nominal lies broad and pale beneath the rest: a path that coincides with it still shows."""


def plan_for(quick: bool) -> Plan:
    """The plan flown; a quick look flies half of it."""
    return replace(FIGURES_PLAN, duration_s=150.0) if quick else FIGURES_PLAN


def fault_of(mode: str) -> Fault:
    """The fault injected for ``mode``."""
    return Fault(mode, FIGURES_SEVERITY, FIGURES_ONSET_S, CYLINDER)


def fly_modes(plan: Plan, modes: Iterable[str], progress: Progress) -> dict[str, Pair]:
    """Each mode's flight beside the one mirror that all of them share; raises `FlightError`.

    In lab conditions this is what `core.twin.flight.fly_pair` gives, with one mirror flown for
    all.
    """
    wanted = list(modes)
    mirror = fly(plan)
    pairs: dict[str, Pair] = {}
    for done, mode in enumerate(wanted):
        pairs[mode] = Pair(_flown(plan, mode, mirror), mirror)
        progress((done + 1) / len(wanted))
    return pairs


def _flown(plan: Plan, mode: str, mirror: Trajectory) -> Trajectory:
    return mirror if mode == NOMINAL else fly(plan, fault_of(mode))


def settings(plan: Plan, quick: bool) -> dict[str, Any]:
    """What the result file says of the flights."""
    return {
        "quick": quick,
        "conditions": plan.conditions,
        "power": plan.power,
        "seeds": [plan.seed],
        "plan": plan.to_dict(),
        "severity": FIGURES_SEVERITY,
        "onset_s": FIGURES_ONSET_S,
        "cylinder": CYLINDER,
    }

"""The physical state of a damaged engine: one vector of defects, all zero when healthy.

Layer 1 writes it, layers 2 and 3 read it, and neither learns which failure mode wrote it. A
defect named in ``PER_CYLINDER`` has an entry for each cylinder.
"""

from core.cylinders import CYLINDERS, GROUPS, N_CYLINDERS

ENGINE_WIDE: tuple[str, ...] = (
    "plenum_leak_in2",  # area open between upper and lower cowl deck
    "cooler_leak_in2",  # area open beside the oil cooler
    "cooler_fouling",  # share of the oil cooler's heat rejection lost
    "oil_lost_qt",  # oil gone overboard
    "friction",  # relative rise of friction
    "power_lost",  # share of combustion lost on all cylinders
    "throttle_creep",  # relative opening beyond the commanded throttle
    "enrichment",  # relative fuel excess of the carburettor
)
PER_CYLINDER: tuple[str, ...] = (
    "local_leak_in2",  # area through which air bypasses one cylinder's fins
    "wrap_loss",  # share of the lee-side wrap-around flow lost
    "fin_dirt",  # share of the fins' conductance lost
    "air_leak_lean",  # relative leaning by unmetered air
    "valve_leak",  # share of the work lost past the exhaust valve
    "charge_loss",  # share of the charge lost through a crack
    "gas_jet",  # relative extra heat into the head from escaping gas
    "misfire",  # share of power strokes lost
)

N_DEFECTS = len(ENGINE_WIDE) + N_CYLINDERS * len(PER_CYLINDER)

DEFECT_SLICE: dict[str, slice] = {name: slice(i, i + 1) for i, name in enumerate(ENGINE_WIDE)} | {
    name: slice(start, start + N_CYLINDERS)
    for name, start in zip(
        PER_CYLINDER, range(len(ENGINE_WIDE), N_DEFECTS, N_CYLINDERS), strict=True
    )
}
"""Where each defect lives in a vector of `N_DEFECTS`."""

MOVES_ENGINE: frozenset[str] = frozenset(
    {
        "friction", "power_lost", "throttle_creep", "enrichment",
        "air_leak_lean", "valve_leak", "charge_loss", "misfire",
    }
)  # fmt: skip
"""Defects that layer 2 hands to JSBSim; all others leave the flight path untouched."""

ENGINE = "engine"
"""The place of an engine-wide defect."""


def entries(defect: str, where: str, target: int) -> list[int]:
    """Indices into the defect vector of ``defect`` at ``where``.

    That is `ENGINE`, or a group of cylinders (`GROUPS`) as seen from the ``target``.
    """
    start = DEFECT_SLICE[defect].start
    if where == ENGINE:
        return [start]
    return [start + CYLINDERS.index(cylinder) for cylinder in sorted(GROUPS[where](target))]

"""The physical state of a damaged engine: one vector of defects, all zero when healthy.

Layer 1 writes it, layers 2 and 3 read it, and neither learns which failure mode wrote it. A
defect named in ``PER_CYLINDER`` has four entries, cylinders 1-4.
"""

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

N_DEFECTS = len(ENGINE_WIDE) + 4 * len(PER_CYLINDER)

DEFECT_SLICE: dict[str, slice] = {name: slice(i, i + 1) for i, name in enumerate(ENGINE_WIDE)} | {
    name: slice(len(ENGINE_WIDE) + 4 * i, len(ENGINE_WIDE) + 4 * i + 4)
    for i, name in enumerate(PER_CYLINDER)
}
"""Where each defect lives in a vector of `N_DEFECTS`."""

MOVES_ENGINE: frozenset[str] = frozenset(
    {
        "friction", "power_lost", "throttle_creep", "enrichment",
        "air_leak_lean", "valve_leak", "charge_loss", "misfire",
    }
)  # fmt: skip
"""Defects that layer 2 hands to JSBSim; all others leave the flight path untouched."""

MATE_ON_BANK: dict[int, int] = {1: 3, 3: 1, 2: 4, 4: 2}
"""Right bank 1 and 3, left bank 2 and 4 (1 right front, 2 left front, 3 right rear)."""

MATE_IN_ROW: dict[int, int] = {1: 2, 2: 1, 3: 4, 4: 3}
"""Front row 1 and 2, rear row 3 and 4."""

PLACES: tuple[str, ...] = (
    "engine", "target", "others", "bank", "row_mate", "front", "rear", "all",
)  # fmt: skip


def cylinders_at(where: str, target: int) -> tuple[int, ...]:
    """The cylinders (1-4) that ``where`` names, relative to the ``target`` cylinder."""
    return {
        "target": (target,),
        "others": tuple(c for c in (1, 2, 3, 4) if c != target),
        "bank": (target, MATE_ON_BANK.get(target, target)),
        "row_mate": (MATE_IN_ROW.get(target, target),),
        "front": (1, 2),
        "rear": (3, 4),
        "all": (1, 2, 3, 4),
    }[where]


def entries(defect: str, where: str, target: int) -> list[int]:
    """Indices into the defect vector of ``defect`` at ``where``."""
    start = DEFECT_SLICE[defect].start
    if where == "engine":
        return [start]
    return [start + c - 1 for c in cylinders_at(where, target)]

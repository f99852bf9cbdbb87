"""What of a flight's actions a diagnosis may know: repairs and new targets, never a fault."""

from collections.abc import Iterable

from core.diagnosis.diagnosis import Intervention
from core.twin.actions import Action, Repair, SetTarget


def interventions(
    actions: Iterable[Action], ground_s: float | None = None
) -> tuple[Intervention, ...]:
    """The repairs and new targets among ``actions``, and the end on the ground, in order."""
    known = [] if ground_s is None else [Intervention(ground_s, "ground")]
    for action in actions:
        match action:
            case Repair():
                known.append(Intervention(action.time_s, "repair"))
            case SetTarget():
                known.append(Intervention(action.time_s, "target", _targets(action)))
    return tuple(sorted(known, key=lambda item: item.time_s))


def _targets(action: SetTarget) -> str:
    """``5,000 ft, 100 kt, heading 90°``."""
    said = []
    if action.altitude_ft is not None:
        said.append(f"{action.altitude_ft:,.0f} ft")
    if action.speed_kt is not None:
        said.append(f"{action.speed_kt:.0f} kt")
    if action.heading_deg is not None:
        said.append(f"heading {action.heading_deg:.0f}°")
    return ", ".join(said)

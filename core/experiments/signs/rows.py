"""One entry of the matrix of signs, as judged."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Row:
    """One entry of the matrix and what the twin does there.

    ``delta``: mean shift at severity `CLEAR`; ``plans_low``, ``plans_high``: its extremes over the
    plans. ``held``: the sign is as expected (None where the reference makes no claim).
    ``within``: every severity's shift lies in ``low`` to ``high``, give or take the channel's
    wander. ``disputed``: why we hold the reference to be wrong, if we do; ``stands``: whether the
    shifts lie in the range that we hold to be right instead.
    """

    fault: str
    channel: str
    unit: str
    expected: str
    low: float
    high: float
    resolution: float
    delta: float
    plans_low: float
    plans_high: float
    held: bool | None
    within: bool
    disputed: str | None
    stands: bool | None
    deltas_by_severity: dict[str, float]

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return asdict(self)

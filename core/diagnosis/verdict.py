"""The windows that count towards a verdict: those that show the fault, and it alone."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from core.arrays import Array
from core.clock import DT_S
from core.diagnosis.diagnosis import Intervention, judged_until
from core.residual.window import EFFECTIVE_S, WINDOW_S

TIME_TOLERANCE_S = DT_S / 2


def counted_windows(
    time_s: Array, onset_s: float | None, until_s: float | None = None
) -> NDArray[np.bool_]:
    """Mask (k,) of the windows, given by their ends (k,), that count towards the verdict.

    Those that lie wholly within the effective window, onset to onset + 120 s, and end by
    ``until_s``; where none is complete by then, the one that reaches furthest beyond the onset.
    Without an onset all.
    """
    if onset_s is None:
        return np.ones(len(time_s), dtype=bool)
    last_s = onset_s + EFFECTIVE_S
    if until_s is not None:
        last_s = min(last_s, until_s)
    begins_after = time_s - WINDOW_S >= onset_s - TIME_TOLERANCE_S
    chosen: NDArray[np.bool_] = begins_after & (time_s <= last_s + TIME_TOLERANCE_S)
    if not chosen.any():
        chosen = np.arange(len(time_s)) == _latest(time_s, last_s)
    return chosen


def _latest(time_s: Array, last_s: float) -> int:
    """The last window that ends by ``last_s``, else simply the last one."""
    within = np.flatnonzero(time_s <= last_s + TIME_TOLERANCE_S)
    return int(within[-1]) if len(within) else len(time_s) - 1


def verdict_until(
    time_s: Array, onset_s: float | None, interventions: Sequence[Intervention]
) -> float | None:
    """Where the verdict's windows end: at the repair, and before new targets if one fits there.

    While both aircraft fly to new targets their difference is the fault's still, but not one that
    any model has learnt.
    """
    until_s = judged_until(onset_s, interventions)
    if onset_s is None:
        return None
    targets = [item.time_s for item in interventions if item.kind == "target"]
    steered_s = min((each for each in targets if each > onset_s), default=None)
    if steered_s is None or (until_s is not None and until_s <= steered_s):
        return until_s
    whole = (time_s - WINDOW_S >= onset_s - TIME_TOLERANCE_S) & (time_s <= steered_s)
    return steered_s if whole.any() else until_s

"""The time from which on a diagnosis names the right class to the end."""

import numpy as np
from numpy.typing import NDArray

from core.residual.window import EFFECTIVE_S


def named_at(
    time_s: NDArray[np.float64],
    probabilities: NDArray[np.floating],
    right: int,
    onset_s: float,
) -> float | None:
    """End of the first window from which on the right class leads; None if it does not stay.

    ``time_s`` (k,) are the ends of the windows in seconds, ``probabilities`` is (k, 20) and
    ``right`` the class's column. What counts is the effective window, 120 s from the onset: after
    it the two flights have drifted apart for reasons of their own.
    """
    within = (time_s >= onset_s) & (time_s <= onset_s + EFFECTIVE_S)
    leads = np.asarray(probabilities)[within].argmax(axis=1) == right
    if not leads.size or not leads[-1]:
        return None
    wrong = np.flatnonzero(~leads)
    first = int(wrong[-1]) + 1 if len(wrong) else 0
    return float(time_s[within][first])

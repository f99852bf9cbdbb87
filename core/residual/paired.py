"""The paired-mirror residual (paper section 4.1) and the onset that it shows.

The subtraction itself is `core.twin.trajectory.Pair.residual`; here is what it tells about time.
"""

import numpy as np

from core.arrays import Array32


def first_departure(residual: Array32) -> int | None:
    """The first sample at which any channel leaves the mirror; None if none ever does.

    ``residual``: (n, 23). In lab conditions both flights share every bit up to the onset, noise
    included, so the first non-zero sample is the onset as far as the sensors can know it.
    """
    departed = np.flatnonzero(residual.any(axis=1))
    return int(departed[0]) if len(departed) else None

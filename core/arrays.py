"""Arrays of numbers, named for their precision; shapes stand in the docstrings that use them."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]

"""A hint to the compiler that an array's index is not negative."""

import numpy as np

__all__ = ["LAST_PLACE"]

LAST_PLACE = np.int64((1 << 62) - 1)
"""``place & LAST_PLACE`` is the place; a negative one would count from the end of the array, which
is else looked for at each use."""

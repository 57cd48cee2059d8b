"""Numbers as callers give them: Python's or numpy's, of any size."""

import math
import numbers

import numpy as np
from numpy.typing import NDArray

__all__ = ["as_float", "squares_of_few"]

_FEW = 100
"""Numbers: for many more, BLAS takes threads, which spin."""


def as_float(value: object) -> float | None:
    """Return a real number of any type as a float, None for other values; a bool is none.

    An integer beyond all floats is infinite.
    """
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0.0 else -math.inf  # type: ignore[operator]


def squares_of_few(values: NDArray[np.float64]) -> float:
    """Return the sum of the squares of an array's numbers; infinite where there are many.

    Where it is finite so are all of them, which is found sooner than by asking about each.
    """
    return float(np.vdot(values, values)) if values.size <= _FEW else math.inf

"""Numbers as callers give them: Python's or numpy's, of any size."""

import math
import numbers

__all__ = ["as_float"]


def as_float(value: object) -> float | None:
    """Return a real number of any type as a float, None for what is none; a bool is none.

    An integer beyond all floats is infinite.
    """
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0.0 else -math.inf  # type: ignore[operator]

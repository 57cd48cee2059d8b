"""The segments of a piecewise curve in which times are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["segments_at"]


def segments_at(breaks: NDArray[np.float64], times: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the indices ``(m,)`` of the segments of times ``(m,)`` between breaks ``(p + 1,)``.

    At a break that is the later segment; times before the first break are in the first segment,
    times after the last one in the last.
    """
    return (np.searchsorted(breaks, times, side="right") - 1).clip(0, len(breaks) - 2)

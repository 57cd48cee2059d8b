"""Segments of curves by their values and derivatives at both ends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["hermite_segments", "straight_segments_of"]

Array = NDArray[np.float64]


def hermite_segments(lengths: Array, sides: Array, degree: int) -> Array:
    """Return control points ``(p, degree + 1, k)`` of segments with given ends.

    ``sides`` ``(p, 6, k)`` are q, q' and q'' at the start, and at the end. A cubic takes q and q',
    one of degree 7 all of them, and its third derivatives are 0 there. Control points are Taylor's
    coefficients from each end, in Bernstein's basis (Farin, *Curves and Surfaces for CAGD*, 2002,
    section 5.3).
    """
    h = lengths[:, np.newaxis]
    result = np.empty((len(lengths), degree + 1, sides.shape[2]))
    half = (degree + 1) // 2
    for first, side, places in (
        (0, h, range(half)),
        (3, -h, range(degree, degree - half, -1)),
    ):
        q = sides[:, first]
        one = side * sides[:, first + 1] / degree
        two = side**2 * sides[:, first + 2] / (degree * (degree - 1)) if half > 2 else 0.0
        for step, place in enumerate(places):
            result[:, place] = q + step * one + (step * (step - 1) // 2) * two
    return result


def straight_segments_of(starts: Array, ends: Array, degree: int) -> Array:
    """Return control points ``(p, degree + 1, k)`` evenly from starts to ends ``(p, k)``."""
    part = np.linspace(0.0, 1.0, degree + 1)[:, np.newaxis]
    return (1.0 - part) * starts[:, np.newaxis] + part * ends[:, np.newaxis]

"""Rows of about unit length, and points that surely fulfil them, or surely don't.

A point is tested in floats, with a bound of their rounding, and where that leaves a row open in
doubled precision.
"""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.convex.solve.linear_algebra.doubled import exact_residual, residual_error
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["beyond", "holds", "unit_rows"]

_LARGEST, _LEAST = 1e140, 1e-140
"""Lengths of rows between which powers of two change no digit."""

_UNDERFLOW = 1e-290
"""Entries below it may have lost digits."""


@kernel
def unit_rows(A, b, rows, sides, lengths):
    """Fill rows with lengths between 1/2 and 1, by powers of two; False where one has none."""
    m, n = A.shape
    for i in range(m):
        square = 0.0
        for k in range(n):
            square += A[i, k] * A[i, k]
        length = math.sqrt(square)
        if not _LEAST < length < _LARGEST:
            return False
        _, exponent = math.frexp(length)
        factor = math.ldexp(1.0, -exponent)
        for k in range(n):
            rows[i, k] = A[i, k] * factor
            if A[i, k] != 0.0 and abs(rows[i, k]) < _UNDERFLOW:
                return False
        sides[i] = b[i] * factor
        if b[i] != 0.0 and not _UNDERFLOW < abs(sides[i]) < 1.0 / _UNDERFLOW:
            return False
        lengths[i] = length * factor
    return True


@kernel
def holds(columns, b, count, skip, x):
    """Tell whether x surely fulfils the first ``count`` rows but one, or leave it open."""
    n = len(x)
    slacks, sizes = np.empty(count), np.empty(count)
    for i in range(count):
        slacks[i], sizes[i] = b[i], abs(b[i])
    for k in range(n):
        column, at = columns[k], x[k]
        for i in range(count):
            product = column[i] * at
            slacks[i] -= product
            sizes[i] += abs(product)
    for i in range(count):
        # Few rows are so near that their slack needs twice the digits.
        if slacks[i] <= (n + 4) * EPSILON * sizes[i] + _UNDERFLOW and i != skip:
            rest = exact_residual(columns[:, i], x, b[i])
            if not rest >= residual_error(columns[:, i], x, b[i], rest):
                return False
    return True


@kernel
def beyond(row, side, x):
    """Tell whether x is surely beyond a row."""
    rest = exact_residual(row, x, side)
    return rest < -residual_error(row, x, side, rest)

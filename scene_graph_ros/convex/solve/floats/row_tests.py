"""Tests of rows and points that a decision rests on, each with a bound of rounding."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.floats.quick_bounds import (
    bounding_weights,
    half_widths,
)
from scene_graph_ros.convex.solve.floats.quick_points import deepest
from scene_graph_ros.convex.solve.floats.unit_rows import beyond, holds
from scene_graph_ros.convex.solve.linear_algebra.doubled import (
    exact_residual,
    exact_residuals,
    residual_error,
)
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["box_about", "inner_point", "is_within", "moved", "shown_beyond"]

_INWARD = (0.0, 1e-14, 1e-12, 1e-9, 1e-6, 1e-3)
"""Shares of the way from an optimum back to an inner point: rounding leaves corners outside."""

_SURE = 16.0 * EPSILON
"""Relative to a side that is moved out by a tolerance: rounding of the sum."""


@kernel
def _slacks_at(columns, b, x, slacks):
    """Fill slacks of rows at a point, rounded up; False unless all are surely positive."""
    m = len(b)
    exact_residuals(columns, b, m, x, slacks, np.empty(m))
    for i in range(m):
        rest = slacks[i]
        error = residual_error(columns[:, i], x, b[i], rest)
        slacks[i] = rest + error
        if not rest > error:
            return False
    return True


@kernel
def is_within(reach, row, x, side):
    """Tell whether a side is surely as far from a point of its row as a reach, or further."""
    rest = exact_residual(row, x, side)
    return reach <= rest - residual_error(row, x, side, rest) - 2.0 * EPSILON * abs(rest)


@kernel
def moved(side, tol, length, sign):
    """Return a side moved out by a tolerance, rounded up or down."""
    out = side + tol * length
    return out + sign * _SURE * (abs(side) + abs(tol * length))


@kernel
def shown_beyond(columns, b, count, skip, far, x0, row, side):
    """Tell whether a point near to ``far`` surely fulfils all rows but one, and is beyond one."""
    z = np.empty(len(x0))
    for s in range(len(_INWARD)):
        for k in range(len(x0)):
            z[k] = far[k] + _INWARD[s] * (x0[k] - far[k])
        if not beyond(row, side, z):
            return False
        if holds(columns, b, count, skip, z):
            return True
    return False


@kernel
def box_about(rows, columns, slacks, widths):
    """Fill how far a set may reach from a point with these slacks; False where it may for ever."""
    n = rows.shape[1]
    basis, inverse, y = np.empty(n, np.int64), np.empty((n, n)), np.empty(n)
    error = bounding_weights(rows, columns, basis, inverse, y)
    if error < 0.0:
        return False
    half_widths(rows, slacks, basis, inverse, y, error, widths)
    return True


@kernel
def inner_point(columns, b, lengths, x0, slacks):
    """Fill a point that is surely inside, and its slacks; False where there may be none."""
    n = len(x0)
    center, basis = np.zeros(n + 1), np.empty(n + 1, np.int64)
    deepest(columns, b, lengths, center, basis, np.empty((n + 1, n + 1)))
    x0[:] = center[:n]
    return center[n] > 0.0 and _slacks_at(columns, b, x0, slacks)

"""Coordinates in which a bounded set is as wide along all axes, and its deepest point in them."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.floats.active_set import OPTIMAL
from scene_graph_ros.convex.solve.floats.quick_bounds import maximize_from
from scene_graph_ros.convex.solve.floats.quick_points import deepest
from scene_graph_ros.convex.solve.floats.unit_rows import unit_rows
from scene_graph_ros.convex.solve.linear_algebra.dense import factor
from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["cube_quickly"]


@kernel
def _is_wide(spread, thin):
    """Tell whether the singular values of ``spread (p, n)`` surely differ by less than a ratio.

    The least eigenvalue of its square is no less than the determinant over the largest product
    of the others with the same sum.
    """
    p, n = spread.shape
    square, trace = np.zeros((n, n)), 0.0
    for i in range(p):
        for a in range(n):
            trace += spread[i, a] * spread[i, a]
            for b in range(a, n):
                square[a, b] += spread[i, a] * spread[i, b]
    if not factor(square):
        return False
    least = 1.0
    for a in range(n):
        least *= square[a, a] * square[a, a]
        if a:
            least *= (n - 1) / trace
    return least > thin * thin * trace


@kernel
def _box(columns, sides, x0, reached, middle, widths):
    """Fill the furthest points ``(2 n, n)`` along the axes, and the box that they are on.

    False where rows, of which ``x0`` is within, don't end it, or leave it no width.
    """
    n, m = columns.shape
    x, basis, inverse, goal = x0.copy(), np.full(n, -1), np.eye(n), np.zeros(n)
    for k in range(n):
        for end in range(2):
            goal[:] = 0.0
            goal[k] = 1.0 if end else -1.0
            if maximize_from(columns, sides, m, goal, x, basis, inverse) != OPTIMAL:
                return False
            reached[2 * k + end] = x
        low, high = reached[2 * k, k], reached[2 * k + 1, k]
        middle[k], widths[k] = 0.5 * (low + high), 0.5 * (high - low)
        if not widths[k] > 0.0:
            return False
    return True


@kernel
def cube_quickly(A, b, thin, middle, widths, center):
    """Fill the middle ``(n,)`` and half widths of the box about ``A x <= b``, and a centre.

    The centre is that of the largest ball where the box is a cube. False where the set may be flat
    or go on for ever, or be thinner by ``thin`` along some way across its box than along others.
    """
    m, n = A.shape
    rows, sides, lengths = np.empty((m, n)), np.empty(m), np.empty(m)
    if n == 0 or m == 0 or not unit_rows(A, b, rows, sides, lengths):
        return False
    columns = np.ascontiguousarray(rows.T)
    ball, places, turned = np.zeros(n + 1), np.empty(n + 1, np.int64), np.empty((n + 1, n + 1))
    deepest(columns, sides, lengths, ball, places, turned)
    reached = np.empty((2 * n, n))
    if not ball[n] > 0.0 or not _box(columns, sides, ball[:n], reached, middle, widths):
        return False
    for i in range(2 * n):
        for k in range(n):
            reached[i, k] = (reached[i, k] - middle[k]) / widths[k]
    if not _is_wide(reached, thin):
        return False
    scaled, rests = np.empty((m, n)), sides.copy()
    for i in range(m):
        for k in range(n):
            rests[i] -= rows[i, k] * middle[k]
            scaled[i, k] = rows[i, k] * widths[k]
    if not unit_rows(scaled, rests, rows, sides, lengths):
        return False
    deepest(np.ascontiguousarray(rows.T), sides, lengths, ball, places, turned)
    for k in range(n):
        center[k] = middle[k] + widths[k] * ball[k]
    return True

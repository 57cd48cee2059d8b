"""The largest values of polynomials in Bernstein's basis, compiled: branch and bound."""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel

__all__ = ["largest_of_rows"]

_ENOUGH = 1e-12
"""Of a limit, or of the maximum: a bound that is so near to a value that is taken will do."""

_MOST_CUTS = 60
"""Halves of halves of a segment; then its two ends are one number."""


@inlined_kernel
def _largest_end(control, row, upper, lower, breaks):
    """Return the largest ratio of a row at ends of segments, and its time."""
    top, at = -np.inf, breaks[0]
    last = control.shape[1] - 1
    for limit in (upper, lower):
        for k in range(control.shape[0]):
            if control[k, 0, row] / limit > top:
                top, at = control[k, 0, row] / limit, breaks[k]
            if control[k, last, row] / limit > top:
                top, at = control[k, last, row] / limit, breaks[k + 1]
    return top, at


@inlined_kernel
def _cut(points, right):
    """Write the halves of a polynomial: the left one in its place (de Casteljau)."""
    d = len(points)
    right[d - 1] = points[d - 1]
    for step in range(1, d):
        for i in range(d - 1, step - 1, -1):
            points[i] = 0.5 * (points[i - 1] + points[i])
        right[d - 1 - step] = points[d - 1]


@inlined_kernel
def _largest_inside(stack, ends, depths, top, at):
    """Return the largest value of the polynomial on a stack and its time, and a bound of it."""
    bound, size = -np.inf, 1
    last = stack.shape[1] - 1
    while size > 0:
        size -= 1
        points, low, high, depth = stack[size], ends[size, 0], ends[size, 1], depths[size]
        if points[0] > top:
            top, at = points[0], low
        if points[last] > top:
            top, at = points[last], high
        hull = points[0]
        for i in range(1, last + 1):
            hull = max(hull, points[i])
        if hull <= top + _ENOUGH * max(top, 1.0) or depth == _MOST_CUTS:
            bound = max(bound, hull)
            continue
        _cut(points, stack[size + 1])
        middle = 0.5 * (low + high)
        ends[size, 1], ends[size + 1, 0], ends[size + 1, 1] = middle, middle, high
        depths[size], depths[size + 1] = depth + 1, depth + 1
        size += 2
    return top, at, bound


@kernel
def largest_of_rows(breaks, control, lower, upper, best, bounds, times):
    """Write for each of n rows the largest ratio that is taken, its bound, and its time.

    ``control`` ``(p, d, n)`` are the segments' control points between ``breaks`` ``(p + 1,)``. A
    segment is in the hull of these; one that may hold the largest ratio is cut in halves (Farin,
    *Curves and Surfaces for CAGD*, 2002, section 5.4) until that is known.
    """
    count, d, n = control.shape
    stack = np.empty((_MOST_CUTS + 2, d))
    ends = np.empty((_MOST_CUTS + 2, 2))
    depths = np.empty(_MOST_CUTS + 2, dtype=np.int64)
    for row in range(n):
        top, at = _largest_end(control, row, upper[row], lower[row], breaks)
        bound = -np.inf
        for limit in (upper[row], lower[row]):
            for k in range(count):
                for i in range(d):
                    stack[0, i] = control[k, i, row] / limit
                ends[0, 0], ends[0, 1], depths[0] = breaks[k], breaks[k + 1], 0
                top, at, inside = _largest_inside(stack, ends, depths, top, at)
                bound = max(bound, inside)
        best[row], bounds[row], times[row] = top, max(bound, top), at

"""The largest values and rates of polynomials in Bernstein's basis: branch and bound."""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel

__all__ = ["largest_of_rows", "largest_rate"]

_ENOUGH = 1e-12
"""Of a limit, or of the maximum: a bound that is so near to a value that is taken will do."""

_MOST_CUTS = 60
"""Halves of halves of a segment; then its two ends are one number."""

_JUMP = 1e-9
"""Of the limit of an acceleration: smaller jumps are none."""

_ROUNDING = 100.0 * np.finfo(np.float64).eps
"""Of positions: what their rounding changes second differences by."""


@inlined_kernel
def _largest_end(control, last, row, upper, lower, breaks):
    """Return the largest ratio of a row at ends of segments, and its time."""
    top, at = -np.inf, breaks[0]
    for limit in (upper, lower):
        for k in range(control.shape[0]):
            if control[k, 0, row] / limit > top:
                top, at = control[k, 0, row] / limit, breaks[k]
            if control[k, last, row] / limit > top:
                top, at = control[k, last, row] / limit, breaks[k + 1]
    return top, at


@inlined_kernel
def _cut(points, d, right):
    """Write the halves of a polynomial: the left one in its place (de Casteljau)."""
    right[d - 1] = points[d - 1]
    for step in range(1, d):
        for i in range(d - 1, step - 1, -1):
            points[i] = 0.5 * (points[i - 1] + points[i])
        right[d - 1 - step] = points[d - 1]


@inlined_kernel
def _largest_inside(stack, last, ends, depths, top, at):
    """Return the largest value of the polynomial on a stack and its time, and a bound of it."""
    bound, size = -np.inf, 1
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
        _cut(points, last + 1, stack[size + 1])
        middle = 0.5 * (low + high)
        ends[size, 1], ends[size + 1, 0], ends[size + 1, 1] = middle, middle, high
        depths[size], depths[size + 1] = depth + 1, depth + 1
        size += 2
    return top, at, bound


@inlined_kernel
def _largest_of_row(breaks, control, d, row, lower, upper, scratch):
    """Return the largest ratio of a row that is taken, its bound, and its time.

    Only the first ``d`` control points of each segment count.
    """
    stack, ends, depths = scratch
    top, at = _largest_end(control, d - 1, row, upper, lower, breaks)
    bound = -np.inf
    for limit in (upper, lower):
        for k in range(control.shape[0]):
            hull = -np.inf
            for i in range(d):
                stack[0, i] = control[k, i, row] / limit
                hull = max(hull, stack[0, i])
            if hull <= top + _ENOUGH * max(top, 1.0):
                bound = max(bound, hull)
                continue
            ends[0, 0], ends[0, 1], depths[0] = breaks[k], breaks[k + 1], 0
            top, at, inside = _largest_inside(stack, d - 1, ends, depths, top, at)
            bound = max(bound, inside)
    return top, max(bound, top), at


@kernel
def largest_of_rows(breaks, control, lower, upper, best, bounds, times):
    """Write for each of n rows the largest ratio that is taken, its bound, and its time.

    ``control`` ``(p, d, n)`` are the segments' control points between ``breaks`` ``(p + 1,)``. A
    segment is in the hull of these; one that may hold the largest ratio is cut in halves (Farin,
    *Curves and Surfaces for CAGD*, 2002, section 5.4) until that is known.
    """
    d, n = control.shape[1:]
    stack, ends = np.empty((_MOST_CUTS + 2, d)), np.empty((_MOST_CUTS + 2, 2))
    scratch = stack, ends, np.empty(_MOST_CUTS + 2, dtype=np.int64)
    for row in range(n):
        best[row], bounds[row], times[row] = _largest_of_row(
            breaks, control, d, row, lower[row], upper[row], scratch
        )


@inlined_kernel
def _differentiate(widths, control, d):
    """Write control points of the derivative over those of a curve; return how many there are."""
    count, _, n = control.shape
    degree = d - 1
    for k in range(count):
        for i in range(max(degree, 1)):
            for j in range(n):
                change = control[k, i + 1, j] - control[k, i, j] if degree else 0.0
                control[k, i, j] = degree * change / widths[k]
    return max(degree, 1)


@inlined_kernel
def _largest_jump(widths, control, d, sizes, limits):
    """Return the largest jump between segments, by its limit, its row and its segment."""
    most, row, at = -np.inf, 0, 0
    for k in range(1, control.shape[0]):
        step = min(widths[k], widths[k - 1])
        for j in range(control.shape[2]):
            jump = abs(control[k, 0, j] - control[k - 1, d - 1, j])
            jump = (jump - _ROUNDING * sizes[j] / (step * step)) / limits[j]
            if jump > most:
                most, row, at = jump, j, k
    return most, row, at


@kernel
def largest_rate(breaks, widths, control, limits, is_rate):
    """Return the rate that is largest by its limit: order, row, bound of the ratio, and time.

    ``limits`` ``(m, n)`` are of the first m derivatives, 2 or 3. Where there is one of the third,
    and the second jumps, the ratio of the third is infinite. ``control`` is written over. It is of
    the curve, or of its first derivative where it ``is_rate``; then the second does not jump.
    ``widths`` ``(p,)`` are those of the segments, s.
    """
    d, n = control.shape[1:]
    stack, ends = np.empty((_MOST_CUTS + 2, d)), np.empty((_MOST_CUTS + 2, 2))
    scratch = stack, ends, np.empty(_MOST_CUTS + 2, dtype=np.int64)
    sizes = np.zeros(n)
    for k in range(control.shape[0]):
        for i in range(d):
            for j in range(n):
                sizes[j] = max(sizes[j], abs(control[k, i, j]))
    order, row, ratio, time = 0, 0, -np.inf, breaks[0]
    for each in range(len(limits)):
        if each == 2 and not is_rate:
            most, j, k = _largest_jump(widths, control, d, sizes, limits[1])
            if most > _JUMP:
                return 3, j, np.inf, breaks[k]
        if each > 0 or not is_rate:
            d = _differentiate(widths, control, d)
        for j in range(n):
            limit = limits[each, j]
            _, bound, at = _largest_of_row(breaks, control, d, j, -limit, limit, scratch)
            if bound > ratio:
                order, row, ratio, time = each + 1, j, bound, at
    return order, row, ratio, time

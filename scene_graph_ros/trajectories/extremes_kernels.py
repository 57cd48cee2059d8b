"""The largest values of polynomials in Bernstein's basis, compiled: branch and bound."""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["largest_of_rows"]

_ENOUGH = 1e-12
"""Of a limit, or of the maximum: a bound that is so near to a value that is taken will do."""

_MOST_CUTS = 60
"""Halves of halves of a segment; then its two ends are one number."""


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
        top, at, bound = -np.inf, breaks[0], -np.inf
        for side in range(2):
            share = 1.0 / (upper[row] if side == 0 else lower[row])
            for k in range(count):
                for end in (0, d - 1):
                    value = control[k, end, row] * share
                    if value > top:
                        top, at = value, breaks[k if end == 0 else k + 1]
        for side in range(2):
            share = 1.0 / (upper[row] if side == 0 else lower[row])
            for k in range(count):
                for i in range(d):
                    stack[0, i] = control[k, i, row] * share
                ends[0, 0], ends[0, 1], depths[0] = breaks[k], breaks[k + 1], 0
                size = 1
                while size > 0:
                    size -= 1
                    points, low, high, depth = (
                        stack[size],
                        ends[size, 0],
                        ends[size, 1],
                        depths[size],
                    )
                    for end, when in ((0, low), (d - 1, high)):
                        if points[end] > top:
                            top, at = points[end], when
                    hull = points[0]
                    for i in range(1, d):
                        hull = max(hull, points[i])
                    if hull <= top + _ENOUGH * max(top, 1.0) or depth == _MOST_CUTS:
                        bound = max(bound, hull)
                        continue
                    # The left half takes this one's place from its last point on; see de Casteljau.
                    middle = 0.5 * (low + high)
                    right = stack[size + 1]
                    right[d - 1] = points[d - 1]
                    for step in range(1, d):
                        for i in range(d - 1, step - 1, -1):
                            points[i] = 0.5 * (points[i - 1] + points[i])
                        right[d - 1 - step] = points[d - 1]
                    ends[size, 1] = middle
                    depths[size] = depth + 1
                    ends[size + 1, 0], ends[size + 1, 1], depths[size + 1] = (
                        middle,
                        high,
                        depth + 1,
                    )
                    size += 2
        best[row], bounds[row], times[row] = top, max(bound, top), at

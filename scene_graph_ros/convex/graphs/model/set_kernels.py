"""Supports of edges' sets, and rows of their points, in kernels.

Sets are those of `packed_terms`, one behind another.
"""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.convex.graphs.expressions.packed_terms import (
    AMBIENT,
    BY_CORNERS,
    NUMBERS,
    REACH,
    VARIABLES,
    WHOLE,
)
from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["add_reach", "least_over_sets", "moments_of_edges"]


@lean_kernel
def add_reach(head, f, D, off, totals):
    """Subtract a set's support along slopes ``D`` from the totals, if arrays have it."""
    n, count = head[AMBIENT], head[VARIABLES]
    sizes, lost, offset = 0.0, 0.0, 0.0
    for j in range(n):
        sizes += abs(D[j]) * f[n + j]
        offset += abs(D[j]) * abs(f[j])
        lost += (off[j] + 4.0 * EPSILON * abs(D[j])) * f[n + j]
    totals[1] += lost
    if head[REACH] > BY_CORNERS:
        return
    reach, rounding = sizes, sizes
    if head[REACH] == BY_CORNERS:
        reach, rounding = -math.inf, sizes + offset
        for c in range(count):
            along = 0.0
            for j in range(n):
                along -= D[j] * f[4 * n + j * count + c]
            reach = max(reach, along)
    totals[0] -= reach
    totals[1] += 2.0 * (n + 4) * EPSILON * rounding
    totals[2] += abs(reach)


@kernel
def _begins_of(sets, count):
    """Return the first indices of the whole numbers, the numbers and the coordinates of sets."""
    found, at, number, coordinate = np.zeros((count, 3), np.int64), 0, 0, 0
    for v in range(count):
        found[v, 0], found[v, 1], found[v, 2] = at, number, coordinate
        coordinate += sets[at + AMBIENT]
        number += sets[at + NUMBERS]
        at += sets[at + WHOLE]
    return found


@kernel
def least_over_sets(sets, numbers, ends, slopes, D, off, totals):
    """Take the drop of potentials, and the least over sets, from the minorants of edges.

    Slopes of potentials are those of all sets in turn; ``ends (m, 2)`` are the sets of tails and
    heads. From slopes ``D`` of the edges these are taken, their rounding is added to
    ``off``, and the sets' supports are taken from the totals ``(m, 3)``, but of sets
    that do not tell it by arrays.
    """
    begin, at = _begins_of(sets, ends.max() + 1 if len(ends) else 0), 0
    for e in range(len(ends)):
        for end in range(2):
            v, sign = ends[e, end], 2.0 * end - 1.0
            head, first = sets[begin[v, 0] :], begin[v, 1]
            for j in range(head[AMBIENT]):
                slope = sign * slopes[begin[v, 2] + j]
                D[at + j] += slope
                off[at + j] += 2.0 * EPSILON * abs(slope)
            f = numbers[first : first + head[NUMBERS]]
            add_reach(head, f, D[at:], off[at:], totals[e])
            at += head[AMBIENT]


@kernel
def moments_of_edges(sets, numbers, ends, columns, rows, lengths):
    """Return rows, columns and values of the sums of points at the vertices of edges.

    Those that come less those that go, beside the extents of their sets. ``rows (n,)`` are the
    first of a vertex, ``lengths`` how many it has, 0 or the dimension; ``columns (m, 2)`` the
    first variables of tails and heads ``ends``.
    """
    begin, most = _begins_of(sets, len(rows)), 0
    for e in range(len(ends)):
        for end in range(2):
            most += lengths[ends[e, end]] * sets[begin[ends[e, end], 0] + VARIABLES]
    i, j, values = np.zeros(most, np.int64), np.zeros(most, np.int64), np.zeros(most)
    at = 0
    for e in range(len(ends)):
        for end in range(2):
            v = ends[e, end]
            head, f, n = sets[begin[v, 0] :], numbers[begin[v, 1] :], lengths[v]
            extent = 0.0
            for a in range(n):
                extent = max(extent, f[n + a])
            factor = (2.0 * end - 1.0) / (extent if extent > 0.0 else 1.0)
            for a in range(n):
                for b in range(head[VARIABLES]):
                    value = f[4 * n + a * head[VARIABLES] + b]
                    if value != 0.0:
                        i[at], j[at] = rows[v] + a, columns[e, end] + b
                        values[at] = factor * value
                        at += 1
    return i[:at], j[:at], values[:at]

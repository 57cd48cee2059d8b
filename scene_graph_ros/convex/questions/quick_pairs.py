"""Which of many sets meet, pair by pair in one call: boxes that may, and polyhedra that surely do.

In floats, with bounds of rounding.
"""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.convex.solve.floats.quick_points import OPEN, point_of_unit_rows
from scene_graph_ros.convex.solve.floats.unit_rows import unit_rows
from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["meet_quickly", "near_boxes"]

_TURN = 2.0 * math.pi


@kernel
def near_boxes(A, B, is_turning, begins_behind, slack, pairs, turns):
    """Return the number of pairs of boxes that may touch, and fill as many as have room.

    ``A (2, a, n)`` and ``B (2, b, n)`` are lower and upper corners, ``pairs (k, 2)`` which ones
    and ``turns (k, n)`` after how many turns of coordinates where ``is_turning (n,)``. Boxes
    nearer than ``slack``, relative to their coordinates, may touch. ``begins_behind`` says that
    each pair of one list is wanted once.
    """
    count, n = 0, A.shape[2]
    turned = np.zeros(n)
    for i in range(A.shape[1]):
        for j in range(i + 1 if begins_behind else 0, B.shape[1]):
            is_near = True
            for k in range(n):
                size = max(abs(A[0, i, k]), abs(A[1, i, k]))
                size += max(abs(B[0, j, k]), abs(B[1, j, k]))
                least, most = B[0, j, k] - A[1, i, k], B[1, j, k] - A[0, i, k]
                least, most = least - slack * size, most + slack * size
                moved = 0.0
                if is_turning[k]:
                    turned[k] = math.ceil(least / _TURN)
                    moved = _TURN * turned[k]
                if not least <= moved <= most:
                    is_near = False
                    break
            if is_near:
                if count < len(pairs):
                    pairs[count, 0], pairs[count, 1] = i, j
                    turns[count] = turned
                count += 1
    return count


@kernel
def meet_quickly(A, b, firsts, pairs, starts, found):
    """Fill for each pair ``(k, 2)`` of sets POINT, EMPTY or OPEN, of their intersection.

    Set s is ``A x <= b`` with the rows from ``firsts[s]`` to ``firsts[s + 1]``; ``starts (k, n)``
    are where points are looked for.
    """
    n = A.shape[1]
    rows, sides, lengths = np.empty(A.shape), np.empty(len(b)), np.empty(len(b))
    is_fit = np.zeros(len(firsts) - 1, np.bool_)
    for s in range(len(is_fit)):
        own = slice(firsts[s], firsts[s + 1])
        is_fit[s] = unit_rows(A[own], b[own], rows[own], sides[own], lengths[own])
    x = np.empty(n)
    for k in range(len(pairs)):
        found[k] = OPEN
        i, j = pairs[k]
        if not (is_fit[i] and is_fit[j]):
            continue
        m = firsts[i + 1] - firsts[i] + firsts[j + 1] - firsts[j]
        some, right, long, columns = np.empty((m, n)), np.empty(m), np.empty(m), np.empty((n, m))
        at = 0
        for s in (i, j):
            for row in range(firsts[s], firsts[s + 1]):
                right[at], long[at] = sides[row], lengths[row]
                for c in range(n):
                    some[at, c] = columns[c, at] = rows[row, c]
                at += 1
        x[:] = starts[k]
        found[k] = point_of_unit_rows(some, columns, right, long, x)

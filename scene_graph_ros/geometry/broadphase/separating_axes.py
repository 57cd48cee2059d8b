"""Throw out candidate pairs that a plane across the line of their centres separates.

Boxes along the world's axes meet more often than what is in them, and this shows most of those
pairs to be apart, by a formula without a branch. What is left, the exact distance soon finds out.
"""

from __future__ import annotations

import math

from scene_graph_ros.geometry.broadphase.extents import BALL, half_extent, RADIUS
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.spatial.vectors import axpy, dot, subtract
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = ["drop_separated"]


@inlined_kernel
def _in_frame(X_WG, i, u):
    """Return a direction u in W in the frame of row i."""
    return (
        X_WG[i, 0, 0] * u[0] + X_WG[i, 1, 0] * u[1] + X_WG[i, 2, 0] * u[2],
        X_WG[i, 0, 1] * u[0] + X_WG[i, 1, 1] * u[1] + X_WG[i, 2, 1] * u[2],
        X_WG[i, 0, 2] * u[0] + X_WG[i, 1, 2] * u[1] + X_WG[i, 2, 2] * u[2],
    )


@inlined_kernel
def _axis(X_WG, i, k):
    """Return an axis of row i in W, or its origin."""
    return X_WG[i, 0, k], X_WG[i, 1, k], X_WG[i, 2, k]


@inlined_kernel
def _centre(centres, X_WG, i):
    """Return the centre of row i in W."""
    c = axpy(centres[i, 0], _axis(X_WG, i, 0), _axis(X_WG, i, 3))
    return axpy(centres[i, 2], _axis(X_WG, i, 2), axpy(centres[i, 1], _axis(X_WG, i, 1), c))


@inlined_kernel
def _coordinates(centres, X_WG, i):
    """Return the sum of the sizes of all coordinates that a centre is computed from."""
    total = abs(X_WG[i, 0, 3]) + abs(X_WG[i, 1, 3]) + abs(X_WG[i, 2, 3])
    return total + abs(centres[i, 0]) + abs(centres[i, 1]) + abs(centres[i, 2])


@inlined_kernel
def _reach(extents, centres, X_WG, i, u, length):
    """Return how far row i reaches at most from its centre along u, times the length of u."""
    x, y, z = _in_frame(X_WG, i, u)
    half = half_extent(extents, i, x, y, z) + extents[i, RADIUS] * length
    return min(half, centres[i, BALL] * length)


@inlined_kernel
def _are_separated(extents, centres, X_WG, i, j, margin):
    """Tell whether the line of centres shows rows i and j to be more than ``margin`` apart.

    Everything is times the distance of the centres. What is infinite or nan separates nothing.
    """
    u = subtract(_centre(centres, X_WG, j), _centre(centres, X_WG, i))
    square = dot(u, u)
    length = math.sqrt(square)
    half = _reach(extents, centres, X_WG, i, u, length)
    half += _reach(extents, centres, X_WG, j, u, length)
    largest = margin + _coordinates(centres, X_WG, i) + _coordinates(centres, X_WG, j)
    slack = BOX_ROUNDING * (length * largest + half)
    return square - half > length * margin + slack


@lean_kernel
def drop_separated(extents, centres, X_WG, pairs, count, margin):
    """Keep the pairs, in their order, that the line of centres does not show to be apart.

    Return how many of the first ``count`` are kept; they are moved to the front.

    Args:
        extents: from ``extents.extents_of``, n rows.
        centres: from ``extents.centres_of``.
        X_WG: (n, 4, 4) poses.
        pairs: (k, 2) rows, written to.
        count: at most k.
        margin: in metres; what is left out is further apart than this.

    """
    kept = 0
    for k in range(count):
        i, j = pairs[k, 0] & LAST_PLACE, pairs[k, 1] & LAST_PLACE
        pairs[kept & LAST_PLACE, 0], pairs[kept & LAST_PLACE, 1] = i, j
        kept += not _are_separated(extents, centres, X_WG, i, j, margin)
    return kept

"""Throw out candidate pairs that a plane across one of a few directions separates.

Boxes along the world's axes meet more often than what is in them. The line between the centres
and the axes of boxes and cylinders show most of these pairs to be apart, in much less time than
an exact distance takes.
"""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.geometry.broadphase.aabb import BOX, CYLINDER, extent_along, HALF_SPACE
from scene_graph_ros.geometry.jit import inlined_kernel, kernel
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = ["drop_separated"]


@inlined_kernel
def _extent(geometry, X_WG, i, u):
    """Return the least and the largest coordinate of row i along u in W, from its origin on."""
    x = X_WG[i, 0, 0] * u[0] + X_WG[i, 1, 0] * u[1] + X_WG[i, 2, 0] * u[2]
    y = X_WG[i, 0, 1] * u[0] + X_WG[i, 1, 1] * u[1] + X_WG[i, 2, 1] * u[2]
    z = X_WG[i, 0, 2] * u[0] + X_WG[i, 1, 2] * u[1] + X_WG[i, 2, 2] * u[2]
    return extent_along(geometry, i, x, y, z)


@inlined_kernel
def _separates(geometry, X_WG, i, j, u, margin):
    """Tell whether rows i and j are more than ``margin`` apart along the unit vector u."""
    low_i, high_i = _extent(geometry, X_WG, i, u)
    low_j, high_j = _extent(geometry, X_WG, j, u)
    along, largest = 0.0, margin
    for axis in range(3):
        p, q = X_WG[i, axis, 3], X_WG[j, axis, 3]
        along += u[axis] * (q - p)
        largest += abs(p) + abs(q)
    gap = max(along + low_j - high_i, low_i - high_j - along)
    largest += max(abs(low_i), abs(high_i)) + max(abs(low_j), abs(high_j))
    return gap > margin + BOX_ROUNDING * largest


@inlined_kernel
def _centre(geometry, X_WG, i, axis):
    """Return a coordinate in W of the middle of row i's box in G."""
    lower, upper = geometry[3], geometry[4]
    result = X_WG[i, axis, 3]
    for k in range(3):
        result += X_WG[i, axis, k] * 0.5 * (lower[i, k] + upper[i, k])
    return result


@inlined_kernel
def _own_axis_separates(geometry, X_WG, i, j, owner, margin):
    """Try the axes of row ``owner``, one of i and j: a box has three, a cylinder one."""
    kind = geometry[0][owner]
    if kind != BOX and kind != CYLINDER:
        return False
    for k in range(2, -1, -1):
        u = (X_WG[owner, 0, k], X_WG[owner, 1, k], X_WG[owner, 2, k])
        if _separates(geometry, X_WG, i, j, u, margin):
            return True
        if kind == CYLINDER:
            break
    return False


@inlined_kernel
def _are_separated(geometry, X_WG, i, j, margin):
    """Tell whether one of the directions shows that rows i and j are apart."""
    kinds = geometry[0]
    if kinds[i] == HALF_SPACE or kinds[j] == HALF_SPACE:
        return False
    x = _centre(geometry, X_WG, j, 0) - _centre(geometry, X_WG, i, 0)
    y = _centre(geometry, X_WG, j, 1) - _centre(geometry, X_WG, i, 1)
    z = _centre(geometry, X_WG, j, 2) - _centre(geometry, X_WG, i, 2)
    length = math.sqrt(x * x + y * y + z * z)
    if length > 0.0:
        u = (x / length, y / length, z / length)
        if _separates(geometry, X_WG, i, j, u, margin):
            return True
    return _own_axis_separates(geometry, X_WG, i, j, i, margin) or _own_axis_separates(
        geometry, X_WG, i, j, j, margin
    )


@kernel
def drop_separated(geometry, X_WG, pairs, margin):
    """Return the pairs, in their order, that no plane tried shows to be apart.

    Args:
        geometry: from ``aabb.box_geometry``.
        X_WG: (n, 4, 4) poses.
        pairs: (k, 2) rows.
        margin: in metres; what is left out is further apart than this.

    """
    kept = np.empty((len(pairs) + 1, 2), np.int64)  # one place to write what is not kept
    count = 0
    for k in range(len(pairs)):
        i, j = pairs[k, 0], pairs[k, 1]
        kept[count, 0], kept[count, 1] = i, j
        if not _are_separated(geometry, X_WG, i, j, margin):
            count += 1
    return kept[:count]

"""How many points of a cloud are in a box, at most: eight numbers tell, however large it is.

A grid of cells counts the points before each of its corners (Crow, *Summed-Area Tables for Texture
Mapping*, 1984, in three dimensions).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES

__all__ = ["CELLS", "count_points", "may_be_near"]

CELLS = 48
"""Along each axis of the box around all points."""

_STEP_Y, _STEP_Z = CELLS + 1, (CELLS + 1) ** 2


@inlined_kernel
def _cell_of(lower, scale, x):
    """Return the cell of a coordinate, one of those at the border beyond it. It grows with x."""
    return np.int64(min(max((x - lower) * scale, 0.0), CELLS - 1.0))


@inlined_kernel
def _scale(tree, axis):
    extent = tree.bounds[1, axis] - tree.bounds[0, axis]
    return (CELLS - 0.5) / extent if extent > 0.0 else 0.0


@lean_kernel
def _count(tree, counts):
    for leaf in range(len(tree.points)):
        for i in range(LANES):
            at = 0
            for axis in range(3):
                cell = _cell_of(
                    tree.bounds[0, axis], _scale(tree, axis), tree.points[leaf, axis, i]
                )
                at += (cell + 1) * (1 if axis == 0 else _STEP_Y if axis == 1 else _STEP_Z)
            counts[at] += 1
    for step in (1, _STEP_Y, _STEP_Z):
        for z in range(1, CELLS + 1):
            for y in range(1, CELLS + 1):
                first = z * _STEP_Z + y * _STEP_Y
                for x in range(first + 1, first + CELLS + 1):
                    counts[x] += counts[x - step]


def count_points(tree: Any) -> NDArray[np.int32]:
    """Return the counts ``((CELLS + 1)^3,)`` of a tree of points, x first."""
    counts = np.zeros((CELLS + 1) * (CELLS + 1) * (CELLS + 1), np.int32)
    _count(tree, counts)
    return counts


@inlined_kernel
def may_be_near(tree, counts, lower, upper):
    """Tell whether balls may be in a box along the axes of C."""
    low, high, radius = tree.bounds[0], tree.bounds[1], tree.radius[0]
    a, b, c = lower[0] - radius, lower[1] - radius, lower[2] - radius
    d, e, f = upper[0] + radius, upper[1] + radius, upper[2] + radius
    if a > high[0] or b > high[1] or c > high[2] or d < low[0] or e < low[1] or f < low[2]:
        return False
    sx, sy, sz = _scale(tree, 0), _scale(tree, 1), _scale(tree, 2)
    x, last_x = _cell_of(low[0], sx, a), _cell_of(low[0], sx, d) + 1
    y, last_y = _cell_of(low[1], sy, b) * _STEP_Y, (_cell_of(low[1], sy, e) + 1) * _STEP_Y
    z, last_z = _cell_of(low[2], sz, c) * _STEP_Z, (_cell_of(low[2], sz, f) + 1) * _STEP_Z
    behind = counts[last_x + last_y + last_z] - counts[x + last_y + last_z]
    behind += counts[x + y + last_z] - counts[last_x + y + last_z]
    before = counts[last_x + last_y + z] - counts[x + last_y + z]
    before += counts[x + y + z] - counts[last_x + y + z]
    return behind != before

"""World-aligned bounding boxes of all rows of a shape table."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.jit import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.meshes.shape_table import ShapeTable
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = ["bound_row", "box_geometry", "extent_along", "world_boxes"]

FloatArray = NDArray[np.float64]

SPHERE = int(ShapeKind.SPHERE)
CAPSULE = int(ShapeKind.CAPSULE)
BOX = int(ShapeKind.BOX)
CYLINDER = int(ShapeKind.CYLINDER)
ELLIPSOID = int(ShapeKind.ELLIPSOID)
HALF_SPACE = int(ShapeKind.HALF_SPACE)

MAX_HULL_VERTICES = 48
"""A hull with more vertices is bounded by its turned box in G: looking at every vertex would cost
more than the pairs that the tighter box saves."""


@inlined_kernel
def _half_extent(kind, size, x, y, z):
    """Return how far a centred shape reaches along a world axis with components x, y, z in G."""
    if kind == SPHERE:
        return size[0]
    if kind == CAPSULE:
        return size[0] + abs(z) * size[1]
    if kind == BOX:
        return abs(x) * size[0] + abs(y) * size[1] + abs(z) * size[2]
    if kind == CYLINDER:
        return size[0] * math.sqrt(x * x + y * y) + abs(z) * size[1]
    a, b, c = x * size[0], y * size[1], z * size[2]
    return math.sqrt(a * a + b * b + c * c)


@inlined_kernel
def _bound_hull(vertices, first, last, x, y, z):
    """Return the least and the largest coordinate of hull vertices along an axis in G."""
    low, high = math.inf, -math.inf
    for v in range(first, last):
        along = x * vertices[v, 0] + y * vertices[v, 1] + z * vertices[v, 2]
        low = min(low, along)
        high = max(high, along)
    return low, high


@inlined_kernel
def _bound_turned_box(lower, upper, x, y, z):
    """Return the least and the largest coordinate of a box in G along an axis."""
    middle = 0.5 * (
        x * (lower[0] + upper[0]) + y * (lower[1] + upper[1]) + z * (lower[2] + upper[2])
    )
    half = 0.5 * (
        abs(x) * (upper[0] - lower[0])
        + abs(y) * (upper[1] - lower[1])
        + abs(z) * (upper[2] - lower[2])
    )
    return middle - half, middle + half


@inlined_kernel
def extent_along(geometry, i, x, y, z):
    """Return the least and the largest coordinate of row i along a unit vector x, y, z in G.

    ``geometry`` is from ``box_geometry``; the row is no half space.
    """
    kinds, sizes, hull_rows, lower_G, upper_G, vertex_start, vertices = geometry
    hull = hull_rows[i]
    if hull < 0:
        high = _half_extent(kinds[i], sizes[i], x, y, z)
        return -high, high
    first, last = vertex_start[hull], vertex_start[hull + 1]
    if last - first <= MAX_HULL_VERTICES:
        return _bound_hull(vertices, first, last, x, y, z)
    return _bound_turned_box(lower_G[i], upper_G[i], x, y, z)


@inlined_kernel
def bound_row(geometry, X_WG, i, lower, upper):
    """Write the box of row i, rounded outwards; ``geometry`` is from ``box_geometry``."""
    is_half_space = geometry[0][i] == HALF_SPACE
    for axis in range(3):
        if is_half_space:
            lower[i, axis], upper[i, axis] = -math.inf, math.inf
            continue
        x, y, z, p = X_WG[i, axis, 0], X_WG[i, axis, 1], X_WG[i, axis, 2], X_WG[i, axis, 3]
        low, high = extent_along(geometry, i, x, y, z)
        slack = BOX_ROUNDING * (abs(p) + max(abs(low), abs(high)))
        lower[i, axis] = p + low - slack
        upper[i, axis] = p + high + slack


@lean_kernel
def _bound_rows(geometry, X_WG, lower, upper):
    for i in range(len(lower)):
        bound_row(geometry, X_WG, i, lower, upper)


def box_geometry(table: ShapeTable) -> tuple[NDArray[Any], ...]:
    """Return the columns of a table that decide the boxes: few, since each costs in a call."""
    hulls = table.hulls
    return (
        table.kind,
        table.size,
        table.hull,
        table.lower,
        table.upper,
        hulls.vertex_start,
        hulls.vertices,
    )


def world_boxes(table: ShapeTable, X_WG: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bound every shape of the table, rounded outwards.

    Args:
        table: ShapeTable of n rows.
        X_WG: (n, 4, 4) poses.

    Returns:
        lower and upper (n, 3), in metres in W; infinite for half spaces. Tight for primitives and
        for hulls of up to MAX_HULL_VERTICES vertices.

    """
    n = len(table.kind)
    lower, upper = np.empty((n, 3)), np.empty((n, 3))
    _bound_rows(box_geometry(table), X_WG, lower, upper)
    return lower, upper

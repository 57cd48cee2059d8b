"""World-aligned bounding boxes of all rows of a shape table."""

import math

import numpy as np

from scene_graph_ros.geometry.jit import kernel
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = ["world_boxes"]

SPHERE = int(ShapeKind.SPHERE)
CAPSULE = int(ShapeKind.CAPSULE)
BOX = int(ShapeKind.BOX)
CYLINDER = int(ShapeKind.CYLINDER)
ELLIPSOID = int(ShapeKind.ELLIPSOID)
HALF_SPACE = int(ShapeKind.HALF_SPACE)

MAX_HULL_VERTICES = 48
"""A hull with more vertices is bounded by its turned box in G: looking at every vertex would cost
more than the pairs that the tighter box saves."""


@kernel
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


@kernel
def _bound_hull(vertices, first, last, x, y, z):
    """Return the least and the largest coordinate of hull vertices along an axis in G."""
    low, high = math.inf, -math.inf
    for v in range(first, last):
        along = x * vertices[v, 0] + y * vertices[v, 1] + z * vertices[v, 2]
        low = min(low, along)
        high = max(high, along)
    return low, high


@kernel
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


@kernel
def world_boxes(table, X_WG):
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
    hulls = table.hulls
    for i in range(n):
        kind = table.kind[i]
        hull = table.hull[i]
        for axis in range(3):
            x, y, z, p = X_WG[i, axis, 0], X_WG[i, axis, 1], X_WG[i, axis, 2], X_WG[i, axis, 3]
            if kind == HALF_SPACE:
                lower[i, axis], upper[i, axis] = -math.inf, math.inf
                continue
            if hull < 0:
                high = _half_extent(kind, table.size[i], x, y, z)
                low = -high
            else:
                first, last = hulls.vertex_start[hull], hulls.vertex_start[hull + 1]
                if last - first <= MAX_HULL_VERTICES:
                    low, high = _bound_hull(hulls.vertices, first, last, x, y, z)
                else:
                    low, high = _bound_turned_box(table.lower[i], table.upper[i], x, y, z)
            slack = BOX_ROUNDING * (abs(p) + max(abs(low), abs(high)))
            lower[i, axis] = p + low - slack
            upper[i, axis] = p + high + slack
    return lower, upper

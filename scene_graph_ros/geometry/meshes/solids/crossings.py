"""Where a surface crosses itself: one point of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.meshes.bvh import build_bvh, traversal_stack
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, load_vector, norm, subtract

__all__ = ["first_crossing"]

_DEEP = 1e-9
"""Relative to the size: an edge that passes through a triangle by less only touches it."""


@lean_kernel
def _pierces(p, q, a, b, c, slack):
    """Return (pierces, x): whether the segment from p to q goes through a triangle, and where."""
    n = cross(subtract(b, a), subtract(c, a))
    length = norm(n)
    if length == 0.0:
        return False, p
    above, below = dot(n, subtract(p, a)) / length, dot(n, subtract(q, a)) / length
    if above * below >= 0.0 or min(abs(above), abs(below)) <= slack:
        return False, p
    x = axpy(above / (above - below), subtract(q, p), p)
    for first, last in ((a, b), (b, c), (c, a)):
        edge = subtract(last, first)
        inward = dot(cross(n, edge), subtract(x, first)) / (length * norm(edge))
        if inward <= slack:
            return False, p
    return True, x


@kernel
def _first(vertices, triangles, lower, upper, tree, slack):
    """Return (found, point) of the first triangle, in their order, that another one crosses."""
    node_lower, node_upper, left, right, order = tree
    stack = traversal_stack()
    point = np.zeros(3)
    for t in range(len(triangles)):
        stack[0], depth = 0, 1
        while depth > 0:
            depth -= 1
            node = stack[depth]
            meets = True
            for axis in range(3):
                meets = meets and lower[t, axis] <= node_upper[node, axis]
                meets = meets and upper[t, axis] >= node_lower[node, axis]
            if not meets:
                continue
            if left[node] >= 0:
                stack[depth], stack[depth + 1] = right[node], left[node]
                depth += 2
                continue
            for slot in range(-1 - left[node], -1 - left[node] + right[node]):
                s = order[slot]
                a = load_vector(vertices, triangles[s, 0])
                b = load_vector(vertices, triangles[s, 1])
                c = load_vector(vertices, triangles[s, 2])
                for k in range(3):
                    i, j = triangles[t, k], triangles[t, (k + 1) % 3]
                    shares = False
                    for corner in range(3):
                        shares = shares or triangles[s, corner] == i or triangles[s, corner] == j
                    if shares:
                        continue
                    p, q = load_vector(vertices, i), load_vector(vertices, j)
                    pierces, x = _pierces(p, q, a, b, c, slack)
                    if pierces:
                        point[0], point[1], point[2] = x
                        return True, point
    return False, point


def first_crossing(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64]
) -> NDArray[np.float64] | None:
    """Return a point (3,) where an edge passes through another triangle, or None.

    Args:
        vertices: (v, 3).
        triangles: (m, 3).

    """
    if not len(triangles):
        return None
    corners = vertices[triangles]
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    tree: tuple[Any, ...] = build_bvh(lower, upper)
    size = float((upper.max(axis=0) - lower.min(axis=0)).max())
    at, rows = np.array(vertices, order="C"), np.array(triangles, order="C")
    found, point = _first(at, rows, lower, upper, tree, _DEEP * size)
    return np.asarray(point) if found else None

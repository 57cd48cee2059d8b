"""How far one solid reaches out of another one, with a bound: branch and bound over boxes.

The distance to a solid, negative inside, changes by no more than the way that is gone. So it is,
anywhere in a cube, at most its value in the middle and half the cube's diagonal more. Cubes that
can't hold a point further out than one that is known, or none of the first solid, are left out;
others are cut into eight.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.meshes.bvh import traversal_stack
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers
from scene_graph_ros.geometry.meshes.surfaces import Surface
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, load_vector, subtract

__all__ = ["Reach", "farthest_outside"]

FloatArray = NDArray[np.float64]

_RELATIVE = 0.02
"""As a part of the result: how much more there may be than was found."""

_ABSOLUTE = 2e-3
"""As a part of the size: the same."""

_FIRST = 8
"""Cubes along the longest side, at first."""

_MOST_CUBES = 1_000_000
"""At a time. Where there are more, the bound is what it is by then."""


class Reach(NamedTuple):
    """Metres: the largest distance is between these two."""

    found: float
    """The distance of a point."""
    bound: float
    """No point is further away."""


@lean_kernel
def _square_to_segment(p, a, b):
    edge, arm = subtract(b, a), subtract(p, a)
    length = dot(edge, edge)
    t = min(max(dot(arm, edge) / length, 0.0), 1.0) if length > 0.0 else 0.0
    way = axpy(-t, edge, arm)
    return dot(way, way)


@lean_kernel
def _square_to_triangle(p, a, b, c):
    """Return the squared distance of a point and a triangle, of any area."""
    n = cross(subtract(b, a), subtract(c, a))
    square = dot(n, n)
    if square > 0.0:
        inside = dot(cross(n, subtract(b, a)), subtract(p, a)) >= 0.0
        inside = inside and dot(cross(n, subtract(c, b)), subtract(p, b)) >= 0.0
        inside = inside and dot(cross(n, subtract(a, c)), subtract(p, c)) >= 0.0
        if inside:
            height = dot(n, subtract(p, a))
            return height * height / square
    least = _square_to_segment(p, a, b)
    return min(least, min(_square_to_segment(p, b, c), _square_to_segment(p, c, a)))


@lean_kernel
def _square_to_box(p, lower, upper, node):
    total = 0.0
    for axis in range(3):
        way = max(max(lower[node, axis] - p[axis], p[axis] - upper[node, axis]), 0.0)
        total += way * way
    return total


@kernel
def _distances(points, vertices, triangles, tree):
    """Return (n,) distances of points (n, 3) from the nearest triangle."""
    lower, upper, left, right, order = tree
    stack = traversal_stack()
    result = np.empty(len(points))
    for i in range(len(points)):
        p = load_vector(points, i)
        best = np.inf
        stack[0], depth = 0, 1
        while depth > 0:
            depth -= 1
            node = stack[depth]
            if _square_to_box(p, lower, upper, node) >= best:
                continue
            if left[node] < 0:
                for slot in range(-1 - left[node], -1 - left[node] + right[node]):
                    t = order[slot]
                    a = load_vector(vertices, triangles[t, 0])
                    b = load_vector(vertices, triangles[t, 1])
                    c = load_vector(vertices, triangles[t, 2])
                    best = min(best, _square_to_triangle(p, a, b, c))
                continue
            near, far = left[node], right[node]
            if _square_to_box(p, lower, upper, near) > _square_to_box(p, lower, upper, far):
                near, far = far, near
            stack[depth], stack[depth + 1] = far, near
            depth += 2
        result[i] = np.sqrt(best)
    return result


def _signed(points: FloatArray, surface: Surface) -> FloatArray:
    """Return (n,) distances of points from a solid and its sheets, negative inside."""
    names = ("node_lower", "node_upper", "node_left", "node_right", "order")
    tree: tuple[Any, ...] = tuple(getattr(surface, name) for name in names)
    vertices, triangles = surface.vertices, surface.triangles
    at = np.ascontiguousarray(points)
    distance: FloatArray = _distances(at, vertices, triangles, tree)
    if len(points) and surface.solid_parts:
        is_inside = winding_numbers(at, vertices, triangles[surface.is_solid]) > 0
        distance = np.where(is_inside, -distance, distance)
    return distance


def farthest_outside(body: Surface, other: Surface) -> Reach:
    """Return the largest distance of a point of one solid, or its sheets, outside of another."""
    used = body.vertices[np.unique(body.triangles)]
    lower, upper = used.min(axis=0), used.max(axis=0)
    size = float((upper - lower).max())
    best = max(0.0, float(_signed(used, other).max()))
    edge = size / _FIRST
    counts = np.maximum(np.ceil((upper - lower) / edge), 1.0).astype(np.int64)
    steps = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    middles = lower + (steps + 0.5) * edge
    eighths = np.stack(np.meshgrid(*[[-0.25, 0.25]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    while True:
        radius = 0.5 * np.sqrt(3.0) * edge
        outside_body = _signed(middles, body)
        middles = middles[outside_body <= radius]
        outside_body = outside_body[outside_body <= radius]
        outside_other = _signed(middles, other)
        # The nearest point of the body is as near to the other one but for the way there.
        attained = outside_other - np.maximum(outside_body, 0.0)
        best = max(best, float(attained.max(initial=0.0)))
        slack = max(_RELATIVE * best, _ABSOLUTE * size)
        is_open = outside_other + radius > best + slack
        if not is_open.any():
            return Reach(best, best + slack)
        middles, highest = middles[is_open], float(outside_other[is_open].max())
        if 8 * len(middles) > _MOST_CUBES:
            return Reach(best, max(best + slack, highest + radius))
        middles = (middles[:, None] + edge * eighths).reshape(-1, 3)
        edge *= 0.5

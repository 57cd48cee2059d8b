"""Nearest points of two triangles, or that they cut each other.

Apart, the nearest points include a corner of one triangle, or lie on an edge of each; so six
corners are measured to the other triangle and nine pairs of edges to each other. Triangles cut
each other where an edge of one passes through the other.
"""

import math

from scene_graph_ros.geometry.jit import kernel
from scene_graph_ros.geometry.query.distance.segments import nearest_on_segments
from scene_graph_ros.geometry.query.point.flat_features import nearest_on_triangle
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    cross,
    dot,
    scale,
    subtract,
    unit,
)

__all__ = ["distance_triangle_triangle"]


@kernel
def _pick(triangle, k):
    if k == 0:
        return triangle[0]
    return triangle[1] if k == 1 else triangle[2]


@kernel
def _passes_through(p, q, triangle, n):
    """Return whether segment pq passes through the triangle from one side to the other."""
    a, b, c = triangle
    start, end = dot(n, subtract(p, a)), dot(n, subtract(q, a))
    if not start * end < 0.0:
        return False
    x = axpy(start / (start - end), subtract(q, p), p)
    return (
        dot(cross(n, subtract(b, a)), subtract(x, a)) >= 0.0
        and dot(cross(n, subtract(c, b)), subtract(x, b)) >= 0.0
        and dot(cross(n, subtract(a, c)), subtract(x, c)) >= 0.0
    )


@kernel
def _cut(first, second, n_first, n_second):
    for k in range(3):
        p, q = _pick(first, k), _pick(first, (k + 1) % 3)
        if _passes_through(p, q, second, n_second):
            return True
        p, q = _pick(second, k), _pick(second, (k + 1) % 3)
        if _passes_through(p, q, first, n_first):
            return True
    return False


@kernel
def _between_edges(first, second, least):
    """Return (square, x, y, n): the nearest points of two edges, where closer than sqrt(least)."""
    best, x, y, n = math.inf, first[0], second[0], (0.0, 0.0, 0.0)
    for i in range(3):
        p, q = _pick(first, i), _pick(first, (i + 1) % 3)
        h, c = scale(0.5, subtract(q, p)), scale(0.5, add(p, q))
        for j in range(3):
            r, s = _pick(second, j), _pick(second, (j + 1) % 3)
            k, d = scale(0.5, subtract(s, r)), subtract(scale(0.5, add(r, s)), c)
            u, v, m = nearest_on_segments(d, h, k)
            on_first, on_second = axpy(u, h, c), axpy(v, k, add(c, d))
            gap = subtract(on_first, on_second)
            square = dot(gap, gap)
            if square < least:
                best, least, x, y = square, square, on_first, on_second
                n = m if dot(m, gap) >= 0.0 else scale(-1.0, m)
    return best, x, y, n


@kernel
def distance_triangle_triangle(first, second, n_first, n_second):
    """Return (distance, x, n): 0 where the triangles cut each other, and else their distance.

    ``first`` and ``second`` hold three corners each, with their unit normals. x is the nearest
    point of the first, n the unit vector from the second's, x - distance n, towards it.
    """
    if _cut(first, second, n_first, n_second):
        return 0.0, first[0], n_second
    least, x, n = math.inf, first[0], n_second
    for k in range(3):
        corner = _pick(first, k)
        y, square, feature = nearest_on_triangle(corner, second[0], second[1], second[2], n_second)
        if square < least:
            least, x = square, corner
            gap = subtract(corner, y)
            n = unit(gap, n_second)
            if feature == 0:
                n = n_second if dot(gap, n_second) >= 0.0 else scale(-1.0, n_second)
        corner = _pick(second, k)
        y, square, feature = nearest_on_triangle(corner, first[0], first[1], first[2], n_first)
        if square < least:
            least, x = square, y
            gap = subtract(y, corner)
            n = unit(gap, n_first)
            if feature == 0:
                n = n_first if dot(gap, n_first) >= 0.0 else scale(-1.0, n_first)
    square, on_first, on_second, m = _between_edges(first, second, least)
    if square < least:
        least, x = square, on_first
        n = m if dot(m, m) > 0.0 else unit(subtract(on_first, on_second), n)
    return math.sqrt(least), x, n

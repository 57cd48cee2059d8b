"""Nearest points of two triangles, or that they cut each other.

Apart, the nearest points include a corner of one triangle, or lie on an edge of each; so six
corners are measured to the other triangle and nine pairs of edges to each other. Triangles cut
each other where an edge of one passes through the other.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
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
from scene_graph_ros.geometry.tolerances import COINCIDENCE

__all__ = ["distance_triangle_triangle", "reach_of"]

_SHARE = 0.01
"""By how much more of a square two contacts are surely not as near as each other; e below."""


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


@lean_kernel
def reach_of(triangle, n, x):
    """Return a triangle's height above the plane through x, along n."""
    a, b, c = triangle
    return max(dot(n, subtract(a, x)), dot(n, subtract(b, x)), dot(n, subtract(c, x)))


@lean_kernel
def _reach_between(first, second, contact):
    """Return the support of the triangles between the planes of a contact (square, x, y, n)."""
    _, x, y, n = contact
    return max(reach_of(first, scale(-1.0, n), x), reach_of(second, n, y))


@lean_kernel
def _better(first, second, new, old, rounding):
    """Return the better of two contacts (square, x, y, n).

    Of two as near as each other, to ``rounding``, it is the one whose planes have the triangles
    behind them: beside an edge, distances tell to half the digits only whether it is the nearest.
    """
    # No less than (root + 2 rounding)^2, as 4 root rounding <= e old + 4 rounding^2 / e.
    if new[0] > (1.0 + _SHARE) * old[0] + 4.0 * (1.0 + 1.0 / _SHARE) * rounding * rounding:
        return old
    if not abs(math.sqrt(new[0]) - math.sqrt(old[0])) <= rounding:
        return new if new[0] < old[0] else old
    beyond_new = _reach_between(first, second, new)
    beyond_old = _reach_between(first, second, old)
    if abs(beyond_new - beyond_old) <= rounding:
        return new if new[0] < old[0] else old
    return new if beyond_new < beyond_old else old


@kernel
def _between_edges(first, second, best, rounding):
    """Return the better of a contact and those of the nine pairs of edges."""
    for i in range(3):
        p, q = _pick(first, i), _pick(first, (i + 1) % 3)
        h, c = scale(0.5, subtract(q, p)), scale(0.5, add(p, q))
        for j in range(3):
            r, s = _pick(second, j), _pick(second, (j + 1) % 3)
            k, d = scale(0.5, subtract(s, r)), subtract(scale(0.5, add(r, s)), c)
            u, v, m = nearest_on_segments(d, h, k)
            x, y = axpy(u, h, c), axpy(v, k, add(c, d))
            gap = subtract(x, y)
            if dot(m, m) > 0.0:
                n = m if dot(m, gap) >= 0.0 else scale(-1.0, m)
            else:
                n = unit(gap, best[3])
            best = _better(first, second, (dot(gap, gap), x, y, n), best, rounding)
    return best


@lean_kernel
def _largest(triangle):
    """Return the largest coordinate of a triangle."""
    a, b, c = triangle
    largest = 0.0
    for axis in range(3):
        largest = max(largest, abs(a[axis]), abs(b[axis]), abs(c[axis]))
    return largest


@kernel
def distance_triangle_triangle(first, second, n_first, n_second):
    """Return (distance, x, n): 0 where the triangles cut each other, and else their distance.

    ``first`` and ``second`` hold three corners each, with their unit normals. x is the nearest
    point of the first, n the unit vector from the second's, x - distance n, towards it.
    """
    if _cut(first, second, n_first, n_second):
        return 0.0, first[0], n_second
    rounding = COINCIDENCE * max(_largest(first), _largest(second))
    best = (math.inf, first[0], second[0], n_second)
    for k in range(3):
        corner = _pick(first, k)
        y, square, feature = nearest_on_triangle(corner, second[0], second[1], second[2], n_second)
        gap = subtract(corner, y)
        n = unit(gap, n_second)
        if feature == 0:
            n = n_second if dot(gap, n_second) >= 0.0 else scale(-1.0, n_second)
        best = _better(first, second, (square, corner, y, n), best, rounding)
        corner = _pick(second, k)
        x, square, feature = nearest_on_triangle(corner, first[0], first[1], first[2], n_first)
        gap = subtract(x, corner)
        n = unit(gap, n_first)
        if feature == 0:
            n = n_first if dot(gap, n_first) >= 0.0 else scale(-1.0, n_first)
        best = _better(first, second, (square, x, corner, n), best, rounding)
    square, x, _, n = _between_edges(first, second, best, rounding)
    return math.sqrt(square), x, n

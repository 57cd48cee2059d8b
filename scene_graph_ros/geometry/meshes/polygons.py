"""Cut polygons into triangles that use all their corners, by clipping ears.

A corner on a straight side stays, so that a neighbour that has it too is still a neighbour. A
polygon may come back to its own corners and sides, as where holes are bridged to the outline. One
of n corners becomes n - 2 triangles in any case.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.solids.mesh_report import Repair

__all__ = ["CROSSED", "MOST_CORNERS", "triangles_of_polygons"]

CROSSED = "faces cut that cross themselves"
"""The kind of repair."""

_STRAIGHT = 1e-9
"""Relative to the square of the longer side: a corner that turns by less is on a straight side."""

_ROUNDING = 1e-12
"""Relative to the square of a triangle's longest side: by as little may a corner be on either side
of a line that it is on."""

MOST_CORNERS = 20_000
"""Of a face that is not convex: time grows with their square, to some three seconds."""

_WHOLE, _CROSSES, _TOO_LONG = 0, 1, 2
"""How a polygon is."""

_MOST_MISSES = 16
"""After as many steps without an ear a polygon crosses itself, and no more are looked for."""

_SPIKE = 2.0
"""A quality above that of any triangle, which is below one."""


@lean_kernel
def _turn(points, a, b, c):
    """Return twice the signed area of three points of the plane."""
    u0, u1 = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    v0, v1 = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    return u0 * v1 - u1 * v0


@lean_kernel
def _square(points, a, b):
    x, y = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    return x * x + y * y


@lean_kernel
def _is_same(points, a, b):
    return points[a, 0] == points[b, 0] and points[a, 1] == points[b, 1]


@lean_kernel
def _goes_between(points, o, p, q, k, slack):
    """Return whether the way from o to k is between those to p and to q, less than half a turn."""
    return _turn(points, o, p, k) > slack and _turn(points, o, k, q) > slack


@lean_kernel
def _blocks(points, k, ways, a, i, c, slack):
    """Return whether the polygon, at its corner k, is in the triangle a, i, c.

    Two corners may be one point, and a corner may be on a side, as where a hole is bridged to the
    outline: then the ways to the corners before and after k (``ways``) decide. On the side from c
    to a, which is cut, it blocks, as its triangles would end in the middle of another's side; with
    a slack it does not.
    """
    for o, p, q in ((a, i, c), (i, c, a), (c, a, i)):
        if _is_same(points, k, o):
            before = _goes_between(points, o, p, q, ways[0], slack)
            return before or _goes_between(points, o, p, q, ways[1], slack)
    first, second, cut = _turn(points, a, i, k), _turn(points, i, c, k), _turn(points, c, a, k)
    if first < -slack or second < -slack or cut < -slack:
        return False
    if slack > 0.0 and cut <= slack:
        return False
    if first > slack and second > slack:
        return True
    for way in ways:
        if first <= slack and _turn(points, a, i, way) > slack:
            return True
        if second <= slack and _turn(points, i, c, way) > slack:
            return True
    return False


@lean_kernel
def _is_spike(points, a, i, c):
    """Return whether the ways from i to a and to c are the same, or there is none."""
    x0, y0 = points[a, 0] - points[i, 0], points[a, 1] - points[i, 1]
    x1, y1 = points[c, 0] - points[i, 0], points[c, 1] - points[i, 1]
    return x0 * x1 + y0 * y1 > 0.0 or _is_same(points, a, i) or _is_same(points, c, i)


@lean_kernel
def _quality(points, after, before, i, left, slack):
    """Return the quality of corner i as an ear: its area by the square of its longest side, or -1.

    ``slack`` is relative to that square: of as little a turn it is not known whether it is one.
    The tip of a spike without area, and a corner that is there twice, are the best ears.
    """
    a, c = before[i], after[i]
    area = _turn(points, a, i, c)
    longest = max(_square(points, a, i), _square(points, i, c), _square(points, c, a))
    if abs(area) <= _ROUNDING * longest and _is_spike(points, a, i, c):
        return _SPIKE
    if area <= slack * longest:
        return -1.0
    k = after[c]
    for _ in range(left - 3):
        if _blocks(points, k, (before[k], after[k]), a, i, c, slack * longest):
            return -1.0
        k = after[k]
    return area / longest


@lean_kernel
def _is_strictly_convex(points):
    """Return whether all corners turn left, by more than rounding, and a fan covers it once."""
    n = len(points)
    for i in range(n):
        j, k = (i + 1) % n, (i + 2) % n
        longest = max(_square(points, i, j), _square(points, j, k))
        if not _turn(points, i, j, k) > _STRAIGHT * longest:
            return False
    is_once = True
    for i in range(1, n - 1):
        is_once = is_once and _turn(points, 0, i, i + 1) > 0.0
    return is_once


@lean_kernel
def _best_ear(points, after, before, quality, start, left, slack):
    """Return the corner that is the best ear by known qualities, by another look, or with a slack.

    Its quality is negative where there is none.
    """
    best = start
    for again in range(3):
        k = start
        for _ in range(left):
            if again > 0:
                loose = slack if again == 1 else _ROUNDING
                quality[k] = _quality(points, after, before, k, left, loose)
            if quality[k] > quality[best]:
                best = k
            k = after[k]
        if quality[best] > 0.0:
            break
    return best


@lean_kernel
def _least_turn(points, after, before, start, left):
    """Return the corner that turns least: the rest has no area, or crosses itself."""
    best, k, least = start, start, np.inf
    for _ in range(left):
        turn = abs(_turn(points, before[k], k, after[k]))
        if turn < least:
            best, least = k, turn
        k = after[k]
    return best


@lean_kernel
def _winding(points, x, y):
    """Return a polygon's winding number around a point, by sides that cross a ray along x."""
    number, n = 0, len(points)
    for a in range(n):
        b = (a + 1) % n
        if (points[a, 1] <= y) == (points[b, 1] <= y):
            continue
        # A side that is gone back along is crossed there as well, to the last bit.
        low, high = (a, b) if points[a, 1] <= y else (b, a)
        t = (y - points[low, 1]) / (points[high, 1] - points[low, 1])
        if x < points[low, 0] + t * (points[high, 0] - points[low, 0]):
            number += 1 if low == a else -1
    return number


@lean_kernel
def _winding_at(points, triangle, u, v):
    """Return a polygon's winding number around a point of a triangle, by two of its weights."""
    a, b, c = triangle
    x = u * points[a, 0] + v * points[b, 0] + (1.0 - u - v) * points[c, 0]
    y = u * points[a, 1] + v * points[b, 1] + (1.0 - u - v) * points[c, 1]
    return _winding(points, x, y)


@lean_kernel
def _is_covered_once(points, triangles):
    """Return whether all triangles with an area run as the polygon does, once around them."""
    for i in range(len(triangles)):
        a, b, c = triangles[i]
        longest = max(_square(points, a, b), _square(points, b, c), _square(points, c, a))
        area = _turn(points, a, b, c)
        if abs(area) <= _STRAIGHT * longest:
            continue
        if area < 0.0:
            return False
        # At one point it could be a spike that is in the way.
        if _winding_at(points, triangles[i], 0.31, 0.42) != 1 and (
            _winding_at(points, triangles[i], 0.53, 0.19) != 1
        ):
            return False
    return True


@kernel
def _clip_ears(points, out, slack):
    """Write the triangles of a polygon that need not cross itself; ears have a slack at first."""
    n = len(points)
    after, before = np.empty(n, np.int64), np.empty(n, np.int64)
    quality = np.empty(n)
    for i in range(n):
        after[i], before[i] = (i + 1) % n, (i + n - 1) % n
    for i in range(n):
        quality[i] = _quality(points, after, before, i, n, slack)
    start, misses = 0, 0
    for step in range(n - 2):
        left = n - step
        best = start
        if misses < _MOST_MISSES:
            best = _best_ear(points, after, before, quality, start, left, slack)
        if misses == _MOST_MISSES or quality[best] < 0.0:
            misses = min(misses + 1, _MOST_MISSES)
            best = _least_turn(points, after, before, start, left)
        a, c = before[best], after[best]
        out[step, 0], out[step, 1], out[step, 2] = a, best, c
        after[a], before[c], start = c, a, a
        if left > 3 and misses < _MOST_MISSES:
            quality[a] = _quality(points, after, before, a, left - 1, slack)
            quality[c] = _quality(points, after, before, c, left - 1, slack)


@kernel
def _ears(points, out):
    """Write the n - 2 triangles (rows of points) of a polygon that runs counter-clockwise.

    Returns _WHOLE, _CROSSES, or _TOO_LONG where it is not cut.
    """
    n = len(points)
    if _is_strictly_convex(points):
        for i in range(n - 2):
            out[i, 0], out[i, 1], out[i, 2] = 0, i + 1, i + 2
        return _WHOLE
    if n > MOST_CORNERS:
        return _TOO_LONG
    _clip_ears(points, out, 0.0)
    if _is_covered_once(points, out):
        return _WHOLE
    # An ear may have been wrong by rounding, where corners and sides are passed several times.
    other = np.empty_like(out)
    _clip_ears(points, other, _ROUNDING)
    if _is_covered_once(points, other):
        out[:] = other
        return _WHOLE
    return _CROSSES


@kernel
def _all_ears(points, out, found):
    """Write the triangles (k, n - 2, 3) of polygons (k, n, 2), and how each of them is."""
    for p in range(len(points)):
        found[p] = _ears(points[p], out[p])


def triangles_of_polygons(
    vertices: NDArray[np.float64],
    corners: NDArray[np.int64],
    sizes: NDArray[np.int64],
    name: str,
    repairs: list[Repair],
) -> NDArray[np.int64]:
    """Return (m, 3) places in ``corners`` of the triangles of polygons, in their order.

    Args:
        vertices: (v, 3) of any numbers.
        corners: (c,) the vertices of all polygons, one polygon after another.
        sizes: (p,) how many corners each has, three at least.
        name: the mesh's name in messages.
        repairs: gets one more where polygons cross themselves: their inside is a guess.

    Raises MeshError for a polygon of more than MOST_CORNERS that is not convex.

    """
    starts = np.cumsum(sizes) - sizes
    first = np.cumsum(sizes - 2) - (sizes - 2)
    result = np.empty((int((sizes - 2).sum()), 3), dtype=np.int64)
    crossed: list[int] = []
    for size in np.unique(sizes):
        rows = np.flatnonzero(sizes == size)
        places = starts[rows, None] + np.arange(size)
        triangles = np.zeros((len(rows), size - 2, 3), dtype=np.int64)
        triangles[:] = (0, 1, 2)
        if size > 3:
            found = np.zeros(len(rows), dtype=np.int64)
            _all_ears(_projected(vertices[corners[places]]), triangles, found)
            if (found == _TOO_LONG).any():
                raise MeshError(
                    f"{name}: a face of {size} corners that is not convex; more than"
                    f" {MOST_CORNERS} are refused: export triangles"
                )
            crossed += rows[found == _CROSSES].tolist()
        into = first[rows, None] + np.arange(size - 2)
        result[into] = np.take_along_axis(
            places, triangles.reshape(len(rows), -1), axis=1
        ).reshape(triangles.shape)
    if crossed:
        row = min(crossed)
        x, y, z = (float(c) for c in vertices[corners[starts[row]]])
        repairs.append(Repair(CROSSED, len(crossed), (x, y, z)))
    return result


def _projected(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (k, n, 2): polygons (k, n, 3) along their normals of Newell, counter-clockwise."""
    with np.errstate(all="ignore"):
        arms = points - points[:, :1]
        normal = np.cross(arms, np.roll(arms, -1, axis=1)).sum(axis=1)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        # What has no normal lies in no plane in particular.
        normal[~np.isfinite(normal).all(axis=1)] = (0.0, 0.0, 1.0)
        along = np.cross(normal, np.eye(3)[np.abs(normal).argmin(axis=1)])
        along /= np.linalg.norm(along, axis=1)[:, None]
        other = np.cross(normal, along)
        u, v = (np.einsum("kni,ki->kn", arms, axis) for axis in (along, other))
    return np.ascontiguousarray(np.stack([u, v], axis=2))

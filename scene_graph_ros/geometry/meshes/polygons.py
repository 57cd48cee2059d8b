"""Cut polygons into triangles that use all their corners, by clipping ears.

A corner on a straight side stays, so that a neighbour that has it too is still a neighbour. A
polygon of n corners becomes n - 2 triangles, whatever it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel

__all__ = ["triangles_of_polygons"]

_STRAIGHT = 1e-9
"""Relative to the square of the longer side: a corner that turns by less is on a straight side."""


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
def _quality(points, after, before, i, left):
    """Return how good an ear corner i is: its area by the square of its longest side, or -1."""
    a, c = before[i], after[i]
    area = _turn(points, a, i, c)
    if area <= 0.0:
        return -1.0
    k = after[c]
    for _ in range(left - 3):
        # A corner on the side that is cut would be left outside of the rest.
        inside = _turn(points, a, i, k) >= 0.0 and _turn(points, i, c, k) >= 0.0
        if inside and _turn(points, c, a, k) >= 0.0:
            is_same = _square(points, k, a) == 0.0 or _square(points, k, c) == 0.0
            if not is_same:
                return -1.0
        k = after[k]
    longest = max(_square(points, a, i), _square(points, i, c), _square(points, c, a))
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
def _best_ear(points, after, before, quality, start, left):
    """Return the corner that is the best ear, or one that turns least wrongly without any."""
    best = start
    for again in range(2):
        k = start
        for _ in range(left):
            if again == 1:
                quality[k] = _quality(points, after, before, k, left)
            if quality[k] > quality[best]:
                best = k
            k = after[k]
        if quality[best] > 0.0:
            return best
    # It crosses itself, or is flat: any corner will do.
    k, most = start, -np.inf
    for _ in range(left):
        turn = _turn(points, before[k], k, after[k])
        if turn > most:
            best, most = k, turn
        k = after[k]
    return best


@kernel
def _ears(points, out):
    """Write the n - 2 triangles (rows of points) of a polygon that runs counter-clockwise."""
    n = len(points)
    if _is_strictly_convex(points):
        for i in range(n - 2):
            out[i, 0], out[i, 1], out[i, 2] = 0, i + 1, i + 2
        return
    after, before = np.empty(n, np.int64), np.empty(n, np.int64)
    quality = np.empty(n)
    for i in range(n):
        after[i], before[i] = (i + 1) % n, (i + n - 1) % n
    for i in range(n):
        quality[i] = _quality(points, after, before, i, n)
    start = 0
    for step in range(n - 2):
        left = n - step
        best = _best_ear(points, after, before, quality, start, left)
        a, c = before[best], after[best]
        out[step, 0], out[step, 1], out[step, 2] = a, best, c
        after[a], before[c], start = c, a, a
        if left > 3:
            quality[a] = _quality(points, after, before, a, left - 1)
            quality[c] = _quality(points, after, before, c, left - 1)


@kernel
def _all_ears(points, out):
    """Write the triangles (k, n - 2, 3) of polygons (k, n, 2)."""
    for p in range(len(points)):
        _ears(points[p], out[p])


def triangles_of_polygons(
    vertices: NDArray[np.float64], corners: NDArray[np.int64], sizes: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return (m, 3) places in ``corners`` of the triangles of polygons, in their order.

    Args:
        vertices: (v, 3) of any numbers.
        corners: (c,) the vertices of all polygons, one polygon after another.
        sizes: (p,) how many corners each has, three at least.

    """
    starts = np.cumsum(sizes) - sizes
    first = np.cumsum(sizes - 2) - (sizes - 2)
    result = np.empty((int((sizes - 2).sum()), 3), dtype=np.int64)
    for size in np.unique(sizes):
        rows = np.flatnonzero(sizes == size)
        places = starts[rows, None] + np.arange(size)
        triangles = np.zeros((len(rows), size - 2, 3), dtype=np.int64)
        triangles[:] = (0, 1, 2)
        if size > 3:
            _all_ears(_projected(vertices[corners[places]]), triangles)
        into = first[rows, None] + np.arange(size - 2)
        result[into] = np.take_along_axis(
            places, triangles.reshape(len(rows), -1), axis=1
        ).reshape(triangles.shape)
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

"""Cut sheets where they pass through a solid, and leave out their parts inside of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.meshes.bvh import build_bvh
from scene_graph_ros.geometry.meshes.solids.overlaps import meeting_boxes
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers

__all__ = ["outside_of_solid"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_CORNERS = 24
"""A polygon with so many is not cut further."""

_BESIDE = 1e-9
"""Relative to the mesh's size: a sheet this near to the solid is no surface of its own."""


def outside_of_solid(
    corners: FloatArray, vertices: FloatArray, triangles: IntArray, size: float
) -> tuple[FloatArray, IntArray]:
    """Return the parts of a sheet's triangles outside of a solid.

    Args:
        corners: (n, 3, 3) of the sheet.
        vertices: (v, 3) of the solid.
        triangles: (m, 3) of the solid.
        size: metres, of both.

    Returns:
        corners (k, 3, 3), and which triangle of the sheet each is of (k,).

    """
    solid = vertices[triangles]
    slack = _BESIDE * size
    tree: tuple[Any, ...] = build_bvh(solid.min(axis=1) - slack, solid.max(axis=1) + slack)
    pairs = meeting_boxes(corners.min(axis=1), corners.max(axis=1), tree)
    pairs = pairs[_may_cross(corners[pairs[:, 0]], solid[pairs[:, 1]], slack)]
    rows = np.unique(pairs[:, 0])
    whole = np.setdiff1d(np.arange(len(corners)), rows)
    pieces, owner = [corners[whole]], [whole]
    starts = np.append(np.searchsorted(pairs[:, 0], rows), len(pairs))
    for row, start, end in zip(rows, starts[:-1], starts[1:], strict=True):
        cut = _cut(corners[row], solid[pairs[start:end, 1]], slack)
        pieces.append(cut)
        owner.append(np.full(len(cut), row))
    found, of = np.concatenate(pieces), np.concatenate(owner)
    kept = ~_is_inside(found, vertices, triangles, slack)
    return found[kept], of[kept]


def _normals(corners: FloatArray) -> FloatArray:
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(n, axis=1)
    return n / np.where(length > 0.0, length, 1.0)[:, None]


def _may_cross(one: FloatArray, other: FloatArray, slack: float) -> NDArray[np.bool_]:
    """Tell of pairs of triangles (k, 3, 3) whether neither is beside the plane of the other."""
    result = np.ones(len(one), dtype=bool)
    for first, second in ((one, other), (other, one)):
        n = _normals(second)
        heights = np.einsum("kij,kj->ki", first - second[:, :1], n)
        result &= (heights.min(axis=1) < -slack) & (heights.max(axis=1) > slack)
    return result


@kernel
def _pieces(triangle, normals, points, lower, upper, slack):
    """Cut a triangle (3, 3) along planes n . (x - point) = 0, each where its triangle's box is.

    Return (polygons (k, _CORNERS, 3), counts (k,)), convex.
    """
    polygons, counts = np.empty((16, _CORNERS, 3)), np.empty(16, np.int64)
    polygons[0, :3], counts[0], total = triangle, 3, 1
    heights = np.empty(_CORNERS)
    for plane in range(len(normals)):
        for i in range(total):
            count, least, most, meets = counts[i], np.inf, -np.inf, True
            for axis in range(3):
                low, high = polygons[i, 0, axis], polygons[i, 0, axis]
                for v in range(1, count):
                    low = min(low, polygons[i, v, axis])
                    high = max(high, polygons[i, v, axis])
                meets = meets and high >= lower[plane, axis] and low <= upper[plane, axis]
            if not meets or count + 2 > _CORNERS:
                continue
            for v in range(count):
                heights[v] = 0.0
                for axis in range(3):
                    arm = polygons[i, v, axis] - points[plane, axis]
                    heights[v] += normals[plane, axis] * arm
                least, most = min(least, heights[v]), max(most, heights[v])
            if least > -slack or most < slack:
                continue
            if total == len(counts):
                longer, more = np.empty((2 * total, _CORNERS, 3)), np.empty(2 * total, np.int64)
                longer[:total], more[:total] = polygons, counts
                polygons, counts = longer, more
            whole = polygons[i, :count].copy()
            counts[i] = _half(whole, heights, 1.0, polygons[i])
            counts[total] = _half(whole, heights, -1.0, polygons[total])
            total += 1
    return polygons[:total].copy(), counts[:total].copy()


@kernel
def _half(polygon, heights, side, half):
    """Write the corners of a convex polygon (k, 3) on one side into ``half``; return how many."""
    count = 0
    for i in range(len(polygon)):
        j = (i + 1) % len(polygon)
        here, there = side * heights[i], side * heights[j]
        if here >= 0.0:
            half[count] = polygon[i]
            count += 1
        if here * there < 0.0:
            half[count] = polygon[i] + (here / (here - there)) * (polygon[j] - polygon[i])
            count += 1
    return count


def _cut(triangle: FloatArray, across: FloatArray, slack: float) -> FloatArray:
    """Return a triangle (3, 3) cut along the planes of triangles (k, 3, 3): (n, 3, 3)."""
    lower, upper = across.min(axis=1) - slack, across.max(axis=1) + slack
    points = np.ascontiguousarray(across[:, 0])
    at = np.ascontiguousarray(triangle)
    polygons, counts = _pieces(at, _normals(across), points, lower, upper, slack)
    fans = [
        polygons[counts > k + 1][:, [0, k, k + 1]]
        for k in range(1, int(counts.max(initial=3)) - 1)
    ]
    return np.concatenate(fans)


def _is_inside(
    corners: FloatArray, vertices: FloatArray, triangles: IntArray, slack: float
) -> NDArray[np.bool_]:
    """Return a mask of the triangles inside of a solid, or on its boundary."""
    middles, step = corners.mean(axis=1), slack * _normals(corners)
    inside = winding_numbers(middles + step, vertices, triangles) > 0
    return inside | (winding_numbers(middles - step, vertices, triangles) > 0)

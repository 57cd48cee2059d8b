"""Open or close flat folds, so that cutting finds the inside.

Two triangles of a surface that lie on each other, back to back or face to face, have nothing
between them. They are moved apart or into each other by PRESSED: where the solid is on both sides
of them, outwards, so that they overlap in it; where it is on neither, inwards, so that the space
between them winds the other way. Cutting along their crossings then drops both.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.meshes.bvh import build_bvh, traversal_stack
from scene_graph_ros.geometry.meshes.kernel_arrays import for_kernels
from scene_graph_ros.geometry.meshes.solids.overlaps import next_leaf
from scene_graph_ros.geometry.meshes.solids.press import (
    gap_between,
    moved,
    PRESSED,
    SHARED,
    TOUCHING,
)
from scene_graph_ros.geometry.meshes.solids.triangle_normals import unit_normals
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers
from scene_graph_ros.geometry.meshes.triangle_boxes import triangle_boxes
from scene_graph_ros.geometry.spatial.sums import product

__all__ = ["first_fold", "unfolded"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_BESIDE = 1e-9
"""Relative to the size: how far from a fold it is asked what is inside."""


@kernel
def _folds(vertices, triangles, normals, lower, upper, tree, flat, shared):
    """Return pairs (k, 2) of triangles that lie on each other."""
    order = tree[4]
    stack = traversal_stack()
    pairs, count = np.empty((64, 2), np.int64), 0
    for t in range(len(triangles)):
        stack[0] = 0
        slot, end, depth = next_leaf(stack, 1, lower, upper, t, tree)
        while slot < end:
            for k in range(slot, end):
                s = order[k]
                if s <= t:
                    continue
                if gap_between(vertices, triangles, normals, t, s, -flat, flat, shared) < -flat:
                    continue
                if count == len(pairs):
                    longer = np.empty((2 * count, 2), np.int64)
                    longer[:count] = pairs
                    pairs = longer
                pairs[count, 0], pairs[count, 1] = t, s
                count += 1
            slot, end, depth = next_leaf(stack, depth, lower, upper, t, tree)
    return pairs[:count].copy()


def _pairs(vertices: FloatArray, triangles: IntArray, flat: float, shared: float) -> IntArray:
    normals = unit_normals(vertices, triangles)
    lower, upper = triangle_boxes(vertices, triangles)
    tree: tuple[Any, ...] = build_bvh(lower - flat, upper + flat)
    arrays = map(for_kernels, (vertices, triangles, normals, lower, upper))
    return np.asarray(_folds(*arrays, tree, flat, shared))


def first_fold(
    vertices: FloatArray, triangles: IntArray, flat: float = TOUCHING, shared: float = SHARED
) -> FloatArray | None:
    """Return a corner (3,) of two of (m, 3) triangles that lie on each other, or None.

    They are nearer than ``flat``, and overlap by more than ``shared``, both relative to the
    largest coordinate.
    """
    if not len(triangles):
        return None
    size = float(np.abs(vertices[triangles]).max())
    pairs = _pairs(vertices, triangles, flat * size, shared * size)
    return vertices[triangles[pairs[0, 0], 0]] if len(pairs) else None


def unfolded(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Return vertices (v, 3) moved where oriented triangles (m, 3) lie on each other."""
    corners = vertices[triangles]
    size = float(np.abs(corners).max())
    normals = unit_normals(vertices, triangles)
    pairs = _pairs(vertices, triangles, TOUCHING * size, SHARED * size)
    if not len(pairs):
        return vertices
    middles = np.array([_common_middle(corners[t], corners[s], normals[t]) for t, s in pairs])
    step = _BESIDE * size * normals[pairs[:, 0]]
    sides = [winding_numbers(middles + k * step, vertices, triangles) > 0 for k in (1, -1)]
    ways = np.where(sides[0] | sides[1], 1.0, -1.0) * PRESSED * size
    rows, first = np.unique(pairs.reshape(-1), return_index=True)
    return moved(vertices, triangles[rows], normals[rows], np.repeat(ways, 2)[first])


def _common_middle(one: FloatArray, other: FloatArray, n: FloatArray) -> FloatArray:
    """Return the middle of the polygon that two triangles (3, 3) of one plane have in common."""
    polygon = list(other)
    for k in range(3):
        out = np.cross(one[(k + 1) % 3] - one[k], n)
        heights = [float(product(p - one[k], out)) for p in polygon]
        cut = []
        for i, (p, h) in enumerate(zip(polygon, heights, strict=True)):
            following = (i + 1) % len(polygon)
            if h <= 0.0:
                cut.append(p)
            if h * heights[following] < 0.0:
                share = h / (h - heights[following])
                cut.append(p + share * (polygon[following] - p))
        polygon = cut or polygon
    return np.asarray(np.mean(polygon, axis=0))

"""Press faces of parts that touch into each other, so that their union has no gap of rounding.

Where faces of two parts lie in one plane and face each other, what a turned mesh's coordinates
say of the gap between them is rounding. Each is moved outwards by PRESSED, which is more than
rounding and less than the promised accuracy: then the parts overlap.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.bvh import build_bvh
from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows
from scene_graph_ros.geometry.meshes.solids.overlaps import meeting_boxes
from scene_graph_ros.geometry.spatial.sums import least_squares

__all__ = ["pressed_together"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

PRESSED = 1e-12
"""Relative to the size: how far touching faces are moved."""

_TOUCHING = 5e-14
"""Relative to the size: faces whose corners are this near to each other's planes touch."""

_SHARED = 1e-9
"""Relative to the size: triangles that overlap by less in their plane share an edge at most."""

_FACING = 1e-6
"""Faces whose normals add up to a longer vector are in different planes, however near."""


def pressed_together(vertices: FloatArray, triangles: IntArray, part: IntArray) -> FloatArray:
    """Return (v, 3) vertices moved where triangles (m, 3) of different parts (m,) touch."""
    corners = vertices[triangles]
    size = float(np.abs(corners).max())
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    slack = _TOUCHING * size
    tree: tuple[Any, ...] = build_bvh(lower - slack, upper + slack)
    pairs = meeting_boxes(lower, upper, tree)
    pairs = pairs[part[pairs[:, 0]] < part[pairs[:, 1]]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    normals /= np.where(length > 0.0, length, 1.0)[:, None]
    facing = np.linalg.norm(normals[pairs[:, 0]] + normals[pairs[:, 1]], axis=1) <= _FACING
    pairs = pairs[facing]
    if not len(pairs):
        return vertices
    near = np.ones(len(pairs), dtype=bool)
    for one, other in ((0, 1), (1, 0)):
        n, at = normals[pairs[:, one]], corners[pairs[:, one], :1]
        heights = np.einsum("kij,kj->ki", corners[pairs[:, other]] - at, n)
        near &= np.abs(heights).max(axis=1) <= slack
        for k in range(3):
            # Beside an edge of the one, the other has no area in common with it.
            start = corners[pairs[:, one], k]
            out = np.cross(corners[pairs[:, one], (k + 1) % 3] - start, n)
            out /= np.maximum(np.linalg.norm(out, axis=1), np.finfo(np.float64).tiny)[:, None]
            beyond = np.einsum("kij,kj->ki", corners[pairs[:, other]] - start[:, None], out)
            near &= beyond.min(axis=1) < -_SHARED * size
    moved = np.unique(pairs[near])
    if not len(moved):
        return vertices
    return _moved(vertices, triangles[moved], normals[moved], PRESSED * size)


def _moved(
    vertices: FloatArray, triangles: IntArray, normals: FloatArray, by: float
) -> FloatArray:
    """Return vertices (v, 3) such that triangles (k, 3) are moved along their normals (k, 3)."""
    result = vertices.copy()
    at = triangles.reshape(-1)
    order = np.argsort(at, kind="stable")
    rows, starts = np.unique(at[order], return_index=True)
    for row, which in zip(rows, np.split(order, starts[1:]), strict=True):
        # Triangles of one face have normals that are equal but for rounding.
        planes = distinct_rows(np.round(normals[which // 3], 6)).first
        along = normals[which // 3][planes]
        result[row] += least_squares(along, np.full(len(along), by), 1e-3)
    return result

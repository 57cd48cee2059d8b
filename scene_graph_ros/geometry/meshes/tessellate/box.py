"""Boxes: one convex cell per face, between the face and the part of the medial axis above it.

Inside a cell the nearest point of the surface is on the cell's own face, so the distance to the
surface is linear there, and the tetrahedra of the cells represent it without error. Nothing is
gained by smaller ones: a resolution hint is accepted and changes nothing.
"""

from __future__ import annotations

from functools import lru_cache
import itertools

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.tessellate.solid import Solid
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.spatial.sums import length
from scene_graph_ros.geometry.tolerances import MEDIAL_AXIS

__all__ = ["surface_box", "volume_box"]

IntArray = NDArray[np.int64]
Signs = tuple[int, ...]

_CORNERS: list[Signs] = list(itertools.product((-1, 1), repeat=3))


def surface_box(
    shape: Box, resolution_hint: float | None = None
) -> tuple[NDArray[np.float64], IntArray]:
    """Return the 8 corners (8, 3), m, and 12 triangles (12, 3)."""
    del resolution_hint
    solid = volume_box(shape)
    return solid.vertices[:8], solid.triangles


def volume_box(shape: Box, resolution_hint: float | None = None, margin: float = 0.0) -> Solid:
    """Return the solid; ``margin`` (m) moves every face out, and leaves the medial axis."""
    del resolution_hint
    half = 0.5 * np.array([shape.width, shape.depth, shape.height])
    deepest = half.min()
    medial = half - deepest
    medial[medial <= MEDIAL_AXIS * half] = 0.0
    signs, tetrahedra, triangles = _topology(
        (bool(medial[0] > 0.0), bool(medial[1] > 0.0), bool(medial[2] > 0.0))
    )
    vertices = signs * medial
    vertices[:8] = signs[:8] * (half + margin)
    extent = np.ones(len(vertices))
    extent[:8] = -margin / deepest if margin else 0.0
    return Solid(vertices, tetrahedra, triangles, extent)


@lru_cache(maxsize=8)
def _topology(long: tuple[bool, bool, bool]) -> tuple[NDArray[np.float64], IntArray, IntArray]:
    """Triangulate all boxes whose medial axis extends along the axes marked as ``long``.

    Returns:
        (v, 3) signs of the corners, then of the medial vertices; tetrahedra (t, 4) and the
        triangles (12, 3) of the surface. Read-only.

    """
    medial = sorted({tuple(s if is_long else 0 for s, is_long in zip(c, long, strict=True))
                     for c in _CORNERS})  # fmt: skip
    signs = np.array(_CORNERS + medial, dtype=np.float64)
    cells = [_cell(medial, axis, side) for axis in range(3) for side in (-1, 1)]
    example = np.where(np.arange(len(signs))[:, None] < 8, 2.0 * signs, signs * (0.5, 0.75, 0.25))
    tetrahedra = np.array([t for cell in cells for t in _pulled(cell, cells, example)])
    triangles = np.array([t for cell in cells for t in _fan(sorted(cell)[:4], example)])
    tetrahedra = _turned(tetrahedra, example, np.zeros((len(tetrahedra), 3)))
    triangles = _turned(triangles, example, example[triangles].mean(axis=1))
    for array in (signs, tetrahedra, triangles):
        array.flags.writeable = False
    return signs, tetrahedra, triangles


def _cell(medial: list[Signs], axis: int, side: int) -> frozenset[int]:
    """Return the vertices of the cell of one face: its corners and its medial vertices."""
    corners = [k for k, c in enumerate(_CORNERS) if c[axis] == side]
    above = [8 + k for k, c in enumerate(medial) if c[axis] in (0, side)]
    return frozenset(corners + above)


def _pulled(
    cell: frozenset[int], cells: list[frozenset[int]], points: NDArray[np.float64]
) -> list[tuple[int, ...]]:
    """Join the last vertex of a cell with the triangles of all its faces that lack it.

    Every face is cut by a fan from its own last vertex, whichever cell asks, so that neighbours
    agree. The last vertices are medial ones, so no tetrahedron lies on the surface alone.
    """
    apex = max(cell)
    shared = [cell & other for other in cells if other != cell]
    faces = [face for face in shared if len(face) > 2] + [frozenset(sorted(cell)[:4])]
    return [
        (*triangle, apex)
        for face in faces
        if apex not in face
        for triangle in _fan(sorted(face), points)
    ]


def _fan(corners: list[int], points: NDArray[np.float64]) -> list[tuple[int, int, int]]:
    """Cut a triangle or quadrilateral into triangles at its last vertex."""
    *others, last = corners
    if len(others) == 2:
        return [(others[0], others[1], last)]
    # The opposite corner of the last one is furthest from it along the diagonal: the corner
    # whose diagonal the two others lie on both sides of.
    far = max(others, key=lambda k: length(points[k] - points[last]))
    return [(k, far, last) for k in others if k != far]


def _turned(
    elements: IntArray, points: NDArray[np.float64], outward: NDArray[np.float64]
) -> IntArray:
    """Turn tetrahedra to positive volume, or triangles to face the direction ``outward``."""
    a, b, c = (points[elements[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    if elements.shape[1] == 4:
        outward = points[elements[:, 3]] - a
    wrong = np.einsum("ij,ij->i", normal, outward) < 0.0
    elements = np.ascontiguousarray(elements, dtype=np.int64)
    elements[wrong, 1], elements[wrong, 2] = elements[wrong, 2], elements[wrong, 1].copy()
    return elements

"""The boundary of the points around which triangles wind, also where they cross themselves.

The triangles are cut along the curves where they cross (``arrangement``), and those polygons are
kept that have nothing above them and the solid below, by winding numbers (Zhou, Grinspun, Zorin,
Jacobson 2016, "Mesh arrangements for solid geometry"). Instead of treating each kind of contact,
vertices are first moved by random steps smaller than the promised accuracy.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows, used_indices
from scene_graph_ros.geometry.meshes.solids.arrangement import arrangement
from scene_graph_ros.geometry.meshes.solids.half_edges import edges_of
from scene_graph_ros.geometry.meshes.solids.levels import area_vectors, numbers_above, rings_of
from scene_graph_ros.geometry.meshes.solids.piercing import DegenerateError
from scene_graph_ros.geometry.meshes.solids.regions import region_boxes

__all__ = ["Resolved", "resolved"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_WHOLE = 51
"""Bits of the largest coordinate, in whole numbers."""

_STEPS = (256, 1024)
"""In 2^-51 of the largest coordinate: how far vertices are moved, in one try after another."""


class Resolved(NamedTuple):
    """The boundary of the points around which triangles wind."""

    points: FloatArray
    """(k, 3), each within 1e-12 of the size beside the given surface."""
    triangles: IntArray
    """(n, 3), closed."""
    moved: FloatArray
    """(v, 3): the given vertices as they were moved."""
    negative: FloatArray
    """(r, 2, 3): boxes around all points with winding number -1 or less."""
    multiple: FloatArray
    """(r, 2, 3): the same with winding number 2 or more."""


def resolved(vertices: FloatArray, triangles: IntArray) -> Resolved | None:
    """Return the boundary of the points with winding number 1 or more, or None.

    Args:
        vertices: (v, 3).
        triangles: (m, 3), closed: each edge is run through as often one way as the other.

    Returns:
        the boundary, or None where rounding left an open edge, in each try.

    Raises:
        TooManyError: the triangles cross each other too often.

    """
    triangles, times = _counted(triangles)
    if not len(triangles):
        nowhere = np.zeros((0, 2, 3))
        return Resolved(vertices[:0], triangles, vertices, nowhere, nowhere)
    rng = np.random.default_rng(5)
    fraction, exponent = math.frexp(np.abs(vertices[triangles]).max())
    unit = math.ldexp(1.0, exponent - (fraction == 0.5) - _WHOLE)
    whole = np.round(vertices / unit)
    for step in _STEPS:
        try:
            moved = whole + rng.integers(-step, step + 1, whole.shape)
            points, faces, negative, multiple = _boundary(moved, triangles, times)
        except DegenerateError:
            continue
        if _is_balanced(faces):
            used, faces = used_indices(faces, len(points))
            boxes = negative * unit, multiple * unit
            return Resolved(points[used] * unit, faces, moved * unit, *boxes)
    return None


def _counted(triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Return one triangle for all on the same vertices, and how many (m,) run its way.

    No step apart separates those. As many that run the other way are taken off; where none is
    left, the triangles bound nothing.
    """
    distinct = distinct_rows(np.sort(triangles, axis=1))
    a, b, c = triangles.T
    runs_up = ((a < b) & (b < c)) | ((b < c) & (c < a)) | ((c < a) & (a < b))
    surplus = np.zeros(len(distinct.first), dtype=np.int64)
    np.add.at(surplus, distinct.inverse, np.where(runs_up, 1, -1))
    rows = triangles[distinct.first]
    surplus *= np.where(runs_up[distinct.first], 1, -1)
    rows = np.where((surplus < 0)[:, None], rows[:, ::-1], rows)
    kept = surplus != 0
    return np.ascontiguousarray(rows[kept]), np.abs(surplus[kept])


def _boundary(
    vertices: FloatArray, triangles: IntArray, times: IntArray
) -> tuple[FloatArray, IntArray, FloatArray, FloatArray]:
    points, polygons, source, is_front = arrangement(vertices, triangles)
    whole = np.setdiff1d(np.arange(len(triangles)), source)
    rings = rings_of(polygons, triangles[whole], np.concatenate([source, whole]))
    above = numbers_above(points, rings, is_front, vertices, triangles, times)
    below = above + times[rings.source]
    is_boundary = (above <= 0) & (below >= 1)
    # A fan from the middle of a polygon has no triangle on a straight side.
    is_fan = is_boundary & (np.bincount(rings.polygon) > 3)
    number = len(points) + np.cumsum(is_fan) - 1
    side = np.flatnonzero(is_fan[rings.polygon])
    fans = np.stack([rings.start[side], rings.end[side], number[rings.polygon[side]]], axis=1)
    side = np.flatnonzero((is_boundary & ~is_fan)[rings.polygon])
    faces = np.concatenate([rings.start[side].reshape(-1, 3), fans])
    return (
        np.concatenate([points, area_vectors(points, rings)[0][is_fan]]),
        faces,
        region_boxes(points, rings, above < 0, below < 0),
        region_boxes(points, rings, above > 1, below > 1),
    )


def _is_balanced(triangles: IntArray) -> bool:
    """Tell whether each edge is run through as often one way as the other."""
    edges = edges_of(triangles)
    way = np.where(edges.start < edges.end, 1, -1)
    return not np.bincount(edges.rows(), way).any()

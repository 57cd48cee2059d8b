"""The faces of a contact surface, as kernels collect them: one row of numbers each."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.cutting.clip import drop_short_edges, measure
from scene_graph_ros.geometry.cutting.polygons import POLYGON_CORNERS
from scene_graph_ros.geometry.meshes.embedding import barycentric_coordinates
from scene_graph_ros.geometry.spatial.vectors import load_vector, norm, subtract

__all__ = ["Faces", "add_face", "grown", "new_rows", "unpack", "weights_in"]

_CENTROID = 0
_AREA = 3
_NORMAL = 4
_ELEMENT_A = 7
_ELEMENT_B = 8
_COUNT = 9
_CORNERS = 10
_WIDTH = _CORNERS + 3 * POLYGON_CORNERS
_FIRST_CAPACITY = 64

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Faces(NamedTuple):
    """f polygons, sorted by their elements; positions are from the origin of the body A."""

    start: IntArray
    """(f + 1,) polygon i owns ``corners[start[i]:start[i + 1]]``."""
    corners: FloatArray
    """(n, 3) metres, counter-clockwise about the normal."""
    centroids: FloatArray
    """(f, 3) metres."""
    areas: FloatArray
    """(f,) square metres."""
    normals: FloatArray
    """(f, 3) unit vectors out of B, into A."""
    element_A: IntArray
    """(f,) the tetrahedron of A that a face is in."""
    element_B: IntArray
    """(f,) the tetrahedron of B, or for a rigid B the triangle, that it is in."""


@kernel
def new_rows():
    """Return room for some faces."""
    return np.empty((_FIRST_CAPACITY, _WIDTH))


@kernel
def grown(rows):
    """Return twice the room, with the faces so far."""
    more = np.empty((2 * rows.shape[0], rows.shape[1]))
    more[: rows.shape[0]] = rows
    return more


@lean_kernel
def add_face(rows, count, polygon, corners, normal, element_A, element_B, resolution):
    """Write a polygon into row ``count``; return the new count, the same if it is too narrow.

    A face narrower than ``resolution`` (metres) is none, and nor is a side that is shorter.
    """
    corners = drop_short_edges(polygon, corners, resolution)
    if corners == 0:
        return count
    area, centroid = measure(polygon, corners, normal)
    first = load_vector(polygon, 0)
    length = 0.0
    for k in range(1, corners):
        length = max(length, norm(subtract(load_vector(polygon, k), first)))
    if not area > resolution * length:
        return count
    row = rows[count]
    for axis in range(3):
        row[_CENTROID + axis] = centroid[axis]
        row[_NORMAL + axis] = normal[axis]
        for k in range(corners):
            row[_CORNERS + 3 * k + axis] = polygon[k, axis]
    row[_AREA] = area
    row[_ELEMENT_A] = element_A
    row[_ELEMENT_B] = element_B
    row[_COUNT] = corners
    return count + 1


def unpack(rows: FloatArray) -> Faces:
    """Take the rows of f faces apart, sorted by their elements in A, then in B.

    The order in which a hierarchy is walked depends on the frame; theirs does not.
    """
    rows = rows[np.lexsort((rows[:, _ELEMENT_B], rows[:, _ELEMENT_A]))]
    counts = rows[:, _COUNT].astype(np.int64)
    used = np.arange(POLYGON_CORNERS) < counts[:, None]
    start = np.zeros(len(rows) + 1, np.int64)
    np.cumsum(counts, out=start[1:])
    return Faces(
        start=start,
        corners=rows[:, _CORNERS:].reshape(-1, POLYGON_CORNERS, 3)[used],
        centroids=rows[:, _CENTROID : _CENTROID + 3].copy(),
        areas=rows[:, _AREA].copy(),
        normals=rows[:, _NORMAL : _NORMAL + 3].copy(),
        element_A=rows[:, _ELEMENT_A].astype(np.int64),
        element_B=rows[:, _ELEMENT_B].astype(np.int64),
    )


@kernel
def _weights(points, vertices, tetrahedra, rows):
    result = np.empty((len(points), 4))
    for i in range(len(points)):
        t = rows[i]
        w = barycentric_coordinates(
            load_vector(points, i),
            load_vector(vertices, tetrahedra[t, 0]),
            load_vector(vertices, tetrahedra[t, 1]),
            load_vector(vertices, tetrahedra[t, 2]),
            load_vector(vertices, tetrahedra[t, 3]),
        )
        for k in range(4):
            result[i, k] = w[k]
    return result


def weights_in(points: FloatArray, vertices: Any, tetrahedra: Any, rows: IntArray) -> FloatArray:
    """Return ``(f, 4)``: the barycentric coordinates of each point in the tetrahedron of its row.

    ``points`` is ``(f, 3)`` and ``rows`` ``(f,)``.
    """
    result: FloatArray = _weights(points, vertices, tetrahedra, rows)
    return result

"""A triangulated surface as data: vertices, triangles and derived quantities."""

from __future__ import annotations

from functools import cached_property
import math
import os

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.io import checked_mesh, read_mesh
from scene_graph_ros.geometry.meshes.mesh_points import (
    check_vertices,
    checked_element,
    checked_points,
)
from scene_graph_ros.geometry.meshes.surfaces import is_closed_surface
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.spatial.sums import product

__all__ = ["SurfaceMesh", "read_obj_to_surface_mesh"]

FloatArray = NDArray[np.float64]


class SurfaceMesh:
    """Vertices in a frame M, in metres, and triangles counter-clockwise seen from outside.

    It is taken as it is given: nothing is welded, dropped or turned. All arrays are read-only.
    """

    def __init__(self, vertices: ArrayLike, triangles: ArrayLike) -> None:
        """Take ``(n, 3)`` positions and ``(m, 3)`` indices, m > 0.

        Raises:
            MeshError: an array is empty or of another shape or type, a coordinate not finite or
                beyond MAX_COORDINATE, or an index out of range.

        """
        points, corners = checked_mesh(vertices, triangles, "SurfaceMesh")
        check_vertices(points, "SurfaceMesh")
        if not len(corners):
            raise MeshError("SurfaceMesh: there are no triangles")
        points.flags.writeable = False
        corners.flags.writeable = False
        self._vertices, self._triangles = points, corners

    @property
    def vertices(self) -> FloatArray:
        """(n, 3) metres."""
        return self._vertices

    @property
    def triangles(self) -> NDArray[np.int64]:
        """(m, 3) indices into ``vertices``."""
        return self._triangles

    @property
    def num_vertices(self) -> int:
        """The number of vertices."""
        return len(self._vertices)

    @property
    def num_triangles(self) -> int:
        """The number of triangles."""
        return len(self._triangles)

    @cached_property
    def _area_vectors(self) -> FloatArray:
        a, b, c = (self._vertices[self._triangles[:, k]] for k in range(3))
        return 0.5 * np.cross(b - a, c - a)

    @cached_property
    def areas(self) -> FloatArray:
        """(m,) square metres."""
        return _frozen(np.linalg.norm(self._area_vectors, axis=1))

    @cached_property
    def face_normals(self) -> FloatArray:
        """(m, 3) unit vectors; zero for a triangle without area."""
        lengths = np.where(self.areas > 0.0, self.areas, 1.0)
        return _frozen(self._area_vectors / lengths[:, None])

    @cached_property
    def element_centroids(self) -> FloatArray:
        """(m, 3) metres: the centroid of each triangle."""
        return _frozen(self._vertices[self._triangles].mean(axis=1))

    @property
    def total_area(self) -> float:
        """Square metres."""
        return float(self.areas.sum())

    @property
    def centroid(self) -> FloatArray:
        """(3,) metres: of the surface, not the volume inside; the vertices' mean without area."""
        if not self.total_area > 0.0:
            return self._vertices.mean(axis=0)
        return product(self.areas, self.element_centroids) / self.total_area

    @property
    def volume(self) -> float:
        """Cubic metres inside, negative if the triangles face inwards (divergence theorem).

        Raises:
            MeshError: the mesh is not closed.

        """
        if not self.is_closed:
            raise MeshError("SurfaceMesh: a mesh that is not closed has no volume")
        arms = self.element_centroids - self._vertices[0]
        return float(np.einsum("ij,ij->", arms, self._area_vectors)) / 3.0

    @cached_property
    def is_closed(self) -> bool:
        """Whether every edge is shared by two triangles that run through it in opposite ways."""
        return is_closed_surface(self._triangles)

    def bounding_box(self) -> tuple[FloatArray, FloatArray]:
        """Return the lower and the upper corner ``(3,)`` of the box around all vertices."""
        return self._vertices.min(axis=0), self._vertices.max(axis=0)

    def calc_barycentric(self, p_MQ: ArrayLike, triangle: int) -> FloatArray:
        """Return the barycentric weights ``(3,)`` of point Q's projection to a triangle's plane.

        They add up to 1, and all are at least 0 where that is in the triangle. ``(m, 3)`` of
        points ``(m, 3)``. Raises MeshError for a triangle that is not there or has no area, and
        for points that are not finite.
        """
        points = checked_points(p_MQ, "calc_barycentric")
        t = checked_element(triangle, self.num_triangles, "calc_barycentric: triangle")
        if not self.areas[t] > 0.0:
            raise MeshError(f"calc_barycentric: triangle {t} has no area")
        corners = self._vertices[self._triangles[t]]
        # Of two areas each, and the third from the sum: as exact as the corners are.
        normal = self._area_vectors[t] / float(self.areas[t]) ** 2
        arms = corners - points[..., np.newaxis, :]
        doubled = np.stack(
            [np.cross(arms[..., k - 2, :], arms[..., k - 1, :]) for k in range(3)], axis=-2
        )
        return np.asarray(0.5 * np.sum(doubled * normal, axis=-1), dtype=np.float64)

    def cartesian_from_barycentric(self, triangle: int, weights: ArrayLike) -> FloatArray:
        """Return ``(3,)``, the point of a triangle with barycentric ``weights`` (3,).

        Raises MeshError for weights that are not three numbers.
        """
        rule = "cartesian_from_barycentric: weights must be finite numbers (3,)"
        three = real_array(weights, rule, MeshError)
        if three.shape != (3,) or not np.isfinite(three).all():
            raise MeshError(f"{rule}, not {quoted(weights)}")
        point: FloatArray = product(three, self._vertices[self._triangles[triangle]])
        return point

    def __repr__(self) -> str:
        return f"SurfaceMesh(vertices=<{self.num_vertices}>, triangles=<{self.num_triangles}>)"


def _frozen(array: FloatArray) -> FloatArray:
    array.flags.writeable = False
    return array


def read_obj_to_surface_mesh(filename: str | os.PathLike[str], scale: float = 1.0) -> SurfaceMesh:
    """Read a file of any known format, Wavefront OBJ among them, and scale it about its origin.

    Raises:
        MeshError: the file can't be read, is no mesh or has no triangles, or ``scale`` is not a
            positive finite number.

    """
    file: object = filename
    if not isinstance(file, (str, os.PathLike)):
        raise MeshError(f"filename must be a path, not {quoted(file)}")
    factor = as_float(scale)
    if factor is None or not 0.0 < factor < math.inf:
        raise MeshError(
            f"scale of {quoted(os.fspath(filename))} must be positive and finite: {quoted(scale)}"
        )
    vertices, triangles = read_mesh(filename)
    if not len(triangles):
        raise MeshError(f"mesh file {os.fspath(filename)!r}: there are no triangles")
    with np.errstate(over="ignore"):  # what is not finite is refused
        scaled = factor * vertices
    return SurfaceMesh(scaled, triangles)

"""Convex hulls, and meshes that are their own hull: a star from the deepest point.

The extent is 1 at the centre of the largest ball inside and falls linearly to 0 on the surface
along every ray, which the star represents without error. The faces are the hull's own, so a
resolution hint changes nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.deepest_point import deepest_point
from scene_graph_ros.geometry.meshes.hull import Hull
from scene_graph_ros.geometry.meshes.sources import hull_of
from scene_graph_ros.geometry.meshes.tessellate.geodesic import star
from scene_graph_ros.geometry.meshes.tessellate.margin import grown
from scene_graph_ros.geometry.meshes.tessellate.solid import Solid
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.tolerances import DEEPEST_POINT

__all__ = ["surface_convex", "volume_convex"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def surface_convex(
    shape: MeshShape, resolution_hint: float | None = None
) -> tuple[FloatArray, IntArray]:
    """Return the hull's vertices (v, 3), m, and its triangles (t, 3).

    Raises MeshError where the hull is flat, or as ``hull_of``.
    """
    del resolution_hint
    hull = _solid_hull(shape)
    return hull.vertices, _triangles(hull)


def volume_convex(
    shape: MeshShape, resolution_hint: float | None = None, margin: float = 0.0
) -> Solid:
    """Return the solid; ``margin`` (m) puts a layer of prisms around it.

    Raises MeshError as ``surface_convex`` does.
    """
    del resolution_hint
    hull = _solid_hull(shape)
    triangles = _triangles(hull)
    count = len(hull.vertices)
    centre, depth = deepest_point(
        hull.normals, hull.offsets, hull.vertices.mean(axis=0), DEEPEST_POINT
    )
    if not depth > 0.0:
        raise MeshError(f"{shape!r} is too thin for tetrahedra: no point is deep inside")
    vertices = np.concatenate([hull.vertices, centre[None]])
    extent = np.zeros(count + 1)
    extent[-1] = 1.0
    solid = Solid(vertices, star(triangles, count), triangles, extent)
    return grown(solid, margin, depth, repr(shape)) if margin else solid


def _solid_hull(shape: MeshShape) -> Hull:
    hull = hull_of(shape)
    if len(hull.faces) < 4:
        raise MeshError(f"{shape!r} is flat: it has no volume")
    return hull


def _triangles(hull: Hull) -> IntArray:
    """Cut the faces into triangles, each by the fan whose smallest triangle is largest."""
    sizes = np.array([len(face) for face in hull.faces])
    parts = []
    for size in np.unique(sizes):
        faces = np.array([hull.faces[k] for k in np.flatnonzero(sizes == size)])
        parts.append(faces if size == 3 else _best_fans(hull.vertices, faces))
    return np.concatenate(parts).reshape(-1, 3)


def _best_fans(vertices: FloatArray, faces: IntArray) -> IntArray:
    """Cut (f, n) convex polygons into fans, (f (n - 2), 3)."""
    count, n = faces.shape
    best = np.full(count, -1.0)
    result = np.empty((count, n - 2, 3), dtype=np.int64)
    for k in range(n):
        turned = np.roll(faces, -k, axis=1)
        first = np.repeat(turned[:, :1], n - 2, axis=1)
        fan = np.stack([first, turned[:, 1:-1], turned[:, 2:]], axis=2)
        a, b, c = (vertices[fan[:, :, corner]] for corner in range(3))
        worst = np.linalg.norm(np.cross(b - a, c - b), axis=2).min(axis=1)
        better = worst > best
        best[better], result[better] = worst[better], fan[better]
    return result.reshape(-1, 3)

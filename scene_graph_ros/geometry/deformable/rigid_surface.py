"""Rigid geometries as deformable ones meet them: a triangulated surface, or a half space.

Whether a rigid geometry is compliant has no part in this. Boxes, convex hulls and meshes have the
surface they have. A curved shape is triangulated with edges of about the ``resolution_hint`` of
its hydroelastic properties or, without one, ``DEFAULT_RESOLUTION`` of its largest extent. A flat
hull has two sides, and a point or a segment no surface, and so no contact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.bvh import build_bvh
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.hull import triangles_of_hull
from scene_graph_ros.geometry.meshes.sources import hull_of
from scene_graph_ros.geometry.meshes.tessellate import tessellate_surface
from scene_graph_ros.geometry.model.contact_properties import HYDROELASTIC_GROUP
from scene_graph_ros.geometry.model.properties import GeometryProperties
from scene_graph_ros.geometry.shapes.convex import Convex
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.shape import PrimitiveShape, Shape
from scene_graph_ros.geometry.tolerances import DEGENERATE_TRIANGLE

__all__ = ["DEFAULT_RESOLUTION", "RigidSurface", "build_rigid_surface", "rigid_surface"]

DEFAULT_RESOLUTION = 0.1
"""Wanted edge length of a curved rigid surface, relative to the shape's largest extent."""

_CURVED = (ShapeKind.SPHERE, ShapeKind.CAPSULE, ShapeKind.CYLINDER, ShapeKind.ELLIPSOID)
_CAPACITY = 1024
_surfaces: BuildCache[RigidSurface | None] = BuildCache(_CAPACITY)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class RigidSurface(NamedTuple):
    """Triangles in G with a bounding volume hierarchy; see ``meshes.bvh``."""

    vertices: FloatArray
    """(m, 3) metres."""
    triangles: IntArray
    """(k, 3) counter-clockwise seen from outside."""
    normals: FloatArray
    """(k, 3) unit vectors outwards."""
    boxes: FloatArray
    """(n, 6) centre and half extents of each node's box."""
    left: IntArray
    right: IntArray
    order: IntArray
    reach: float
    """Metres: the largest magnitude of a coordinate."""


def rigid_surface(shape: Shape, properties: GeometryProperties) -> RigidSurface | None:
    """Return the surface of a shape that is no half space; equal ones are built once.

    None stands for no surface at all. Raises MeshError if there would be too many triangles.
    """
    hint = None
    if isinstance(shape, PrimitiveShape) and shape.kind in _CURVED:
        lower, upper = shape.local_bounds()
        size = float((upper - lower).max())
        if size == 0.0:
            return None
        default = DEFAULT_RESOLUTION * size
        hint = properties.get_property_or_default(HYDROELASTIC_GROUP, "resolution_hint", default)
    return _surfaces.get((shape, hint), lambda: build_rigid_surface(*_triangulated(shape, hint)))


def _triangulated(shape: Shape, hint: float | None) -> tuple[FloatArray, IntArray]:
    if not isinstance(shape, Convex):
        return tessellate_surface(shape, hint)
    hull = hull_of(shape)
    return hull.vertices, triangles_of_hull(hull)


def build_rigid_surface(vertices: FloatArray, triangles: IntArray) -> RigidSurface | None:
    """Build the hierarchy over ``(m, 3)`` vertices and ``(k, 3)`` triangles.

    Triangles without area are left out: others cover them. Without any other there is no surface.
    """
    corners = vertices[triangles]
    edges = corners - np.roll(corners, 1, axis=1)
    crosses = np.cross(edges[:, 1], edges[:, 2])
    doubled_areas = np.linalg.norm(crosses, axis=1)
    longest = np.einsum("ijk,ijk->ij", edges, edges).max(axis=1)
    kept = np.flatnonzero(doubled_areas > DEGENERATE_TRIANGLE * longest)
    if not len(kept):
        return None
    corners = corners[kept]
    lower, upper, left, right, order = build_bvh(corners.min(axis=1), corners.max(axis=1))
    return RigidSurface(
        vertices=np.array(vertices, order="C"),
        triangles=np.array(triangles[kept], dtype=np.int64, order="C"),
        normals=crosses[kept] / doubled_areas[kept, None],
        boxes=np.concatenate([0.5 * lower + 0.5 * upper, 0.5 * upper - 0.5 * lower], axis=1),
        left=left,
        right=right,
        order=order,
        reach=float(np.abs(corners).max()),
    )

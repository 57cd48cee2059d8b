"""Registered geometry as a convex set, from its shape and its pose in a reference frame."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.geometry.meshes.sources import hull_of, is_convex
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.shapes.capsule import Capsule
from scene_graph_ros.geometry.shapes.convex import Convex
from scene_graph_ros.geometry.shapes.cylinder import Cylinder
from scene_graph_ros.geometry.shapes.ellipsoid import Ellipsoid
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.geometry.spatial.poses import compose, inverse
from scene_graph_ros.geometry.spatial.sums import moved, product

__all__ = [
    "capsule_of",
    "cylinder_of",
    "ellipsoid_of",
    "half_spaces_of",
    "is_query",
    "placed_shape",
    "vertices_of",
]


def is_query(value: Any) -> bool:
    """Tell whether an argument is a query object."""
    return isinstance(value, QueryObject)


def placed_shape(
    query: QueryObject, geometry_id: GeometryId, reference_frame: FrameId | None
) -> tuple[Shape, np.ndarray]:
    """Return a geometry's shape and its pose X_FG ``(4, 4)`` in a frame, the world by default."""
    X_WG = query.get_pose_in_world(geometry_id)
    if reference_frame is not None:
        X_WG = compose(inverse(query.get_pose_in_world(reference_frame)), X_WG)
    return query.inspector().get_shape(geometry_id), X_WG


def _box_corners(shape: Box) -> np.ndarray:
    signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij")).reshape(3, -1).T
    return signs * shape.size


def vertices_of(shape: Shape, X_FG: np.ndarray, kind: str) -> np.ndarray:
    """Return the corners ``(m, 3)`` of a box, a hull or a convex mesh. Raises ConvexSetError."""
    if isinstance(shape, Box):
        p_GVs = _box_corners(shape)
    elif isinstance(shape, Convex) or (isinstance(shape, Mesh) and is_convex(shape)):
        p_GVs = hull_of(shape).vertices
    else:
        raise _refused(shape, kind, "a Box, a Convex or a convex Mesh")
    return moved(p_GVs, X_FG)


def half_spaces_of(shape: Shape, X_FG: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return rows ``(m, 3)``, right sides of a box, hull, half space. Raises ConvexSetError."""
    if isinstance(shape, Box):
        normals, offsets = np.vstack([np.eye(3), -np.eye(3)]), 0.5 * np.tile(shape.size, 2)
    elif isinstance(shape, HalfSpace):
        normals, offsets = np.array([[0.0, 0.0, 1.0]]), np.zeros(1)
    elif isinstance(shape, Convex) or (isinstance(shape, Mesh) and is_convex(shape)):
        hull = hull_of(shape)
        if len(hull.faces) < 4:
            raise ConvexSetError(
                f"{kind}: the geometry's hull is flat; make a VPolytope of it first"
            )
        normals, offsets = hull.normals, hull.offsets
    else:
        raise _refused(shape, kind, "a Box, a HalfSpace, a Convex or a convex Mesh")
    A = product(normals, X_FG[:3, :3].T)
    return A, offsets + product(A, X_FG[:3, 3])


def ellipsoid_of(shape: Shape, X_FG: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return radii ``(3,)`` and the pose of a sphere or ellipsoid. Raises ConvexSetError."""
    if isinstance(shape, Sphere) and shape.radius > 0.0:
        return np.full(3, shape.radius), X_FG
    if isinstance(shape, Ellipsoid):
        return np.array([shape.a, shape.b, shape.c]), X_FG
    raise _refused(shape, kind, "an Ellipsoid, or a Sphere that is no point")


def capsule_of(shape: Shape, X_FG: np.ndarray, kind: str) -> tuple[float, np.ndarray]:
    """Return a capsule's radius and the ends ``(2, 3)`` of its segment. Raises ConvexSetError."""
    if not isinstance(shape, Capsule):
        raise _refused(shape, kind, "a Capsule")
    half = 0.5 * shape.length * X_FG[:3, 2]
    return shape.radius, np.array([X_FG[:3, 3] - half, X_FG[:3, 3] + half])


def cylinder_of(shape: Shape, kind: str) -> tuple[float, float]:
    """Return a cylinder's radius and half its length. Raises ConvexSetError."""
    if not isinstance(shape, Cylinder):
        raise _refused(shape, kind, "a Cylinder")
    return shape.radius, 0.5 * shape.length


def _refused(shape: Shape, kind: str, wanted: str) -> ConvexSetError:
    return ConvexSetError(
        f"{kind}: a geometry of this kind must be {wanted}, not a {shape.type_name}"
    )

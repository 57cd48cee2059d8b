"""A scene's proximity geometry as convex sets."""

from __future__ import annotations

from collections.abc import Container
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.iris.cloud_obstacles import sets_of_cloud
from scene_graph_ros.convex.iris.field_obstacles import sets_of_field
from scene_graph_ros.convex.iris.voxel_obstacles import sets_of_voxels
from scene_graph_ros.convex.sets.cartesian_product import CartesianProduct
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.from_shapes import placed_shape
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperellipsoid import Hyperellipsoid
from scene_graph_ros.convex.sets.minkowski_sum import MinkowskiSum
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.geometry.meshes.sources import hulls_of
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.shapes.capsule import Capsule
from scene_graph_ros.geometry.shapes.cylinder import Cylinder
from scene_graph_ros.geometry.shapes.ellipsoid import Ellipsoid
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.height_field import HeightField
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid

__all__ = ["SceneObstacle", "make_iris_obstacles", "obstacles_of", "scene_obstacles"]


@one_line()
class SceneObstacle(NamedTuple):
    """A geometry with the proximity role, and a convex set that holds it, or a piece of it."""

    geometry_id: GeometryId
    convex_set: ConvexSet


def make_iris_obstacles(
    query: QueryObject, reference_frame: FrameId | None = None
) -> list[ConvexSet]:
    """Return all geometry with the proximity role as sets, where it is in the query's snapshot.

    In a frame, the world by default. Meshes are taken by their hulls, those in pieces by
    those of the pieces; clouds by their balls, large ones by boxes around eight of them.
    Raises UnknownIdError for a frame that is not there, ConvexSetError for deformable geometry,
    which is not convex.
    """
    check_query(query, "make_iris_obstacles")
    inspector = query.inspector()
    found: list[ConvexSet] = []
    for geometry_id in inspector.get_all_geometry_ids(Role.PROXIMITY):
        if inspector.is_deformable(geometry_id):
            name = inspector.get_name(geometry_id)
            raise ConvexSetError(
                f"make_iris_obstacles: geometry {name!r} is deformable; it is no convex set"
            )
        shape, X_FG = placed_shape(query, geometry_id, reference_frame)
        found += _sets_of_shape(query, geometry_id, reference_frame, shape, X_FG)
    return found


def check_query(query: object, label: str) -> None:
    """Raise ConvexSetError unless it is a query object."""
    if not isinstance(query, QueryObject):
        raise ConvexSetError(f"{label}: query must be a QueryObject, not {quoted(query)}")


def scene_obstacles(
    query: QueryObject, ignored: Container[GeometryId] = frozenset()
) -> list[SceneObstacle]:
    """Return all geometry with the proximity role but ignored ones, in the world, by id."""
    check_query(query, "scene_obstacles")
    return [
        SceneObstacle(geometry_id, convex_set)
        for geometry_id in sorted(query.inspector().get_all_geometry_ids(Role.PROXIMITY))
        if geometry_id not in ignored
        for convex_set in obstacles_of(query, geometry_id)
    ]


def obstacles_of(query: QueryObject, geometry_id: GeometryId) -> list[ConvexSet]:
    """Return convex sets in the world that hold a geometry.

    It is the geometry itself, or the hull of a mesh, or of a deformable mesh's vertices; of
    a mesh in pieces those of the pieces; of a cloud its balls, or boxes around eight of them; of a
    height field its prisms, or boxes around blocks of these; of a voxel grid runs of its voxels,
    or boxes around blocks.
    """
    if query.inspector().is_deformable(geometry_id):
        return [VPolytope(query.get_configurations_in_world(geometry_id))]
    shape, X_WG = placed_shape(query, geometry_id, None)
    return _sets_of_shape(query, geometry_id, None, shape, X_WG)


def _sets_of_shape(
    query: Any, geometry_id: Any, frame: FrameId | None, shape: Shape, X_FG: np.ndarray
) -> list[ConvexSet]:
    if isinstance(shape, PointCloud):
        return sets_of_cloud(query.snapshot.point_set(geometry_id), X_FG)
    if isinstance(shape, HeightField):
        return sets_of_field(query.snapshot.height_set(geometry_id), X_FG)
    if isinstance(shape, VoxelGrid):
        return sets_of_voxels(query.snapshot.voxel_set(geometry_id), X_FG)
    if not isinstance(shape, MeshShape):
        return [_set_of_shape(query, geometry_id, frame, shape, X_FG)]
    R_FG, p_FG = X_FG[:3, :3], X_FG[:3, 3]
    return [VPolytope(hull.vertices @ R_FG.T + p_FG) for hull in hulls_of(shape)]


def _set_of_shape(
    query: Any, geometry_id: Any, frame: FrameId | None, shape: Shape, X_FG: np.ndarray
) -> ConvexSet:
    """Return the description that is asked fastest."""
    if isinstance(shape, Sphere) and shape.radius == 0.0:
        return Point(X_FG[:3, 3])
    if isinstance(shape, Sphere | Ellipsoid):
        return Hyperellipsoid(query, geometry_id, frame)
    if isinstance(shape, Capsule):
        return MinkowskiSum(query, geometry_id, frame)
    if isinstance(shape, Cylinder):
        return CartesianProduct(query, geometry_id, frame)
    if isinstance(shape, HalfSpace):
        return HPolyhedron(query, geometry_id, frame)
    assert isinstance(shape, Box)  # the last shape of a form of its own
    return VPolytope(query, geometry_id, frame)

"""Gather the bodies that a renderer draws: fixed data once per model, poses per snapshot."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple
import weakref

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.meshes.sources import hull_of, load_surface, source_identity
from scene_graph_ros.geometry.meshes.triangle_colors import triangle_colors, TriangleColors
from scene_graph_ros.geometry.model.derived import derived
from scene_graph_ros.geometry.model.driven_mesh import driven_mesh
from scene_graph_ros.geometry.model.height_set import HeightSet
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.perception_properties import (
    Appearance,
    read_perception_properties,
)
from scene_graph_ros.geometry.model.point_set import PointSet
from scene_graph_ros.geometry.model.records import GeometryRecord
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.model.voxel_set import VoxelSet
from scene_graph_ros.geometry.perception.exact.bodies import Bodies, MAX_TRIANGLES
from scene_graph_ros.geometry.perception.exact.cover import Cover
from scene_graph_ros.geometry.perception.exact.cover_table import cover_of
from scene_graph_ros.geometry.shapes.element_shape import ElementShape
from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.field_surface import (
    drawn_places,
    field_triangles,
    field_vertices,
)
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.geometry.shapes.shape import PrimitiveShape
from scene_graph_ros.geometry.shapes.voxel_surface import voxel_triangles
from scene_graph_ros.geometry.spatial.sums import length

__all__ = ["BodyTable", "body_table", "place_bodies"]

FloatArray = NDArray[np.float64]


class VisibleMesh(NamedTuple):
    """Triangles to draw, and a ball around them."""

    vertices: FloatArray
    triangles: NDArray[np.int32]
    center: FloatArray
    radius: float


class BodyTable(NamedTuple):
    """The bodies of a model that a renderer draws, without poses; deformable ones have no data."""

    bodies: Bodies
    cover: Cover
    rigid: NDArray[np.int64]
    """(r,) rows of rigid bodies."""
    posed: NDArray[np.int64]
    """(r,) rows of the same among all rigid geometries with the perception role."""
    deformable: dict[int, GeometryId]
    """The bodies whose triangles change, by row: deformable ones, height fields, voxel grids."""
    clouds: dict[int, GeometryId]
    """Clouds by row."""


_meshes: BuildCache[VisibleMesh] = BuildCache(4096)


@derived(Role.PERCEPTION)
def body_table(state: GeometryState, renderer: str, diffuse: tuple[float, ...]) -> BodyTable:
    """Return the bodies that ``renderer`` draws; ``diffuse`` is the colour of those without one.

    Raises MeshError for a mesh of too many triangles.
    """
    records: list[GeometryRecord] = []
    looks: list[Appearance] = []
    for geometry_id in sorted(state.with_role[Role.PERCEPTION]):
        record = state.geometries[geometry_id]
        look = read_perception_properties(record.properties[Role.PERCEPTION], record.name)
        if not look.accepting or renderer in look.accepting:
            records.append(record)
            looks.append(look)
    n = len(records)
    clouds = {k: r.id for k, r in enumerate(records) if isinstance(r.shape, PointCloud)}
    has_elements = [isinstance(record.shape, ElementShape) for record in records]
    is_rigid = np.array([record.deformable is None for record in records], dtype=np.bool_)
    is_rigid[np.array(has_elements, dtype=np.bool_)] = False
    kind = np.array([record.shape.kind for record in records], dtype=np.int32)
    kind[~is_rigid] = ShapeKind.MESH
    kind[list(clouds)] = ShapeKind.SPHERE
    size, center, radius = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n)
    mesh = np.full(n, -1, dtype=np.int32)
    meshes: list[VisibleMesh] = []
    known: dict[Any, int] = {}
    is_painted = np.zeros(n, dtype=np.bool_)
    colors_of: dict[int, TriangleColors | None] = {}
    for row in np.flatnonzero(is_rigid):
        shape = records[row].shape
        if isinstance(shape, PrimitiveShape):
            size[row], radius[row] = _size_and_reach(shape)
            continue
        assert isinstance(shape, MeshShape)  # the shapes without sizes
        identity = source_identity(shape)
        if identity not in known:
            known[identity] = len(meshes)
            meshes.append(_visible_mesh(shape, records[row].name))
        mesh[row] = known[identity]
        if looks[row].is_of_file and known[identity] not in colors_of:
            colors_of[known[identity]] = triangle_colors(shape)
        is_painted[row] = looks[row].is_of_file and colors_of[known[identity]] is not None
        center[row], radius[row] = meshes[mesh[row]].center, meshes[mesh[row]].radius
    moving = np.flatnonzero(~is_rigid).tolist()
    deformable = {row: records[row].id for row in moving if row not in clouds}
    rigid_ids = np.array([int(i) for i in state.rigid_ids(Role.PERCEPTION)], dtype=np.int64)
    chosen = np.array([int(record.id) for record in records], dtype=np.int64)
    rigid = np.flatnonzero(is_rigid)
    colors = [_own_color(looks[row], bool(is_painted[row]), diffuse) for row in range(n)]
    own = np.array(colors, dtype=np.float64).reshape(n, 4)
    bodies = Bodies(
        kind=kind,
        size=size,
        X_WG=np.zeros((n, 4, 4)),
        center=center,
        radius=radius,
        mesh=mesh,
        **_packed(meshes),
        label=np.array([int(a.label) for a in looks], dtype=np.int16),
        diffuse=np.ascontiguousarray(own[:, :3]),
        is_painted=is_painted,
        **_painted(meshes, colors_of),
    )
    posed = np.searchsorted(rigid_ids, chosen[rigid])
    cover = cover_of(records, looks, own[:, 3].copy())
    return BodyTable(bodies, cover, rigid, posed, deformable, clouds)


def _own_color(look: Appearance, is_painted: bool, default: tuple[float, ...]) -> Any:
    """Return red, green, blue and alpha; a mesh with the colours of its file is opaque."""
    if look.diffuse is not None:
        return look.diffuse.as_array()
    if look.picture is not None:
        return (1.0, 1.0, 1.0, 1.0)
    return (*default[:3], 1.0) if is_painted else default


Numbers = tuple[tuple[float, ...], float]


def _of_tube(shape: Any, reach: float) -> Numbers:
    return (shape.radius, 0.5 * shape.length, 0.0), reach


def _of_box(shape: Any) -> Numbers:
    halves = 0.5 * shape.size
    return tuple(halves.tolist()), length(halves)


_NUMBERS: dict[ShapeKind, Callable[[Any], Numbers] | None] = every_kind(
    "numbers of visible bodies",
    {
        ShapeKind.SPHERE: lambda s: ((s.radius, 0.0, 0.0), s.radius),
        ShapeKind.CAPSULE: lambda s: _of_tube(s, s.radius + 0.5 * s.length),
        ShapeKind.BOX: _of_box,
        ShapeKind.CYLINDER: lambda s: _of_tube(s, float(np.hypot(s.radius, 0.5 * s.length))),
        ShapeKind.ELLIPSOID: lambda s: ((s.a, s.b, s.c), max(s.a, s.b, s.c)),
        ShapeKind.HALF_SPACE: lambda s: ((0.0, 0.0, 0.0), np.inf),
        # These have triangles.
        ShapeKind.CONVEX: None,
        ShapeKind.MESH: None,
    },
)


def _size_and_reach(shape: Any) -> Numbers:
    """Return a shape's numbers as kernels read them, and how far it reaches from its origin."""
    numbers = _NUMBERS[shape.kind]
    assert numbers is not None, shape
    return numbers(shape)


def _visible_mesh(shape: MeshShape, name: str) -> VisibleMesh:
    def build() -> VisibleMesh:
        if shape.kind == ShapeKind.CONVEX:
            hull = hull_of(shape)
            fans = [
                (face[0], face[k], face[k + 1])
                for face in hull.faces
                for k in range(1, len(face) - 1)
            ]
            return _with_ball(hull.vertices, np.array(fans, dtype=np.int32).reshape(-1, 3), name)
        return _with_ball(*load_surface(shape), name)

    return _meshes.get(source_identity(shape), build)


_fields: weakref.WeakKeyDictionary[HeightSet | VoxelSet, VisibleMesh] = weakref.WeakKeyDictionary()


def _visible_field(now: HeightSet | VoxelSet, name: str) -> VisibleMesh:
    """Return the triangles around a height field or voxels in G, made once for each set."""
    known = _fields.get(now)
    if known is None:
        if isinstance(now, VoxelSet):
            vertices, triangles = voxel_triangles(now.solid, now.shape.voxel)
        else:
            places = drawn_places(now.shape)
            vertices = field_vertices(now.shape, now.heights, places)
            triangles = field_triangles(places)
        known = _fields[now] = _with_ball(vertices, triangles, name)
    return known


def _with_ball(vertices: FloatArray, triangles: NDArray[Any], name: str) -> VisibleMesh:
    if len(triangles) > MAX_TRIANGLES:
        raise MeshError(
            f"geometry {name!r}: {len(triangles)} triangles are more than cameras can see of one"
            f" body, {MAX_TRIANGLES}"
        )
    used, corners = np.unique(triangles, return_inverse=True)
    points = np.ascontiguousarray(vertices[used], dtype=np.float64).reshape(-1, 3)
    center = np.zeros(3)
    radius = 0.0
    if len(points):
        center = 0.5 * (points.min(axis=0) + points.max(axis=0))
        radius = float(np.sqrt(np.square(points - center).sum(axis=1).max()))
    return VisibleMesh(points, corners.reshape(-1, 3).astype(np.int32), center, radius)


def _packed(meshes: list[VisibleMesh]) -> dict[str, Any]:
    def starts(lengths: list[int]) -> NDArray[np.int64]:
        return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)

    return {
        "vertex_start": starts([len(mesh.vertices) for mesh in meshes]),
        "vertices": np.concatenate([np.zeros((0, 3)), *[mesh.vertices for mesh in meshes]]),
        "triangle_start": starts([len(mesh.triangles) for mesh in meshes]),
        "triangles": np.concatenate(
            [np.zeros((0, 3), np.int32), *[mesh.triangles for mesh in meshes]]
        ),
    }


def _painted(
    meshes: list[VisibleMesh], colors_of: dict[int, TriangleColors | None]
) -> dict[str, Any]:
    """Return the colour of each triangle of all meshes, and these colours."""
    paint, palettes, first = [np.zeros(0, np.int32)], [np.zeros((0, 3))], 0
    for k, mesh in enumerate(meshes):
        colors = colors_of.get(k)
        if colors is None:
            paint.append(np.full(len(mesh.triangles), -1, np.int32))
            continue
        paint.append(np.where(colors.row >= 0, colors.row + first, -1).astype(np.int32))
        palettes.append(colors.palette)
        first += len(colors.palette)
    return {"paint": np.concatenate(paint), "palette": np.concatenate(palettes)}


def place_bodies(snapshot: Snapshot, table: BodyTable) -> tuple[Bodies, Cover]:
    """Return the bodies of a table where they are in a snapshot, and their covers.

    A cloud is as many bodies as it has balls, or none.
    """
    bodies = _placed(snapshot, table)
    if not table.clouds:
        return bodies, table.cover
    from scene_graph_ros.geometry.perception.exact.ball_bodies import with_balls

    points = {row: snapshot.point_set(each) for row, each in table.clouds.items()}
    poses = {row: snapshot.pose_in_world(each) for row, each in table.clouds.items()}
    return with_balls(bodies, table.cover, points, poses)


def _placed(snapshot: Snapshot, table: BodyTable) -> Bodies:
    bodies = table.bodies
    X_WG = snapshot.X_WG_of(Role.PERCEPTION)
    if table.deformable or table.clouds:
        return _with_deformable(snapshot, table, X_WG)
    if len(table.posed) < len(X_WG):
        X_WG = X_WG[table.posed]
    return bodies._replace(X_WG=X_WG)


def _with_deformable(snapshot: Snapshot, table: BodyTable, X_WG: FloatArray) -> Bodies:
    """Add the deformable bodies as meshes of the moment, each about its own centre.

    Far from the world's origin, their vertices keep the digits that they have.
    """
    bodies, meshes = table.bodies, []
    poses = np.tile(np.eye(4), (len(bodies.kind), 1, 1))
    poses[table.rigid] = X_WG[table.posed]
    mesh, radius = bodies.mesh.copy(), bodies.radius.copy()
    first = len(bodies.vertex_start) - 1
    for k, (row, geometry_id) in enumerate(table.deformable.items()):
        record = snapshot.state.geometries[geometry_id]
        if isinstance(record.shape, ElementShape):
            now = snapshot.element_set(geometry_id)
            assert not isinstance(now, PointSet)  # whose balls are bodies of their own
            seen = _visible_field(now, record.name)
            meshes.append(seen)
            mesh[row], radius[row] = first + k, length(seen.center) + seen.radius
            poses[row] = snapshot.pose_in_world(geometry_id)
            continue
        assert record.deformable is not None  # it was when the table was made of the same model
        driven = driven_mesh(record.deformable, record.properties[Role.PERCEPTION])
        (points,) = snapshot.driven_mesh_configurations(geometry_id, Role.PERCEPTION)
        origin = 0.5 * (points.min(axis=0) + points.max(axis=0))
        triangles = driven.surface.triangles
        seen = _with_ball(points - origin, triangles, record.name)
        meshes.append(seen)
        mesh[row], radius[row] = first + k, length(seen.center) + seen.radius
        poses[row, :3, 3] = origin
    added = _packed(meshes)
    return bodies._replace(
        X_WG=poses,
        mesh=mesh,
        radius=radius,
        vertex_start=np.concatenate(
            [bodies.vertex_start, bodies.vertex_start[-1] + added["vertex_start"][1:]]
        ),
        vertices=np.concatenate([bodies.vertices, added["vertices"]]),
        triangle_start=np.concatenate(
            [bodies.triangle_start, bodies.triangle_start[-1] + added["triangle_start"][1:]]
        ),
        triangles=np.concatenate([bodies.triangles, added["triangles"]]),
        paint=np.concatenate([bodies.paint, np.full(len(added["triangles"]), -1, np.int32)]),
    )

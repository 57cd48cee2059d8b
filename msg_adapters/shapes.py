"""Shapes: ``scene_graph_msgs/Shape`` and ``shape_msgs`` to and from the core's shapes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import enum
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

from geometry_msgs.msg import Point
import numpy as np
from numpy.typing import NDArray
from shape_msgs.msg import Mesh as MeshMsg
from shape_msgs.msg import MeshTriangle, Plane, SolidPrimitive

from msg_adapters.arrays import float64s_to_msg, rows_from_msg, uint8s_to_msg, uint32s_to_msg
from msg_adapters.errors import MessageError
from scene_graph_msgs.msg import Shape as ShapeMsg
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.shapes.capsule import Capsule
from scene_graph_ros.geometry.shapes.convex import Convex
from scene_graph_ros.geometry.shapes.cylinder import Cylinder
from scene_graph_ros.geometry.shapes.ellipsoid import Ellipsoid
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.height_field import HeightField
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid
from scene_graph_ros.geometry.shapes.voxel_runs import from_runs, to_runs

__all__ = [
    "Resolver",
    "mesh_from_msg",
    "mesh_to_msg",
    "plane_from_msg",
    "plane_to_msg",
    "resolve_file",
    "shape_from_msg",
    "shape_kind_to_msg",
    "shape_to_msg",
    "solid_primitive_from_msg",
    "solid_primitive_to_msg",
]

Resolver = Callable[[str], Path]
"""Finds the file of a resource such as ``package://robot/link.stl``, or raises."""

# Which attributes of a shape are its `dimensions`, in their order.
_PRIMITIVES: dict[int, tuple[type[Shape], tuple[str, ...]]] = {
    ShapeMsg.SPHERE: (Sphere, ("radius",)),
    ShapeMsg.CAPSULE: (Capsule, ("radius", "length")),
    ShapeMsg.BOX: (Box, ("width", "depth", "height")),
    ShapeMsg.CYLINDER: (Cylinder, ("radius", "length")),
    ShapeMsg.ELLIPSOID: (Ellipsoid, ("a", "b", "c")),
    ShapeMsg.HALF_SPACE: (HalfSpace, ()),
}
_MESHES: dict[int, type[MeshShape]] = {ShapeMsg.CONVEX: Convex, ShapeMsg.MESH: Mesh}
# By which constant of the message; those stay, whatever the order of ShapeKind becomes.
_KINDS: dict[enum.IntEnum, int] = {
    **{cls.kind: kind for kind, (cls, _) in _PRIMITIVES.items()},
    **{cls.kind: kind for kind, cls in _MESHES.items()},
    PointCloud.kind: ShapeMsg.POINT_CLOUD,
    HeightField.kind: ShapeMsg.HEIGHT_FIELD,
    VoxelGrid.kind: ShapeMsg.VOXEL_GRID,
}

_BEFORE_HEIGHTS = 4
"""Dimensions of a height field before its heights."""
_BEFORE_RUNS = 5
"""Dimensions of a voxel grid before its runs."""


def resolve_file(resource: str) -> Path:
    """Return the path of ``file:///...`` or an absolute path.

    Raises MessageError for another scheme, e.g. ``package://``, which takes a resolver that knows
    the installed packages.
    """
    if resource.startswith("file://"):
        return Path(unquote(urlparse(resource).path))
    if resource.startswith("/"):
        return Path(resource)
    raise MessageError(f"resource {quoted(resource)} is neither file:// nor an absolute path")


def shape_from_msg(msg: ShapeMsg, resolve: Resolver = resolve_file) -> Shape:
    """Return the shape that ``msg`` describes.

    Raises MessageError for a message that contradicts itself, InvalidShapeError for sizes that
    are no sizes or a file that can't be read.
    """
    if msg.kind in _PRIMITIVES:
        cls, fields = _PRIMITIVES[msg.kind]
        if len(msg.dimensions) != len(fields):
            wanted = ", ".join(fields) or "none"
            raise MessageError(
                f"{cls.__name__} takes the dimensions {wanted}, not {list(msg.dimensions)}"
            )
        return cls(*(float(size) for size in msg.dimensions))
    if msg.kind in _MESHES:
        return _mesh_shape_from_msg(_MESHES[msg.kind], msg, resolve)
    if msg.kind == ShapeMsg.POINT_CLOUD:
        return _point_cloud_from_msg(msg)
    if msg.kind == ShapeMsg.HEIGHT_FIELD:
        return _height_field_from_msg(msg)
    if msg.kind == ShapeMsg.VOXEL_GRID:
        return _voxel_grid_from_msg(msg)
    known = max(_KINDS.values())
    raise MessageError(f"shape kind {msg.kind} is unknown; known are 0 to {known}")


def _point_cloud_from_msg(msg: ShapeMsg) -> PointCloud:
    points = rows_from_msg(msg.vertices, 3, "PointCloud vertices")
    if not len(msg.dimensions):
        raise MessageError("PointCloud takes the dimensions radius, or one radius for each vertex")
    radii = np.array(msg.dimensions, dtype=np.float64)
    return PointCloud(points, float(radii[0]) if len(radii) == 1 else radii)


def _height_field_from_msg(msg: ShapeMsg) -> HeightField:
    numbers = np.array(msg.dimensions, dtype=np.float64)
    if len(numbers) < _BEFORE_HEIGHTS:
        raise MessageError(
            "HeightField takes the dimensions size along x, size along y, floor, columns, and all"
            f" heights row by row, not {len(numbers)} numbers"
        )
    width, depth, floor, columns = numbers[:_BEFORE_HEIGHTS].tolist()
    heights = numbers[_BEFORE_HEIGHTS:]
    if not 2.0 <= columns <= max(len(heights), 2) or columns != int(columns):
        raise MessageError(
            f"HeightField: columns must be a whole number from 2 to the {len(heights)} heights,"
            f" not {columns:g}"
        )
    if len(heights) % int(columns):
        raise MessageError(
            f"HeightField: {len(heights)} heights are no rows of {int(columns)} columns"
        )
    return HeightField(heights.reshape(-1, int(columns)), (width, depth), floor)


def _voxel_grid_from_msg(msg: ShapeMsg) -> VoxelGrid:
    numbers = np.array(msg.dimensions, dtype=np.float64)
    if len(numbers) < _BEFORE_RUNS or (len(numbers) - _BEFORE_RUNS) % 2:
        raise MessageError(
            "VoxelGrid takes the dimensions voxel, whether unknown counts as free, counts along"
            f" x, y and z, and pairs of a state and how many have it, not {len(numbers)} numbers"
        )
    voxel, free = numbers[:2].tolist()
    if free not in (0.0, 1.0):
        raise MessageError(f"VoxelGrid: whether unknown counts as free must be 0 or 1, not {free}")
    occupancy = from_runs(numbers[2:_BEFORE_RUNS], numbers[_BEFORE_RUNS:])
    return VoxelGrid(occupancy, voxel, unknown_is_free=free == 1.0)


def _mesh_shape_from_msg(cls: type[MeshShape], msg: ShapeMsg, resolve: Resolver) -> Shape:
    name = cls.__name__
    given = {
        "resource": bool(msg.resource),
        "contents": len(msg.contents) > 0,
        "vertices": len(msg.vertices) > 0,
    }
    if sum(given.values()) != 1:
        named = [field for field, is_given in given.items() if is_given]
        raise MessageError(f"{name} takes one of {list(given)}, not {named or 'none'}")
    scale = tuple(float(factor) for factor in msg.scale)
    if given["resource"]:
        return cls(resolve(msg.resource), scale)
    if given["contents"]:
        contents = bytes(np.asarray(msg.contents, dtype=np.uint8))
        return cls(contents=contents, file_type=msg.file_type, scale=scale)
    vertices = rows_from_msg(msg.vertices, 3, f"{name} vertices")
    faces = _faces(msg.triangles, name)
    if faces is None and cls is Mesh:
        raise MessageError("Mesh takes triangles with its vertices")
    return cls(vertices=vertices, faces=faces, scale=scale)


def _faces(triangles: Sequence[int], name: str) -> NDArray[np.int64] | None:
    if len(triangles) % 3:
        raise MessageError(f"{name} triangles: {len(triangles)} is no multiple of 3")
    return np.array(triangles, dtype=np.int64).reshape(-1, 3) if len(triangles) else None


def shape_kind_to_msg(shape: Shape) -> int:
    """Return the constant of ``scene_graph_msgs/Shape`` for a shape's kind."""
    return _KINDS[shape.kind]


def shape_to_msg(shape: Shape) -> ShapeMsg:
    """Return the message of a shape; files are named as ``file://`` resources."""
    kind = shape_kind_to_msg(shape)
    if kind in _PRIMITIVES:
        _, fields = _PRIMITIVES[kind]
        return ShapeMsg(kind=kind, dimensions=[float(getattr(shape, f)) for f in fields])
    if isinstance(shape, PointCloud):
        msg = ShapeMsg(kind=kind, vertices=float64s_to_msg(shape.points))
        msg.dimensions = np.atleast_1d(shape.radius).tolist()
        return msg
    if isinstance(shape, HeightField):
        before = [*shape.size, shape.floor, float(shape.heights.shape[1])]
        numbers = np.concatenate([before, shape.heights.reshape(-1)])
        return ShapeMsg(kind=kind, dimensions=float64s_to_msg(numbers))
    if isinstance(shape, VoxelGrid):
        start = [shape.voxel, float(shape.unknown_is_free), *map(float, shape.occupancy.shape)]
        runs = to_runs(shape.occupancy).reshape(-1).astype(np.float64)
        return ShapeMsg(kind=kind, dimensions=float64s_to_msg(np.concatenate([start, runs])))
    assert isinstance(shape, MeshShape)
    msg = ShapeMsg(kind=kind, scale=np.array(shape.scale, dtype=np.float64))
    if shape.path is not None:
        msg.resource = Path(shape.path).as_uri()
    elif shape.contents is not None:
        msg.contents = uint8s_to_msg(np.frombuffer(shape.contents, dtype=np.uint8))
        msg.file_type = shape.file_type
    elif shape.vertices is not None:
        msg.vertices = float64s_to_msg(shape.vertices)
        if shape.faces is not None:
            msg.triangles = uint32s_to_msg(shape.faces)
    return msg


# shape_msgs lists a cylinder's height before its radius.
_SOLIDS: dict[int, tuple[type[Shape], tuple[str, ...]]] = {
    SolidPrimitive.BOX: (Box, ("width", "depth", "height")),
    SolidPrimitive.SPHERE: (Sphere, ("radius",)),
    SolidPrimitive.CYLINDER: (Cylinder, ("length", "radius")),
}


def solid_primitive_from_msg(msg: SolidPrimitive) -> Shape:
    """Return the box, sphere or cylinder of ``msg``; raises MessageError for other kinds."""
    if msg.type not in _SOLIDS:
        raise MessageError(f"SolidPrimitive type {msg.type} is no box, sphere or cylinder")
    cls, fields = _SOLIDS[msg.type]
    if len(msg.dimensions) != len(fields):
        raise MessageError(
            f"{cls.__name__} takes the dimensions {', '.join(fields)}, not {list(msg.dimensions)}"
        )
    return cls(**{f: float(size) for f, size in zip(fields, msg.dimensions, strict=True)})


def solid_primitive_to_msg(shape: Shape) -> SolidPrimitive:
    """Return the message of a box, sphere or cylinder; raises MessageError for other shapes."""
    for kind, (cls, fields) in _SOLIDS.items():
        if type(shape) is cls:
            sizes = [float(getattr(shape, field)) for field in fields]
            return SolidPrimitive(type=kind, dimensions=sizes)
    raise MessageError(f"{shape!r} is no box, sphere or cylinder")


def mesh_from_msg(msg: MeshMsg, scale: Any = 1.0) -> Mesh:
    """Return the triangle mesh of a ``shape_msgs/Mesh``."""
    vertices = [(v.x, v.y, v.z) for v in msg.vertices]
    faces = np.array([t.vertex_indices for t in msg.triangles], dtype=np.int64).reshape(-1, 3)
    return Mesh(vertices=np.array(vertices).reshape(-1, 3), faces=faces, scale=scale)


def mesh_to_msg(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> MeshMsg:
    """Return the message of ``(n, 3)`` vertices in m and ``(t, 3)`` indices."""
    return MeshMsg(
        vertices=[Point(x=x, y=y, z=z) for x, y, z in np.asarray(vertices, dtype=float).tolist()],
        triangles=[
            MeshTriangle(vertex_indices=row) for row in np.asarray(triangles, dtype=np.uint32)
        ],
    )


def plane_from_msg(msg: Plane) -> tuple[HalfSpace, NDArray[np.float64]]:
    """Return the half space below ``a x + b y + c z + d = 0`` and its pose ``X_FH`` ``(4, 4)``.

    The outward normal is (a, b, c), which need not be of unit length. Raises MessageError for
    coefficients that are not finite, InvalidShapeError for a zero normal.
    """
    a, b, c, d = (float(value) for value in msg.coef)
    normal = np.array((a, b, c))
    if not np.isfinite((a, b, c, d)).all():
        raise MessageError(f"Plane coefficients are not finite: {[a, b, c, d]}")
    squared = float(normal @ normal)
    foot = -d / squared * normal if squared > 0.0 else normal
    return HalfSpace(), HalfSpace.make_pose(normal, foot)


def plane_to_msg(X_FH: NDArray[np.float64]) -> Plane:
    """Return the plane of a half space at ``X_FH``, with a unit normal."""
    normal = X_FH[:3, 2]
    return Plane(coef=np.append(normal, -(normal @ X_FH[:3, 3])).astype(np.float64))

"""Shapes in both directions, and what is refused."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from geometry_msgs.msg import Point
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from shape_msgs.msg import Mesh as MeshMsg
from shape_msgs.msg import MeshTriangle, Plane, SolidPrimitive

from msg_adapters import shapes
from msg_adapters.errors import MessageError
from scene_graph_msgs.msg import Shape as ShapeMsg
from scene_graph_ros.geometry.errors import InvalidShapeError
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.shapes.capsule import Capsule
from scene_graph_ros.geometry.shapes.convex import Convex
from scene_graph_ros.geometry.shapes.cylinder import Cylinder
from scene_graph_ros.geometry.shapes.ellipsoid import Ellipsoid
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.height_field import HeightField
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid

VERTICES = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)])
FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])
OBJ = b"v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n"


@pytest.fixture
def obj_file(tmp_path: Path) -> Path:
    """Write a mesh file whose path needs quoting in a URI."""
    path = tmp_path / "a triangle.obj"
    path.write_bytes(OBJ)
    return path


PRIMITIVES = [
    (Sphere(0.1), ShapeMsg.SPHERE, [0.1]),
    (Capsule(0.1, 0.2), ShapeMsg.CAPSULE, [0.1, 0.2]),
    (Box(0.1, 0.2, 0.3), ShapeMsg.BOX, [0.1, 0.2, 0.3]),
    (Cylinder(0.1, 0.2), ShapeMsg.CYLINDER, [0.1, 0.2]),
    (Ellipsoid(0.1, 0.2, 0.3), ShapeMsg.ELLIPSOID, [0.1, 0.2, 0.3]),
    (HalfSpace(), ShapeMsg.HALF_SPACE, []),
]


@pytest.mark.parametrize(("shape", "kind", "dimensions"), PRIMITIVES)
def test_a_primitive_has_its_documented_dimensions(
    shape: Shape, kind: int, dimensions: list[float], over_the_wire: Callable[[Any], Any]
) -> None:
    """Kind and dimensions are as the message documents them, and make the same shape again."""
    msg = over_the_wire(shapes.shape_to_msg(shape))
    assert (msg.kind, list(msg.dimensions)) == (kind, dimensions)
    assert shapes.shape_from_msg(msg) == shape


KINDS = {
    "SPHERE": 0,
    "CAPSULE": 1,
    "BOX": 2,
    "CYLINDER": 3,
    "ELLIPSOID": 4,
    "HALF_SPACE": 5,
    "CONVEX": 6,
    "MESH": 7,
}
"""The first eight, which stay: recordings and other versions have them."""


def test_the_kinds_of_messages_are_those_of_the_core() -> None:
    """All have the names of the core's enumeration, and keep the numbers that they had."""
    assert {name: getattr(ShapeMsg, name) for name in KINDS} == KINDS
    constants = [getattr(ShapeMsg, name) for name in ShapeKind.__members__]
    assert sorted(constants) == list(range(len(ShapeKind)))
    examples = [shape for shape, _, _ in PRIMITIVES]
    examples += [Convex(vertices=VERTICES), Mesh(vertices=VERTICES, faces=FACES)]
    assert {shape.kind for shape in examples} == set(ShapeKind)
    for shape in examples:
        assert shapes.shape_kind_to_msg(shape) == getattr(ShapeMsg, shape.kind.name)


@pytest.mark.parametrize(
    "shape",
    [
        Mesh(vertices=VERTICES, faces=FACES, scale=(1.0, -2.0, 3.0)),
        Convex(vertices=VERTICES, scale=0.5),
        Convex(vertices=VERTICES, faces=FACES),
        Mesh(contents=OBJ, file_type="obj", scale=2.0),
    ],
)
def test_a_mesh_in_memory_survives_the_wire(
    shape: Shape, over_the_wire: Callable[[Any], Any]
) -> None:
    """Vertices, faces, file content and scale come back unchanged."""
    assert shapes.shape_from_msg(over_the_wire(shapes.shape_to_msg(shape))) == shape


def test_a_height_field_survives_the_wire(over_the_wire: Callable[[Any], Any]) -> None:
    """Its sizes, floor, columns and heights are dimensions; others than that are refused."""
    field = HeightField([[1 / 3, 0.0, 2.0], [4.0, 5.0, -0.5]], (3.0, 0.7), -1.0)
    msg = shapes.shape_to_msg(field)
    assert msg.kind == ShapeMsg.HEIGHT_FIELD
    assert list(msg.dimensions[:4]) == [3.0, 0.7, -1.0, 3.0]
    assert shapes.shape_from_msg(over_the_wire(msg)) == field
    known = list(msg.dimensions)
    for dimensions, told in (
        (known[:3], "takes the dimensions size along x"),
        ([*known[:3], 2.5, *known[4:]], "columns must be a whole number"),
        ([*known[:3], 1e300, *known[4:]], "columns must be a whole number"),
        ([*known[:3], float("nan"), *known[4:]], "columns must be a whole number"),
        (known[:-1], "5 heights are no rows of 3 columns"),
        (known[:4], "columns must be a whole number"),
    ):
        with pytest.raises(MessageError, match=told):
            shapes.shape_from_msg(ShapeMsg(kind=ShapeMsg.HEIGHT_FIELD, dimensions=dimensions))
    msg.dimensions[2] = 0.0
    with pytest.raises(InvalidShapeError, match="above the floor"):
        shapes.shape_from_msg(msg)


def test_a_voxel_grid_survives_the_wire(over_the_wire: Callable[[Any], Any]) -> None:
    """Its edge, what unknown counts as, counts and runs are dimensions; others are refused."""
    grid = VoxelGrid([[[0, 1, 1], [2, 2, 0]]], 1 / 3, unknown_is_free=True)
    msg = shapes.shape_to_msg(grid)
    assert msg.kind == ShapeMsg.VOXEL_GRID
    known = list(msg.dimensions)
    assert known == [1 / 3, 1.0, 1.0, 2.0, 3.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0, 0.0, 1.0]
    assert shapes.shape_from_msg(over_the_wire(msg)) == grid
    for dimensions, told in (
        (known[:4], "takes the dimensions voxel"),
        (known[:-1], "pairs of a state and how many have it, not 12 numbers"),
        ([known[0], 0.5, *known[2:]], "must be 0 or 1, not 0.5"),
    ):
        with pytest.raises(MessageError, match=told):
            shapes.shape_from_msg(ShapeMsg(kind=ShapeMsg.VOXEL_GRID, dimensions=dimensions))
    with pytest.raises(InvalidShapeError, match="runs have 5 voxels, not the 6"):
        shapes.shape_from_msg(ShapeMsg(kind=ShapeMsg.VOXEL_GRID, dimensions=known[:-2]))


@pytest.mark.parametrize("radius", [0.25, 0.0, [0.5, 0.125]])
def test_a_cloud_survives_the_wire(radius: Any, over_the_wire: Callable[[Any], Any]) -> None:
    """Its points are vertices, its radii dimensions; without points one radius is left."""
    cloud = PointCloud([[1 / 3, -2.0, 3.0], [4.0, 5.0, 6.0]], radius)
    assert shapes.shape_from_msg(over_the_wire(shapes.shape_to_msg(cloud))) == cloud
    empty = PointCloud([], 0.5)
    assert shapes.shape_from_msg(over_the_wire(shapes.shape_to_msg(empty))) == empty
    with pytest.raises(MessageError, match="takes the dimensions radius"):
        shapes.shape_from_msg(ShapeMsg(kind=ShapeMsg.POINT_CLOUD, vertices=[0.0, 0.0, 0.0]))
    with pytest.raises(MessageError, match="PointCloud vertices"):
        shapes.shape_from_msg(
            ShapeMsg(kind=ShapeMsg.POINT_CLOUD, vertices=[0.0, 0.0], dimensions=[1.0])
        )


@pytest.mark.parametrize("cls", [Mesh, Convex])
def test_a_mesh_file_is_a_resource(
    cls: type, obj_file: Path, over_the_wire: Callable[[Any], Any]
) -> None:
    """The file is named by a URI, blanks quoted, and found again from it."""
    shape = cls(obj_file, (1.0, 2.0, 3.0))
    msg = over_the_wire(shapes.shape_to_msg(shape))
    assert msg.resource == obj_file.as_uri() and "%20" in msg.resource
    assert msg.scale.tolist() == [1.0, 2.0, 3.0]
    assert shapes.shape_from_msg(msg) == shape


def test_a_resource_is_found_by_the_resolver(obj_file: Path) -> None:
    """The resolver gets the resource as it was sent and its answer is the file."""
    asked = []

    def resolve(resource: str) -> Path:
        asked.append(resource)
        return obj_file

    msg = ShapeMsg(kind=ShapeMsg.MESH, resource="package://robot/link.obj")
    assert shapes.shape_from_msg(msg, resolve).path == obj_file
    assert asked == ["package://robot/link.obj"]


def test_files_are_found_without_a_resolver_but_packages_are_not() -> None:
    """Absolute paths and file URIs name files; anything else needs someone who knows."""
    assert shapes.resolve_file("/a/b.stl") == Path("/a/b.stl")
    assert shapes.resolve_file("file:///a%20b/c.stl") == Path("/a b/c.stl")
    for resource in ("package://robot/link.stl", "relative.stl"):
        with pytest.raises(MessageError, match=resource):
            shapes.resolve_file(resource)


@pytest.mark.parametrize(
    ("msg", "words"),
    [
        (ShapeMsg(kind=99), "kind 99"),
        (ShapeMsg(kind=ShapeMsg.BOX, dimensions=[1.0, 2.0]), "width, depth, height"),
        (ShapeMsg(kind=ShapeMsg.HALF_SPACE, dimensions=[1.0]), "none"),
        (ShapeMsg(kind=ShapeMsg.MESH), "none"),
        (ShapeMsg(kind=ShapeMsg.MESH, vertices=[0.0] * 9), "triangles"),
        (ShapeMsg(kind=ShapeMsg.MESH, vertices=[0.0] * 10, triangles=[0, 1, 2]), "10 numbers"),
        (ShapeMsg(kind=ShapeMsg.MESH, vertices=[0.0] * 9, triangles=[0, 1]), "multiple of 3"),
        (
            ShapeMsg(kind=ShapeMsg.CONVEX, vertices=[0.0] * 9, resource="/a.stl"),
            r"\['resource', 'vertices'\]",
        ),
        (ShapeMsg(kind=ShapeMsg.CONVEX, vertices=[0.0, 1.0, float("nan")]), "not finite"),
    ],
)
def test_a_message_that_contradicts_itself_is_refused(msg: ShapeMsg, words: str) -> None:
    """The error names what is wrong."""
    with pytest.raises(MessageError, match=words):
        shapes.shape_from_msg(msg)


@pytest.mark.parametrize(
    "msg",
    [
        ShapeMsg(kind=ShapeMsg.SPHERE, dimensions=[-1.0]),
        ShapeMsg(kind=ShapeMsg.SPHERE, dimensions=[float("nan")]),
        ShapeMsg(kind=ShapeMsg.MESH, vertices=[0.0] * 9, triangles=[0, 1, 3]),
        ShapeMsg(kind=ShapeMsg.MESH, resource="/nowhere/at/all.obj"),
        ShapeMsg(kind=ShapeMsg.CONVEX, vertices=[0.0] * 9, scale=np.array((1.0, 0.0, 1.0))),
    ],
)
def test_sizes_and_meshes_that_are_none_are_refused_by_the_core(msg: ShapeMsg) -> None:
    """What the message can say but no shape can be raises the core's own error."""
    with pytest.raises(InvalidShapeError):
        shapes.shape_from_msg(msg)


@given(st.lists(st.floats(1e-6, 1e6), min_size=3, max_size=3))
def test_sizes_survive_a_round_trip(sizes: list[float]) -> None:
    """Sizes come back bit for bit from both message types."""
    for shape in (Box(*sizes), Cylinder(*sizes[:2]), Sphere(sizes[0])):
        assert shapes.shape_from_msg(shapes.shape_to_msg(shape)) == shape
        primitive = shapes.solid_primitive_to_msg(shape)
        assert shapes.solid_primitive_from_msg(primitive) == shape


def test_solid_primitives_have_their_own_order() -> None:
    """shape_msgs puts a cylinder's height before its radius."""
    msg = SolidPrimitive(type=SolidPrimitive.CYLINDER)
    msg.dimensions = [0.7, 0.2]
    assert msg.dimensions[SolidPrimitive.CYLINDER_HEIGHT] == 0.7
    assert shapes.solid_primitive_from_msg(msg) == Cylinder(0.2, 0.7)
    assert list(shapes.solid_primitive_to_msg(Cylinder(0.2, 0.7)).dimensions) == [0.7, 0.2]


def test_solid_primitives_that_are_no_shape_of_ours_are_refused() -> None:
    """A cone has no counterpart, an ellipsoid no solid primitive, a box no two sides."""
    with pytest.raises(MessageError, match="no box, sphere or cylinder"):
        shapes.solid_primitive_from_msg(
            SolidPrimitive(type=SolidPrimitive.CONE, dimensions=[1.0, 1.0])
        )
    with pytest.raises(MessageError, match="width, depth, height"):
        shapes.solid_primitive_from_msg(
            SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[1.0, 1.0])
        )
    with pytest.raises(MessageError, match="Ellipsoid"):
        shapes.solid_primitive_to_msg(Ellipsoid(1.0, 2.0, 3.0))


def test_a_mesh_message_keeps_vertices_and_triangles(
    over_the_wire: Callable[[Any], Any],
) -> None:
    """Both directions, with distinct numbers."""
    msg = over_the_wire(shapes.mesh_to_msg(VERTICES, FACES))
    assert msg == MeshMsg(
        vertices=[Point(x=x, y=y, z=z) for x, y, z in VERTICES.tolist()],
        triangles=[MeshTriangle(vertex_indices=row.astype(np.uint32)) for row in FACES],
    )
    assert shapes.mesh_from_msg(msg, 2.0) == Mesh(vertices=VERTICES, faces=FACES, scale=2.0)
    with pytest.raises(InvalidShapeError):
        shapes.mesh_from_msg(MeshMsg())


def test_a_plane_is_the_half_space_below_it() -> None:
    """2x + 4y - 4z - 12 = 0: the outward normal is (1, 2, -2) / 3 and the plane is 2 m away."""
    half_space, X_FH = shapes.plane_from_msg(Plane(coef=[2.0, 4.0, -4.0, -12.0]))
    assert half_space == HalfSpace()
    normal = np.array((1.0, 2.0, -2.0)) / 3.0
    np.testing.assert_allclose(X_FH[:3, 2], normal, rtol=0, atol=1e-15)
    np.testing.assert_allclose(X_FH[:3, 3], 2.0 * normal, rtol=0, atol=1e-15)
    np.testing.assert_allclose(shapes.plane_to_msg(X_FH).coef, [*normal, -2.0], rtol=0, atol=1e-15)


def test_a_plane_without_a_normal_is_refused() -> None:
    """A zero normal has no direction, and not-a-number no meaning."""
    with pytest.raises(InvalidShapeError):
        shapes.plane_from_msg(Plane(coef=[0.0, 0.0, 0.0, 1.0]))
    with pytest.raises(MessageError, match="not finite"):
        shapes.plane_from_msg(Plane(coef=[float("nan"), 0.0, 1.0, 0.0]))

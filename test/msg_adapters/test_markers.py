"""Markers of every shape, and which of them are sent when."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from builtin_interfaces.msg import Time
import numpy as np
import pytest
from visualization_msgs.msg import Marker

from msg_adapters.markers import (
    HALF_SPACE_EXTENT,
    HALF_SPACE_THICKNESS,
    marker_from_shape,
    marker_id,
    SceneMarkers,
    SMALLEST_SIZE,
)
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.shapes.capsule import Capsule
from scene_graph_ros.geometry.shapes.convex import Convex
from scene_graph_ros.geometry.shapes.cylinder import Cylinder
from scene_graph_ros.geometry.shapes.ellipsoid import Ellipsoid
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.views.draw_list import DrawItem
from scene_graph_ros.views.items import DEFAULT_COLOR

RED = Rgba(0.75, 0.125, 0.25, 0.5)
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
OFF = """OFF
4 4 6
0 0 0
1 0 0
0 1 0
0 0 1
3 0 2 1
3 0 1 3
3 1 2 3
3 2 0 3
"""
STAMP = 5_000_000_006
X = pose_from_xyz_rpy((1.5, -2.5, 3.5), (0.1, 0.2, 0.3))


def item(shape: Shape, geometry_id: int = 7, rgba: Rgba | None = RED, **fields: Any) -> DrawItem:
    """Return an item to draw."""
    return DrawItem(geometry_id, "proximity/arm/hand", shape, rgba, **fields)


@pytest.fixture
def obj_file(tmp_path: Path) -> Path:
    """Write a tetrahedron."""
    path = tmp_path / "tetrahedron.obj"
    path.write_text(OBJ)
    return path


@pytest.mark.parametrize(
    ("shape", "kind", "scale"),
    [
        (Sphere(0.5), Marker.SPHERE, (1.0, 1.0, 1.0)),
        (Sphere(0.0), Marker.SPHERE, (SMALLEST_SIZE,) * 3),
        (Box(0.1, 0.2, 0.3), Marker.CUBE, (0.1, 0.2, 0.3)),
        (Cylinder(0.25, 0.75), Marker.CYLINDER, (0.5, 0.5, 0.75)),
        (Ellipsoid(0.5, 1.0, 1.5), Marker.SPHERE, (1.0, 2.0, 3.0)),
        (
            HalfSpace(),
            Marker.CUBE,
            (HALF_SPACE_EXTENT, HALF_SPACE_EXTENT, HALF_SPACE_THICKNESS),
        ),
        (Capsule(0.25, 0.5), Marker.TRIANGLE_LIST, (1.0, 1.0, 1.0)),
        (Convex(vertices=np.eye(3)), Marker.TRIANGLE_LIST, (1.0, 1.0, 1.0)),
        (
            Mesh(vertices=np.eye(3), faces=[(0, 1, 2)], scale=2.0),
            Marker.TRIANGLE_LIST,
            (1.0, 1.0, 1.0),
        ),
    ],
)
def test_every_shape_has_its_marker(
    shape: Shape, kind: int, scale: tuple, over_the_wire: Callable[[Any], Any]
) -> None:
    """Type, full sizes, name and colour, as they arrive after serialization."""
    marker = over_the_wire(marker_from_shape(item(shape), frame_id="map"))
    assert (marker.type, marker.action) == (kind, Marker.ADD)
    assert (marker.scale.x, marker.scale.y, marker.scale.z) == scale
    assert (marker.ns, marker.id, marker.header.frame_id) == ("proximity/arm/hand", 7, "map")
    color = marker.color
    assert (color.r, color.g, color.b, color.a) == (RED.r, RED.g, RED.b, RED.a)
    assert (len(marker.points) > 0) == (kind == Marker.TRIANGLE_LIST)
    assert len(marker.points) % 3 == 0
    assert marker.pose.orientation.w == 1.0


def test_points_of_triangle_markers_span_the_shape() -> None:
    """A capsule reaches half its length plus a radius; a mesh its scaled vertices."""
    capsule = marker_from_shape(item(Capsule(0.25, 0.5)), frame_id="map")
    heights = [point.z for point in capsule.points]
    assert (min(heights), max(heights)) == (-0.5, 0.5)
    mesh = Mesh(vertices=np.eye(3), faces=[(0, 1, 2)], scale=(2.0, 3.0, 4.0))
    points = marker_from_shape(item(mesh), frame_id="map").points
    assert [(p.x, p.y, p.z) for p in points] == [(2.0, 0, 0), (0, 3.0, 0), (0, 0, 4.0)]


def test_a_mesh_file_is_a_resource_with_its_own_materials(
    obj_file: Path, over_the_wire: Callable[[Any], Any]
) -> None:
    """Without a colour the file's materials show, untinted."""
    marker = over_the_wire(
        marker_from_shape(item(Mesh(obj_file, (1.0, 2.0, 3.0)), rgba=None), frame_id="map")
    )
    assert marker.type == Marker.MESH_RESOURCE
    assert marker.mesh_resource == obj_file.as_uri()
    assert (marker.scale.x, marker.scale.y, marker.scale.z) == (1.0, 2.0, 3.0)
    assert marker.mesh_use_embedded_materials
    assert marker.color.a == marker.color.r == 0.0
    assert not marker.points


def test_a_mesh_file_with_a_colour_is_painted_in_it(obj_file: Path) -> None:
    """Its materials are not asked for."""
    marker = marker_from_shape(item(Mesh(obj_file)), frame_id="map")
    assert not marker.mesh_use_embedded_materials
    assert marker.color.r == RED.r


def test_a_file_that_can_have_no_materials_gets_the_default_colour(tmp_path: Path) -> None:
    """An STL file says nothing about its looks."""
    path = tmp_path / "triangle.stl"
    path.write_text("solid a\nendsolid a\n")
    marker = marker_from_shape(item(Mesh(path), rgba=None), frame_id="map")
    assert marker.type == Marker.MESH_RESOURCE
    assert not marker.mesh_use_embedded_materials
    assert marker.color.a == DEFAULT_COLOR.a


def test_a_mesh_in_a_package_is_found_through_it(obj_file: Path) -> None:
    """A viewer on another machine has the package, not the path."""
    marker = marker_from_shape(
        item(Mesh(obj_file)), frame_id="map", package_shares={"robot": obj_file.parent}
    )
    assert marker.mesh_resource == "package://robot/tetrahedron.obj"


def test_what_viewers_can_not_read_goes_as_triangles(obj_file: Path) -> None:
    """Mirrored meshes, file types that only we read, content without a file, and hulls."""
    unusual = obj_file.with_suffix(".off")
    unusual.write_text(OFF)
    for shape, fields in (
        (Mesh(obj_file, (-1.0, 1.0, 1.0)), {}),
        (Mesh(unusual), {}),
        (Mesh(contents=OBJ, file_type="obj"), {}),
        (Mesh(obj_file), {"as_hull": True}),
        (Convex(obj_file), {}),
    ):
        marker = marker_from_shape(item(shape, **fields), frame_id="map")
        assert marker.type == Marker.TRIANGLE_LIST
        assert len(marker.points) == 12
        assert not marker.mesh_resource


def test_without_a_colour_or_materials_there_is_a_default() -> None:
    """A primitive has no file whose materials could show."""
    marker = marker_from_shape(item(Sphere(1.0), rgba=None), frame_id="map")
    assert (marker.color.r, marker.color.a) == pytest.approx((DEFAULT_COLOR.r, DEFAULT_COLOR.a))
    assert not marker.mesh_use_embedded_materials


def test_marker_ids_fit_the_field() -> None:
    """Ids beyond 31 bits are folded instead of overflowing."""
    assert marker_id(12) == 12
    assert marker_id(2**31 + 5) == 5


def scene_markers(*items: DrawItem) -> SceneMarkers:
    """Return markers of the items."""
    markers = SceneMarkers(frame_id="map")
    markers.set_items(items)
    return markers


def test_a_full_scene_is_placed_in_the_world(over_the_wire: Callable[[Any], Any]) -> None:
    """Each marker stands where its geometry is, stamped with the poses' stamp."""
    markers = scene_markers(item(Sphere(0.5), 3), item(Box(1.0, 2.0, 3.0), 4))
    msg = over_the_wire(markers.full(np.stack([np.eye(4), X]), STAMP))
    assert [marker.id for marker in msg.markers] == [3, 4]
    for marker in msg.markers:
        assert marker.header.stamp == Time(sec=5, nanosec=6)
        assert marker.header.frame_id == "map"
    pose = msg.markers[1].pose
    assert (pose.position.x, pose.position.y, pose.position.z) == (1.5, -2.5, 3.5)
    # Half angles of roll, pitch, yaw 0.1, 0.2, 0.3: w = cos cos cos + sin sin sin.
    c, s = np.cos([0.05, 0.1, 0.15]), np.sin([0.05, 0.1, 0.15])
    assert pose.orientation.w == pytest.approx(c.prod() + s.prod(), abs=1e-15)
    assert pose.orientation.x == pytest.approx(s[0] * c[1] * c[2] - c[0] * s[1] * s[2], abs=1e-15)


def test_the_plate_of_a_half_space_lies_below_its_boundary() -> None:
    """With the normal along x the plate is moved back along x by half its thickness."""
    X_WH = np.eye(4)
    X_WH[:3, :3] = [(0, 0, 1), (0, 1, 0), (-1, 0, 0)]
    X_WH[:3, 3] = (1.0, 2.0, 3.0)
    markers = scene_markers(item(Sphere(0.5), 1), item(HalfSpace(), 2))
    ball, plate = markers.full(np.stack([X_WH, X_WH]), STAMP).markers
    assert ball.pose.position.x == 1.0
    assert plate.pose.position.x == 1.0 - 0.5 * HALF_SPACE_THICKNESS
    assert (plate.pose.position.y, plate.pose.position.z) == (2.0, 3.0)
    assert len(markers.moved(np.stack([X_WH, X_WH]), STAMP).markers) == 0


def test_only_what_moved_is_sent() -> None:
    """Nothing at rest, then exactly the row that changed by the last bit of one coordinate."""
    markers = scene_markers(*(item(Sphere(0.5), k) for k in (1, 2, 3)))
    X_WG = np.stack([np.eye(4), X, X])
    assert len(markers.moved(X_WG, STAMP).markers) == 3
    assert len(markers.moved(X_WG, STAMP).markers) == 0
    X_WG[1, 0, 3] = np.nextafter(X_WG[1, 0, 3], 10.0)
    moved = markers.moved(X_WG, STAMP + 1).markers
    assert [marker.id for marker in moved] == [2]
    assert moved[0].pose.position.x == X_WG[1, 0, 3]
    assert moved[0].header.stamp.nanosec == 7


def test_only_what_vanished_is_deleted_and_only_once() -> None:
    """A removed geometry is deleted by name, the rest is neither deleted nor sent again."""
    markers = scene_markers(item(Sphere(0.5), 1), item(Sphere(0.5), 2))
    markers.full(np.stack([X, X]), STAMP)
    assert len(markers.deletions(STAMP).markers) == 0
    markers.set_items([item(Sphere(0.5), 2), item(Box(1.0, 1.0, 1.0), 3)])
    (deletion,) = markers.deletions(STAMP).markers
    assert (deletion.action, deletion.ns, deletion.id) == (Marker.DELETE, "proximity/arm/hand", 1)
    assert deletion.header.frame_id == "map"
    assert len(markers.deletions(STAMP).markers) == 0
    assert [m.id for m in markers.moved(np.stack([X, X]), STAMP).markers] == [3]


def test_a_changed_geometry_is_sent_again_under_the_same_name() -> None:
    """Another colour or shape replaces the marker; nothing is deleted."""
    markers = scene_markers(item(Sphere(0.5), 1), item(Sphere(0.5), 2))
    markers.full(np.stack([X, X]), STAMP)
    markers.set_items([item(Sphere(0.75), 1), item(Sphere(0.5), 2, Rgba(0.0, 1.0, 0.0))])
    assert len(markers.deletions(STAMP).markers) == 0
    changed = markers.moved(np.stack([X, X]), STAMP).markers
    assert [(m.id, m.scale.x, m.color.g) for m in changed] == [
        (1, 1.5, RED.g),
        (2, 1.0, 1.0),
    ]


def test_a_geometry_that_comes_back_is_not_deleted() -> None:
    """Removed and added again between two messages: it is sent, not deleted."""
    markers = scene_markers(item(Sphere(0.5), 1))
    markers.full(X[np.newaxis], STAMP)
    markers.set_items([])
    markers.set_items([item(Sphere(0.5), 1)])
    assert len(markers.deletions(STAMP).markers) == 0
    assert len(markers.moved(X[np.newaxis], STAMP).markers) == 1


def test_an_unreadable_mesh_changes_nothing(tmp_path: Path) -> None:
    """The markers from before go on, as if the new ones had not been offered."""
    path = tmp_path / "broken.stl"
    path.write_bytes(b"no mesh")
    markers = scene_markers(item(Sphere(0.5), 1))
    with pytest.raises(MeshError):
        markers.set_items([item(Convex(path), 2)])
    assert [m.id for m in markers.full(X[np.newaxis], STAMP).markers] == [1]
    assert len(markers.deletions(STAMP).markers) == 0


def test_callers_mistakes_are_told() -> None:
    """Two markers of one geometry, and another number of poses than of markers."""
    with pytest.raises(ValueError, match="same group and geometry id"):
        scene_markers(item(Sphere(0.5), 1), item(Sphere(0.75), 1))
    with pytest.raises(ValueError, match="1 items"):
        scene_markers(item(Sphere(0.5), 1)).full(np.stack([X, X]), STAMP)


def test_an_empty_scene_has_no_markers() -> None:
    """No items, no poses, no error."""
    markers = scene_markers()
    for msg in (markers.full(np.empty((0, 4, 4)), STAMP), markers.deletions(STAMP)):
        assert len(msg.markers) == 0

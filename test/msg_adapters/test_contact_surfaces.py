"""Contact surfaces in messages: sums, columns, clouds and triangles, with distinct numbers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from visualization_msgs.msg import Marker
from wire import assert_same_bytes

from msg_adapters.contact_rows import NO_ROWS, surface_rows
from msg_adapters.contact_surface_markers import (
    contact_surface_markers_to_msg,
    pressure_namespace,
)
from msg_adapters.contact_surfaces import (
    CLOUD_FIELDS,
    contact_surfaces_to_msg,
    face_points_from_msg,
    face_points_to_msg,
    surface_arrays_from_msg,
)
from msg_adapters.contacts import contacts_to_msg
from msg_adapters.errors import MessageError
from msg_adapters.names import SceneNames
from msg_adapters.wire.contact_surface_markers import ContactSurfaceMarkerWire
from scene_graph_msgs.msg import GeometryNames
from scene_graph_ros import geometry as core
from scene_graph_ros.views.surfaces import pressure_colors, triangles_of

OFFSETS = ((0.0, 0.0), (0.01, -0.02))
"""Metres: where the second ball is beside the pad's middle."""


class Surfaces(SimpleNamespace):
    """Columns as those of a table of contact surfaces."""

    def __len__(self):
        return len(self.id_M)


def polygons(pressure=None):
    """Return two surfaces, a square and a triangle, then a pentagon, with distinct numbers.

    They lie in planes z = 1 and z = 2; the pressures are 10 x + 20 y + 5 where not given.
    """
    square = np.array([(0, 0, 1), (2, 0, 1), (2, 1, 1), (0, 1, 1)], float)
    triangle = np.array([(2, 0, 1), (5, 0, 1), (2, 1, 1)], float)
    pentagon = np.array([(0, 0, 2), (1, 0, 2), (1, 1, 2), (0.5, 2, 2), (0, 1, 2)], float)
    vertices = np.concatenate([square, triangle, pentagon])
    if pressure is None:
        pressure = vertices @ (10, 20, 0) + 5
    areas = np.array([2.0, 1.5, 1.5])
    # The pentagon is a unit square below a triangle of base and height 1.
    centroids = np.array([(1, 0.5, 1), (3, 1 / 3, 1), (0.5, (0.5 + 0.5 * 4 / 3) / 1.5, 2)])
    return Surfaces(
        id_M=np.array([3, 3]),
        id_N=np.array([7, 9]),
        total_area=np.array([3.5, 1.5]),
        centroid_W=np.array([(2 * 1 + 1.5 * 3) / 3.5, (2 * 0.5 + 1.5 / 3) / 3.5, 1.0])
        * [[1.0], [0.0]]
        + centroids[2] * [[0.0], [1.0]],
        force_W=np.array([(1.25, 2.5, -3.75), (4.5, -5.25, 6.125)]),
        moment_W=np.array([(0.5, 0.25, 0.125), (-0.75, 1.5, 8.0)]),
        is_compliant_M=np.array([True, False]),
        is_compliant_N=np.array([False, True]),
        num_faces=np.array([2, 1]),
        num_vertices=np.array([7, 5]),
        vertex_start=np.array([0, 7, 12]),
        face_start=np.array([0, 2, 3]),
        vertices_W=vertices,
        pressure=np.asarray(pressure, float),
        corners=np.array([[0], [4], [0]]),
        face_normals_W=np.array([(0, 0, 1.0), (0, 0.6, 0.8), (0, 0, -1)]),
        face_areas=areas,
        face_centroids_W=centroids,
        face_pressures=centroids @ (10, 20, 0) + 5,
        grad_pressure_M_W=np.arange(9.0).reshape(3, 3),
        grad_pressure_N_W=np.arange(9.0).reshape(3, 3) + 100,
    )


@pytest.fixture(scope="module")
def pressed():
    """Queries about two balls that press on a pad, in two configurations, and all names."""
    scene_graph = core.SceneGraph()
    source = scene_graph.register_source("s")

    def add(name, shape, X, properties):
        instance = core.GeometryInstance(X, shape, name)
        instance.set_proximity_properties(properties)
        frame = scene_graph.register_frame(source, core.GeometryFrame(name))
        scene_graph.register_geometry(source, frame, instance)
        return frame

    soft = core.ProximityProperties()
    core.add_compliant_hydroelastic_properties(soft, 0.1, 2e5)
    rigid = core.ProximityProperties()
    core.add_rigid_hydroelastic_properties(rigid, 0.1)
    add("pad", core.Box(1.0, 0.5, 0.2), np.eye(4), soft)
    balls = [add(f"ball{i}", core.Sphere(0.1), np.eye(4), rigid) for i in range(2)]
    context = scene_graph.create_default_context()
    tables = []
    for x, y in OFFSETS:
        poses = np.tile(np.eye(4), (2, 1, 1))
        poses[0, :3, 3], poses[1, :3, 3] = (-0.3, 0, 0.19), (0.3 + x, y, 0.18)
        context.set_frame_poses(source, dict(zip(balls, poses, strict=True)))
        tables.append(scene_graph.query_object(context).bake())
    return tables, SceneNames(scene_graph.model_inspector())


def test_sums_have_the_fields_of_their_message():
    """Each number stands where the message has it; means are weighted by area."""
    table = polygons()
    rows = surface_rows(table)
    graph = core.SceneGraph()
    source = graph.register_source("s")
    instances = [core.GeometryInstance(np.eye(4), core.Sphere(1.0), f"g{i}") for i in range(3)]
    ids = [int(graph.register_anchored_geometry(source, instance)) for instance in instances]
    names = SceneNames(graph.model_inspector())
    rows = replace(rows, id_A=np.array([ids[0], ids[0]]), id_B=np.array(ids[1:]))
    message = contacts_to_msg(
        SimpleNamespace(
            id_A=[], id_B=[], p_WCa=np.empty((0, 3)), p_WCb=np.empty((0, 3)),
            nhat_BA_W=np.empty((0, 3)), depth=np.empty(0),
        ),
        names, stamp_ns=1, frame_id="world", scene_version=2, surfaces=rows,
    )  # fmt: skip
    first, second = message.surfaces
    assert (first.geometry_a.name, first.geometry_b.name) == ("g0", "g1")
    assert second.geometry_b.name == "g2"
    assert first.area == 3.5
    assert first.centroid.x == pytest.approx(6.5 / 3.5)
    # Square: 5 + 10 + 10 = 25 at its centre; triangle: 5 + 30 + 20 / 3.
    mean = (2.0 * 25 + 1.5 * (35 + 20 / 3)) / 3.5
    assert first.pressure == pytest.approx(mean, rel=1e-15)
    assert first.pressure_max == 55.0
    normal = np.array((0, 1.5 * 0.6, 2 + 1.5 * 0.8))
    assert (first.normal.y, first.normal.z) == pytest.approx(
        tuple((normal / np.linalg.norm(normal))[1:]), rel=1e-15
    )
    assert (first.traction.x, first.traction.z) == (1.25 / 3.5, -3.75 / 3.5)
    assert (first.wrench.force.x, first.wrench.force.y) == (1.25, 2.5)
    assert (second.wrench.torque.x, second.wrench.torque.z) == (-0.75, 8.0)
    assert second.normal.z == -1.0


@pytest.mark.parametrize("shift", [-5.0, -15.0, -30.0, -60.0, -1000.0])
def test_negative_pressure_counts_as_zero(shift):
    """The mean of max(p, 0) over faces that the zero line crosses, against a fine grid."""
    table = polygons()
    table.pressure = table.pressure + shift
    table.face_pressures = table.face_pressures + shift
    rows = surface_rows(table)
    count = 1500
    u = (np.arange(count) + 0.5) / count
    x, y = np.meshgrid(5 * u, u)
    inside = np.where(x <= 2, 1.0, (y <= (5 - x) / 3).astype(float))
    pressure = np.maximum(10 * x + 20 * y + 5 + shift, 0.0)
    expected = (inside * pressure).mean() * 5 / 3.5
    # The grid resolves 1/1500 of the size, and the largest pressure is 55 Pa.
    assert rows.numbers[0, 7] == pytest.approx(expected, abs=0.05)
    assert rows.numbers[0, 8] == max(55.0 + shift, 0.0)


def test_normals_that_cancel_are_zero():
    """The mean normal of a closed surface has no direction, and rounding is none."""
    table = polygons()
    table.face_normals_W = np.array([(0, 0, 1.0), (0, 0, -4 / 3), (0, 0, 1.0)])
    assert surface_rows(table).numbers[0, 4:7].tolist() == [0.0, 0.0, 0.0]


def test_no_surfaces_are_no_rows():
    """Without surfaces there is nothing to sum."""
    assert surface_rows(()) is NO_ROWS


def test_faces_become_fans():
    """Triangles cover each polygon, in its sense, and know their face."""
    triangles, face = triangles_of(polygons())
    assert triangles.tolist() == [
        [0, 1, 2], [0, 2, 3], [4, 5, 6], [7, 8, 9], [7, 9, 10], [7, 10, 11]
    ]  # fmt: skip
    assert face.tolist() == [0, 0, 1, 2, 2, 2]


@pytest.mark.parametrize("representation", ["triangle", "polygon"])
def test_columns_come_back_as_the_surfaces_they_were(pressed, over_the_wire, representation):
    """Two configurations with two surfaces each, number by number."""
    queries, names = pressed
    tables = [query.compute_contact_surfaces(representation) for query in queries]
    message = over_the_wire(contact_surfaces_to_msg(tables, names, with_gradients=True))
    assert message.geometries.name == ["pad", "ball0", "ball1"]
    back = surface_arrays_from_msg(message)
    assert [len(surfaces) for surfaces in back] == [2, 2]
    assert not np.array_equal(back[0][1].force_W, back[1][1].force_W)
    for table, surfaces in zip(tables, back, strict=True):
        for theirs, ours in zip(table, surfaces, strict=True):
            assert (ours.id_A, ours.id_B) == (int(theirs.id_M), int(theirs.id_N))
            assert (ours.is_compliant_A, ours.is_compliant_B) == (True, False)
            np.testing.assert_array_equal(ours.vertices_W, theirs.vertices_W)
            np.testing.assert_array_equal(ours.pressure, theirs.pressure)
            np.testing.assert_array_equal(ours.face_areas, theirs.face_areas)
            np.testing.assert_array_equal(ours.face_normals_W, theirs.face_normals_W)
            np.testing.assert_array_equal(ours.face_centroids_W, theirs.face_centroids_W)
            np.testing.assert_array_equal(ours.face_pressures, theirs.face_pressures)
            np.testing.assert_array_equal(ours.grad_pressure_A_W, theirs.grad_pressure_M_W)
            np.testing.assert_array_equal(ours.grad_pressure_B_W, 0.0)
            np.testing.assert_array_equal(ours.centroid_W, theirs.centroid_W)
            force, moment = theirs.force_and_moment(theirs.centroid_W)
            np.testing.assert_allclose(ours.force_W, force)
            np.testing.assert_allclose(ours.moment_W, moment)
            assert ours.total_area == theirs.total_area
            assert len(ours.faces) == theirs.num_faces
            for a, b in zip(ours.faces, theirs.faces, strict=True):
                np.testing.assert_array_equal(a, b)


def test_sums_alone_have_no_faces(pressed):
    """Without faces and names the message holds what is summed, and reads back so."""
    queries, _ = pressed
    table = queries[0].compute_contact_surfaces("polygon")
    message = contact_surfaces_to_msg([table], None, with_faces=False)
    assert len(message.vertices) == len(message.corners) == len(message.face_areas) == 0
    assert message.geometries == GeometryNames()
    ((first, second),) = surface_arrays_from_msg(message)
    assert first.faces == ()
    assert second.grad_pressure_A_W is None
    np.testing.assert_array_equal(second.force_W, table.force_W[1])


def test_a_cloud_has_a_point_for_each_face(over_the_wire):
    """Fields by name, in float32, with the row of the surface."""
    table = polygons()
    message = over_the_wire(face_points_to_msg(table, stamp_ns=1_500_000_000, frame_id="map"))
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 500_000_000)
    assert (message.header.frame_id, message.height, message.width) == ("map", 1, 3)
    assert message.row_step == 3 * message.point_step == len(message.data)
    assert [field.name for field in message.fields] == [*CLOUD_FIELDS, "surface"]
    points = face_points_from_msg(message)
    np.testing.assert_allclose(points["x"], [1, 3, 0.5])
    np.testing.assert_allclose(points["y"], table.face_centroids_W[:, 1], rtol=1e-7)
    np.testing.assert_allclose(points["z"], [1, 1, 2])
    np.testing.assert_allclose(points["normal_y"], [0, 0.6, 0], rtol=1e-7)
    np.testing.assert_allclose(points["normal_z"], [1, 0.8, -1], rtol=1e-7)
    np.testing.assert_allclose(points["pressure"], table.face_pressures, rtol=1e-7)
    np.testing.assert_allclose(points["area"], [2, 1.5, 1.5])
    assert points["surface"].tolist() == [0, 0, 1]
    message.fields[0].name = "y"
    with pytest.raises(MessageError, match="fields of the cloud"):
        face_points_from_msg(message)


def test_colours_go_from_blue_to_red():
    """At quarters of the scale: blue, cyan, green, yellow, red; outside, the ends."""
    pressure = np.array([-5.0, 0.0, 0.25, 0.5, 0.75, 1.0, 7.0, 0.125]) * 400.0
    colors = pressure_colors(pressure, 400.0)
    assert colors[:, :3].tolist() == [
        [0, 0, 1], [0, 0, 1], [0, 1, 1], [0, 1, 0], [1, 1, 0], [1, 0, 0], [1, 0, 0], [0, 0.5, 1]
    ]  # fmt: skip
    assert (colors[:, 3] == 1.0).all()


@pytest.mark.parametrize(
    ("scale", "text"),
    [(1e5, "100 kPa"), (2.5e6, "2.5 MPa"), (1e9, "1 GPa"), (20.0, "20 Pa"), (0.5, "0.5 Pa")],
)
def test_the_namespace_says_the_scale(scale, text):
    """In words that a person reads in the viewer's list."""
    assert pressure_namespace(scale) == f"pressure 0 (blue) to {text} (red)"


@pytest.mark.parametrize("frame_id", ["", "map", "world", "a/b/c/d/e"])
def test_triangles_are_byte_for_byte_what_is_serialized(frame_id):
    """With surfaces and without, and after a change of scale that takes the former back."""
    wire = ContactSurfaceMarkerWire(frame_id, serialize_message)
    table, fewer = polygons(), polygons()
    fewer.vertices_W = fewer.vertices_W + 0.125
    tables = [table, fewer, (), table]
    for step, surfaces in enumerate(tables):
        options = {"scale": 50.0, "stamp_ns": 3 + step * 10**9}
        ours = wire.message(surfaces, **options)
        message = contact_surface_markers_to_msg(surfaces, frame_id=frame_id, **options)
        assert_same_bytes(ours, message)
    assert len(message.markers[0].points) == len(message.markers[0].colors) == 18
    options = {"scale": 7e6, "stamp_ns": 5}
    message = contact_surface_markers_to_msg(table, frame_id=frame_id, **options)
    former = Marker(ns=pressure_namespace(50.0), action=Marker.DELETE)
    former.header = message.markers[0].header
    message.markers.insert(0, former)
    assert_same_bytes(wire.message(table, **options), message)
    message.markers.pop(0)
    assert_same_bytes(wire.message(table, **options), message)

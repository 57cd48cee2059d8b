"""Deformable geometry in messages: meshes, configurations, contact, markers; distinct numbers."""

from __future__ import annotations

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker, MarkerArray
from wire import assert_same_bytes

from msg_adapters.contact_rows import deformable_rows
from msg_adapters.deformable_markers import deformable_marker_to_msg
from msg_adapters.deformables import (
    configurations_from_msg,
    configurations_to_msg,
    deformable_contacts_to_msg,
    deformable_from_msg,
    volume_mesh_from_msg,
    volume_mesh_to_msg,
)
from msg_adapters.errors import MessageError
from msg_adapters.names import SceneNames
from msg_adapters.wire.deformable_markers import DeformableMarkers, Positions
from msg_adapters.wire.markers import MarkerWire
from scene_graph_msgs.msg import (
    DeformableConfigurations,
    DeformableGeometryDescription,
    GeometryDescription,
    Property,
    RoleProperties,
    Shape,
    VolumeMesh,
)
from scene_graph_ros import geometry as core
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.views.deformables import DeformableItem
from scene_graph_ros.views.draw_list import DrawItem

VERTICES = np.array([(0, 0, 0), (1.5, 0, 0), (0, 2.5, 0), (0, 0, 3.5), (1, 1, -4.5)])
TETRAHEDRA = np.array([(0, 1, 2, 3), (0, 2, 1, 4)])


def test_a_volume_mesh_there_and_back(over_the_wire):
    """Vertices and tetrahedra, in their order."""
    mesh = core.VolumeMesh(VERTICES, TETRAHEDRA)
    message = over_the_wire(volume_mesh_to_msg(mesh))
    assert list(message.vertices[3:6]) == [1.5, 0.0, 0.0]
    assert list(message.tetrahedra) == [0, 1, 2, 3, 0, 2, 1, 4]
    back = volume_mesh_from_msg(message)
    np.testing.assert_array_equal(back.vertices, mesh.vertices)
    np.testing.assert_array_equal(back.tetrahedra, mesh.tetrahedra)


@pytest.mark.parametrize(
    ("change", "error", "word"),
    [
        ({"vertices": [0.0] * 14}, MessageError, "14"),
        ({"vertices": [np.nan] * 15}, MessageError, "row 0"),
        ({"tetrahedra": [0, 1, 2, 3, 4]}, MessageError, "5"),
        ({"tetrahedra": [0, 1, 2, 9]}, MeshError, "9"),
        ({"tetrahedra": [0, 2, 1, 3]}, MeshError, "VolumeMesh"),
    ],
)
def test_what_is_no_volume_mesh_is_refused(change, error, word):
    """Lengths by the adapter, the mesh itself by the core."""
    fields = {"vertices": VERTICES.ravel().tolist(), "tetrahedra": TETRAHEDRA.ravel().tolist()}
    with pytest.raises(error, match=word):
        volume_mesh_from_msg(VolumeMesh(**{**fields, **change}))


def test_configurations_there_and_back(over_the_wire):
    """Names, numbers of vertices, positions, stamp and frame."""
    given = {"a": VERTICES[:2] + 0.125, "b": VERTICES, "none": np.empty((0, 3))}
    message = over_the_wire(configurations_to_msg(given, stamp_ns=7_000_000_011, frame_id="map"))
    assert list(message.vertex_counts) == [2, 5, 0]
    assert list(message.positions[:3]) == [0.125] * 3
    batch = configurations_from_msg(message)
    assert (batch.names, batch.stamp_ns, batch.frame_id) == (
        ("a", "b", "none"),
        7_000_000_011,
        "map",
    )
    for ours, theirs in zip(batch.positions, given.values(), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert configurations_from_msg(DeformableConfigurations()).names == ()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"names": ["a"]}, "1 names come with 0 vertex_counts"),
        ({"names": ["a"], "vertex_counts": [2], "positions": [0.0] * 5}, "5 numbers, not 3"),
    ],
)
def test_lengths_that_contradict_each_other(fields, message):
    """The message as a whole means nothing then."""
    with pytest.raises(MessageError, match=message):
        configurations_from_msg(DeformableConfigurations(**fields))
    with pytest.raises(MessageError, match="'a' are"):
        configurations_to_msg({"a": np.zeros(6)}, stamp_ns=0, frame_id="")


def test_a_description_and_its_properties(tmp_path):
    """The hint or the mesh, and a mesh to embed that the resolver finds."""
    role = RoleProperties(
        role=RoleProperties.ILLUSTRATION,
        properties=[
            Property(
                group="deformable",
                name="embedded_mesh",
                type=Property.STRING,
                strings=["package://soft/skin.obj"],
            )
        ],
    )
    geometry = GeometryDescription(
        name="g", shape=Shape(kind=Shape.SPHERE, dimensions=[0.75]), roles=[role]
    )
    geometry.pose.orientation.w = 1.0
    message = DeformableGeometryDescription(geometry=geometry, resolution_hint=[0.25])

    def resolve(address):
        assert address == "package://soft/skin.obj"
        return tmp_path / "skin.obj"

    given = deformable_from_msg(message, resolve)
    assert (given.resolution_hint, given.reference_mesh) == (0.25, None)
    assert given.instance.shape() == core.Sphere(0.75)
    properties = given.instance.illustration_properties()
    assert properties.get_property("deformable", "embedded_mesh") == str(tmp_path / "skin.obj")
    message.resolution_hint = []
    message.reference_mesh = volume_mesh_to_msg(core.VolumeMesh(VERTICES, TETRAHEDRA))
    given = deformable_from_msg(message, resolve)
    assert given.resolution_hint is None
    np.testing.assert_array_equal(given.reference_mesh.vertices, VERTICES)


@pytest.fixture(scope="module")
def soft():
    """Two cubes, 0.1 m apart in height and 0.01 m in each other, the lower one in the floor."""
    graph = core.SceneGraph()
    source = graph.register_source("s")
    ids = []
    for name, z in (("lower", 0.045), ("upper", 0.135)):
        X = np.eye(4)
        X[:3, 3] = 0.25, 0, z
        instance = core.GeometryInstance(X, core.Box(0.2, 0.2, 0.1), name)
        instance.set_proximity_properties(core.ProximityProperties())
        instance.set_illustration_properties(core.IllustrationProperties())
        world = graph.model_inspector().world_frame_id()
        ids.append(graph.register_deformable_geometry(source, world, instance, 0.1))
    floor = core.GeometryInstance(np.eye(4), core.HalfSpace(), "floor")
    floor.set_proximity_properties(core.ProximityProperties())
    graph.register_anchored_geometry(source, floor)
    context = graph.create_default_context()
    return graph, source, ids, context, SceneNames(graph.model_inspector())


def test_contact_is_what_the_core_says(soft, over_the_wire):
    """Columns of both configurations; a rigid partner has no tetrahedra."""
    graph, _, ids, context, names = soft
    contact = graph.query_object(context).compute_deformable_contact()
    assert [surface.is_B_deformable for surface in contact] == [True, False]
    message = over_the_wire(deformable_contacts_to_msg([contact, contact], names))
    assert list(message.configuration_start) == [0, 2, 4]
    assert list(message.is_b_deformable) == [1, 0] * 2
    assert message.geometries.name == ["lower", "upper", "floor"]
    counts = [surface.num_contact_points for surface in contact]
    assert list(message.face_start) == [0, *np.cumsum(counts * 2).tolist()]
    soft_pair, rigid_pair = contact
    first, second = slice(0, counts[0]), slice(counts[0], sum(counts))
    points = np.array(message.contact_points).reshape(-1, 3)
    np.testing.assert_array_equal(points[first], soft_pair.contact_points_W)
    np.testing.assert_array_equal(points[second], rigid_pair.contact_points_W)
    np.testing.assert_array_equal(
        np.array(message.face_normals).reshape(-1, 3)[first], soft_pair.nhats_BA_W
    )
    np.testing.assert_array_equal(message.face_areas[second], rigid_pair.face_areas)
    np.testing.assert_array_equal(message.signed_distances[first], soft_pair.signed_distances)
    for side, expected in (("a", soft_pair.tetrahedra_A), ("b", soft_pair.tetrahedra_B)):
        np.testing.assert_array_equal(getattr(message, f"tetrahedra_{side}")[first], expected)
    corners_B = np.array(message.tetrahedron_vertices_b).reshape(-1, 4)
    np.testing.assert_array_equal(corners_B[first], soft_pair.vertex_indices_B)
    weights_B = np.array(message.weights_b).reshape(-1, 4)
    np.testing.assert_array_equal(weights_B[first], soft_pair.barycentric_coordinates_B)
    np.testing.assert_array_equal(weights_B[second], 0.0)
    begin, end = message.corner_start[0], message.corner_start[1]
    polygon = np.array(message.corners).reshape(-1, 3)[begin:end]
    np.testing.assert_array_equal(polygon, soft_pair.polygon(0))
    assert list(message.participating_ids) == [int(i) for i in ids] * 2
    start = message.participation_start
    np.testing.assert_array_equal(
        message.participating_vertices[start[1] : start[2]],
        contact.contact_participation(ids[1]).vertices,
    )
    empty = deformable_contacts_to_msg([], None)
    assert list(empty.face_start) == list(empty.corner_start) == [0]


def test_contact_is_summed(soft):
    """Area and centre of the cut of the floor, and the deepest contact point."""
    graph, _, _, context, _ = soft
    contact = graph.query_object(context).compute_deformable_contact()
    rows = deformable_rows(contact)
    lower = rows.numbers[1]
    np.testing.assert_allclose(lower[:4], [0.25, 0, 0, 0.04], atol=1e-12)
    np.testing.assert_allclose(lower[4:7], [0, 0, 1], atol=1e-12)
    assert lower[7] == contact[1].signed_distances.min()
    # Between the two cubes the upper one, B, pushes the lower one, A, down.
    assert rows.numbers[0, 6] == pytest.approx(-1.0, abs=1e-9)


def items_of(graph, ids, names):
    """Return what to draw of the two cubes."""
    inspector = graph.model_inspector()
    return [
        DeformableItem(
            DrawItem(int(i), f"r/s/{names.geometry_name(i).name}", core.Sphere(1.0),
                       core.Rgba(0.125, 0.25, 0.5, 1.0)),
            inspector.get_driven_meshes(i, core.Role.ILLUSTRATION)[0].triangles,
        )
        for i in ids
    ]  # fmt: skip


def positions_of(query, ids):
    """Return where their driven meshes are."""
    return {
        int(i): Positions(
            query.snapshot.configuration(i),
            lambda i=i: query.get_driven_mesh_configurations_in_world(i, core.Role.ILLUSTRATION),
        )
        for i in ids
    }


@pytest.mark.parametrize("name", ["", "a", "abcde", "abcdefg"])
@pytest.mark.parametrize("rigid", [0, 1, 3])
def test_markers_stand_behind_those_of_rigid_geometry(soft, name, rigid):
    """Whatever comes before them, the array is what the serializer makes of all together."""
    graph, source, ids, context, names = soft
    shapes = [core.Capsule(0.1, 0.2), core.Sphere(0.5), core.Box(1, 2, 3)][:rigid]
    before = [
        DrawItem(100 + i, f"{name}{i}", shape, core.Rgba(1, 0, 0, 1))
        for i, shape in enumerate(shapes)
    ]
    wire = MarkerWire(serialize_message, frame_id="world")
    wire.set_items(before)
    markers = DeformableMarkers(serialize_message, frame_id="world")
    items = items_of(graph, ids, names)
    markers.set_items(items)
    context = context.clone()
    query = graph.query_object(context).bake()
    poses = np.tile(np.eye(4), (rigid, 1, 1))

    def expected(chosen, query, is_whole):
        data, count = wire.message(poses, 5, is_whole=is_whole)
        now = positions_of(query, ids)
        ours, more = markers.append(data, now, 5, is_whole=is_whole)
        message = deserialize_message(data, MarkerArray)
        for item in chosen:
            (p_WVs,) = now[item.item.geometry_id].compute()
            message.markers.append(
                deformable_marker_to_msg(item, p_WVs, stamp_ns=5, frame_id="world")
            )
        assert count + more == len(message.markers)
        assert_same_bytes(ours, message)

    expected(items, query, True)
    # Nothing moved, so that nothing is said; then one does.
    expected([], query, False)
    moved = context.configuration(ids[1]) + np.array((0, 0, 0.25))
    context.set_configurations(source, {ids[1]: moved})
    expected(items[1:], graph.query_object(context).bake(), False)
    expected(items, graph.query_object(context).bake(), True)


def test_markers_that_vanished_are_deleted_once(soft):
    """By name and id, before the others; what comes back in another look is sent again."""
    graph, _, ids, context, names = soft
    markers = DeformableMarkers(serialize_message, frame_id="world")
    items = items_of(graph, ids, names)
    markers.set_items(items)
    now = positions_of(graph.query_object(context).bake(), ids)
    nothing = serialize_message(MarkerArray())
    markers.append(nothing, now, 5, is_whole=True)
    other = items[0]._replace(item=items[0].item._replace(rgba=core.Rgba(0, 1, 0, 1)))
    markers.set_items([other])
    data, count = markers.append(nothing, now, 6, is_whole=True)
    message = deserialize_message(data, MarkerArray)
    assert count == 2
    assert [(m.action, m.ns) for m in message.markers] == [
        (Marker.DELETE, "r/s/upper"), (Marker.ADD, "r/s/lower")
    ]  # fmt: skip
    assert message.markers[0].id == int(ids[1])
    assert message.markers[0].header.stamp.nanosec == 6
    assert message.markers[1].color.g == 1.0
    assert markers.append(nothing, now, 7, is_whole=False) == (nothing, 0)

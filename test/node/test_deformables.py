"""Deformable geometry over DDS: configurations in, markers and contact out, services, faults."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
import numpy as np
import pytest
from scene_requests import pose, reference
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.deformables import configurations_to_msg, volume_mesh_from_msg
from scene_graph_msgs.msg import (
    ContactArray,
    DeformableConfigurations,
    DeformableGeometryDescription,
    GeometryDescription,
    RoleProperties,
    Shape,
    Status,
    VolumeMesh,
)

SCENE = """
version: 1
sources:
  - {name: cell}
  - {name: sim, configurations: {topic: /sim/soft}}
  - {name: other}
geometries:
  - {name: floor, source: cell, shape: {type: half_space}, roles: {proximity: {}}}
  - name: sponge
    source: sim
    pose: {xyz: [0, 0, 0.2]}
    shape: {type: box, size: [0.2, 0.3, 0.1]}
    color: [0.25, 0.5, 0.75, 0.5]
    deformable: {resolution_hint: 0.1}
  - name: theirs
    source: other
    pose: {xyz: [5, 0, 0.2]}
    shape: {type: box, size: [0.2, 0.2, 0.2]}
    deformable: {}
"""

BOTH = [RoleProperties(role=role) for role in (1, 2)]
VERTICES = [0.0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]
"""Of a tetrahedron."""


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with a sponge above a floor."""
    path = tmp_path_factory.mktemp("scene") / "soft.yaml"
    path.write_text(SCENE)
    return start_node({"scene": path, "diagnostics_rate": 20.0})


@pytest.fixture(scope="module")
def reference_positions(client, node):
    """Where the sponge's vertices are at the start: those of a box."""
    answer = client.call("GetDeformableConfigurations", geometries=[reference("sponge")])
    assert answer.status.code == Status.OK, answer.status
    return np.array(answer.configurations.positions).reshape(-1, 3)


@pytest.fixture(scope="module")
def publisher(client, node):
    """Publishes the sponge's configurations."""
    return client.publisher(DeformableConfigurations, "/sim/soft")


@pytest.fixture(scope="module")
def diagnostics(client, node):
    """What the node says about itself."""
    listener = client.listen(DiagnosticArray, "/diagnostics")
    yield listener
    client.forget(listener)


def send(client, publisher, positions, name="sponge", frame_id="world"):
    """Publish positions, stamped now."""
    message = configurations_to_msg({name: positions}, stamp_ns=0, frame_id=frame_id)
    message.header.stamp = client.now()
    publisher.publish(message)
    return message


def squeezed(positions, bottom):
    """Return positions moved down until the lowest vertex is at ``bottom``."""
    return positions + np.array((0.0, 0.0, bottom - positions[:, 2].min()))


def test_the_meshes_can_be_asked_for(client, node, reference_positions):
    """Reference meshes come in the geometry's frame; names are those that sources publish."""
    answer = client.call("GetDeformableConfigurations", with_reference_meshes=True)
    assert answer.configurations.names == ["sponge", "theirs"]
    assert [name.source for name in answer.geometries] == ["sim", "other"]
    mesh = volume_mesh_from_msg(answer.reference_meshes[0])
    np.testing.assert_allclose(
        mesh.vertices + np.array((0, 0, 0.2)), reference_positions, atol=1e-15
    )
    assert mesh.volumes().sum() == pytest.approx(0.2 * 0.3 * 0.1, rel=1e-12)
    assert answer.configurations.header.frame_id == "world"
    described = client.call("DescribeScene")
    topics = {source.name: source.configuration_topic for source in described.sources}
    assert topics == {"cell": "", "sim": "/sim/soft", "other": "/other/configurations"}
    deformable = {g.geometry.name: g.is_deformable for g in described.geometries}
    assert deformable == {"floor": False, "sponge": True, "theirs": True}
    refused = client.call("GetDeformableConfigurations", geometries=[reference("floor")])
    assert refused.status.code == Status.INVALID_ARGUMENT
    assert "floor" in refused.status.message


def test_a_configuration_moves_markers_and_makes_contact(
    client, node, publisher, reference_positions
):
    """The sponge 2 cm deep in the floor: the markers are there, and the cut is its base."""
    markers = client.listen(MarkerArray, "markers/illustration")
    contacts = client.listen(ContactArray, "contacts")
    markers.wait_for(lambda m: any("sim" in marker.ns for marker in m.markers), "the first marker")
    positions = squeezed(reference_positions, -0.02)
    stamp = send(client, publisher, positions).header.stamp
    message = contacts.wait_for(lambda m: len(m.deformables) == 1, "the contact")
    (contact,) = message.deformables
    assert message.header.stamp == stamp
    assert (contact.geometry_a.name, contact.geometry_b.name) == ("sponge", "floor")
    assert contact.area == pytest.approx(0.2 * 0.3, rel=1e-9)
    assert contact.normal.z == pytest.approx(1.0, abs=1e-9)
    assert contact.centroid.z == pytest.approx(0.0, abs=1e-9)
    assert -0.02 - 1e-9 <= contact.signed_distance < 0.0
    assert len(message.points) == 0

    def heights(m):
        return [p.z for marker in m.markers if marker.ns == "illustration/sim/world"
                for p in marker.points]  # fmt: skip

    message = markers.wait_for(lambda m: heights(m) and min(heights(m)) < 0.0, "the squeezed one")
    (marker,) = [m for m in message.markers if m.ns == "illustration/sim/world"]
    assert marker.type == Marker.TRIANGLE_LIST
    corners = np.array([(p.x, p.y, p.z) for p in marker.points])
    a, b, c = corners.reshape(-1, 3, 3).transpose(1, 0, 2)
    # Closed and outward: the divergence theorem gives the volume of the box.
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    assert volume == pytest.approx(0.2 * 0.3 * 0.1, rel=1e-12)
    assert marker.color.b == 0.75
    assert marker.pose.orientation.w == 1.0
    # The other one did not move, so that it is not sent again.
    assert {m.ns for m in message.markers} == {"illustration/sim/world"}
    for listener in (markers, contacts):
        client.forget(listener)


def test_newcomers_get_all_markers(client, node, publisher, reference_positions):
    """A viewer that comes late sees the deformed mesh, the other one and the rigid floor."""
    send(client, publisher, squeezed(reference_positions, -0.01))
    markers = client.listen(MarkerArray, "markers/proximity")
    message = markers.wait_for(lambda m: len(m.markers) == 3, "all markers")
    by_name = {marker.ns: marker for marker in message.markers}
    assert set(by_name) == {
        "proximity/cell/world", "proximity/sim/world", "proximity/other/world"
    }  # fmt: skip
    assert len(by_name["proximity/other/world"].points) == 3 * 12
    client.forget(markers)


def test_the_service_says_which_vertices_take_part(client, node, publisher, reference_positions):
    """Contact points are the weighted vertices; the vertices below the floor take part."""
    positions = squeezed(reference_positions, -0.02)
    message = send(client, publisher, positions)
    options = {"minimal_stamp": message.header.stamp}
    from scene_graph_msgs.msg import QueryOptions

    asked = QueryOptions(**options)
    asked.timeout.sec = 20
    answer = client.call("ComputeDeformableContact", options=asked)
    assert answer.status.code == Status.OK, answer.status
    table = answer.table
    assert list(table.configuration_start) == [0, 1]
    assert list(table.is_b_deformable) == [0]
    count = len(table.face_areas)
    assert list(table.face_start) == [0, count]
    points = np.array(table.contact_points).reshape(-1, 3)
    corners = np.array(table.tetrahedron_vertices_a).reshape(-1, 4)
    weights = np.array(table.weights_a).reshape(-1, 4)
    np.testing.assert_allclose(
        np.einsum("ik,ikj->ij", weights, positions[corners]), points, atol=1e-12
    )
    assert sum(table.face_areas) == pytest.approx(0.06, rel=1e-9)
    names = dict(zip(table.geometries.id, table.geometries.name, strict=True))
    assert [names[i] for i in table.participating_ids] == ["sponge", "theirs"]
    start = list(table.participation_start)
    assert set(table.participating_vertices[start[0] : start[1]]) == set(corners.ravel().tolist())
    assert start[1] == start[2]
    below = np.flatnonzero(positions[:, 2] < 0.0)
    assert set(below.tolist()) <= set(table.participating_vertices[start[0] : start[1]])


def faults(client, diagnostics, source="sim"):
    """Return the faults of a source's configurations by now."""
    message = diagnostics_from_now(client, diagnostics)
    return diagnostics_values(message, f"source {source} configurations")


@pytest.mark.parametrize(
    ("fault", "change"),
    [
        ("not_finite", lambda q: {"sponge": np.where(np.arange(len(q))[:, None] == 3, np.nan, q)}),
        ("not_finite", lambda q: {"sponge": q + 1e12}),
        ("wrong_length", lambda q: {"sponge": q[:-1]}),
        ("wrong_source", lambda q: {"theirs": q[:8]}),
        ("unknown_geometry", lambda q: {"ghost": q}),
        ("unknown_geometry", lambda q: {"floor": q}),
    ],
)
def test_what_is_wrong_is_counted_and_changes_nothing(
    client, node, publisher, diagnostics, reference_positions, fault, change
):
    """The last good configuration holds, and what came with the bad one is taken."""
    good = squeezed(reference_positions, -0.015)
    send(client, publisher, good)
    before = int(faults(client, diagnostics)[fault])
    bad = change(reference_positions)
    message = configurations_to_msg(bad, stamp_ns=0, frame_id="")
    message.header.stamp = client.now()
    publisher.publish(message)
    wait_until(lambda: int(faults(client, diagnostics)[fault]) == before + 1, f"one more {fault}")

    def holds():
        answer = client.call("GetDeformableConfigurations", geometries=[reference("sponge")])
        return np.array_equal(np.reshape(answer.configurations.positions, (-1, 3)), good)

    # Faults are counted a moment before the good one is in a snapshot.
    wait_until(holds, "the last good configuration")
    assert node.is_alive()


def test_stale_and_malformed_messages_are_counted(
    client, node, publisher, diagnostics, reference_positions
):
    """An old stamp, lengths that contradict each other, another frame, stamps out of order."""
    before = faults(client, diagnostics)
    message = configurations_to_msg(
        {"sponge": reference_positions}, stamp_ns=10**9, frame_id="world"
    )  # fmt: skip
    publisher.publish(message)
    message.header.stamp = client.now()
    message.vertex_counts = [1]
    publisher.publish(message)
    send(client, publisher, reference_positions, frame_id="map")
    earlier = client.now()
    send(client, publisher, reference_positions)
    late = configurations_to_msg({"sponge": reference_positions}, stamp_ns=0, frame_id="world")
    late.header = Header(stamp=earlier, frame_id="world")
    publisher.publish(late)
    expected = {"stale": 1, "malformed": 1, "wrong_parent": 1, "out_of_order": 1}

    def counted():
        now = faults(client, diagnostics)
        return all(int(now[f]) == int(before[f]) + n for f, n in expected.items())

    wait_until(counted, "all four faults")


def test_registration_returns_the_mesh_and_the_topic(client, node):
    """A mesh of one's own and one made from a shape; both deform, and go when they are removed."""
    source = client.call("RegisterSource", name="late").source
    own = DeformableGeometryDescription(
        geometry=GeometryDescription(
            name="own", shape=Shape(kind=Shape.SPHERE, dimensions=[1.0]), pose=pose(y=9.0),
            roles=BOTH,
        ),
        reference_mesh=VolumeMesh(vertices=VERTICES, tetrahedra=[0, 1, 2, 3]),
    )  # fmt: skip
    made = DeformableGeometryDescription(
        geometry=GeometryDescription(
            name="made", shape=Shape(kind=Shape.SPHERE, dimensions=[0.1]), pose=pose(y=-9.0),
            roles=BOTH,
        ),
        resolution_hint=[0.1],
    )  # fmt: skip
    answer = client.call("RegisterDeformableGeometry", source=source, geometries=[own, made])
    assert answer.status.code == Status.OK, answer.status
    assert answer.configuration_topic == "/late/configurations"
    assert list(answer.reference_meshes[0].vertices) == VERTICES
    volume = volume_mesh_from_msg(answer.reference_meshes[1]).volumes().sum()
    assert 0.0 < volume < 4 / 3 * np.pi * 0.1**3
    publisher = client.publisher(DeformableConfigurations, answer.configuration_topic)
    moved = np.reshape(VERTICES, (-1, 3)) + np.array((0, 9, 0.5))
    markers = client.listen(MarkerArray, "markers/illustration")
    send(client, publisher, moved, name="own")
    message = markers.wait_for(
        lambda m: any(x.ns == "illustration/late/world" and x.points[0].z >= 0.5
                      for x in m.markers if x.points), "the moved one",
    )  # fmt: skip
    (marker,) = [m for m in message.markers if m.id == answer.geometry_ids[0]]
    assert len(marker.points) == 12
    removed = client.call(
        "RemoveGeometry", source=source, geometries=[reference("late/world/own")]
    )
    assert removed.status.code == Status.OK, removed.status
    markers.wait_for(
        lambda m: any(
            x.action == Marker.DELETE and x.id == answer.geometry_ids[0] for x in m.markers
        ),
        "its deletion",
    )
    client.forget(markers)


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"reference_mesh": VolumeMesh(vertices=VERTICES[:-1], tetrahedra=[0, 1, 2, 3])}, "11"),
        ({"reference_mesh": VolumeMesh(vertices=VERTICES, tetrahedra=[0, 2, 1, 3])}, "volume"),
        ({"reference_mesh": VolumeMesh(vertices=VERTICES, tetrahedra=[0, 1, 2])}, "4"),
        ({"resolution_hint": [-0.5]}, "-0.5"),
        ({}, "resolution_hint"),
    ],
)
def test_what_is_no_deformable_is_refused(client, node, fields, word):
    """Nothing is registered, and the status says why."""
    source = client.call("RegisterSource", name="wrong", token=77).source
    description = DeformableGeometryDescription(
        geometry=GeometryDescription(
            name="bad", shape=Shape(kind=Shape.SPHERE, dimensions=[0.1]), pose=pose()
        ),
        **fields,
    )
    answer = client.call("RegisterDeformableGeometry", source=source, geometries=[description])
    assert answer.status.code == Status.INVALID_ARGUMENT, answer.status
    assert word in answer.status.message
    assert "bad" not in [g.geometry.name for g in client.call("DescribeScene").geometries]


def test_the_node_survived_all_of_it(client, node):
    """After all this the node lives, and has no internal error on record."""
    assert node.is_alive()
    assert client.call("HasCollisions").status.code == Status.OK
    assert "Traceback" not in node.output()

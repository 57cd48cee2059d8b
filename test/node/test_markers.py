"""Markers and effects on demand: newcomers, deletions, only what moved, nothing unasked."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Pose, Quaternion, Transform, Vector3
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import MultiDOFJointState
from visualization_msgs.msg import Marker, MarkerArray

from scene_graph_msgs.msg import (
    ContactArray,
    FrameDescription,
    GeometryDescription,
    GeometryReference,
    RoleProperties,
    Shape,
)

VIEWER_QOS = QoSProfile(depth=100)
"""As a viewer subscribes: reliable and volatile, so that nothing is kept for latecomers."""

BOTH = (RoleProperties.PROXIMITY, RoleProperties.ILLUSTRATION)
SHAPES = {
    "ball": Shape(kind=Shape.SPHERE, dimensions=[0.1]),
    "pill": Shape(kind=Shape.CAPSULE, dimensions=[0.1, 0.3]),
    "box": Shape(kind=Shape.BOX, dimensions=[0.1, 0.2, 0.3]),
    "can": Shape(kind=Shape.CYLINDER, dimensions=[0.1, 0.3]),
    "egg": Shape(kind=Shape.ELLIPSOID, dimensions=[0.1, 0.2, 0.3]),
    "floor": Shape(kind=Shape.HALF_SPACE),
    "gem": Shape(kind=Shape.CONVEX, vertices=[0.0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]),
    "sheet": Shape(
        kind=Shape.MESH,
        vertices=[0.0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1],
        triangles=[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3],
    ),
}


def description(name, shape, x, roles=BOTH):
    """Return a geometry at x that has some roles."""
    pose = Pose(orientation=Quaternion(w=1.0))
    pose.position.x = float(x)
    if shape.kind == Shape.HALF_SPACE:
        pose.position.z = -100.0
    return GeometryDescription(
        name=name, shape=shape, pose=pose, roles=[RoleProperties(role=role) for role in roles]
    )


def ids(message, action=Marker.ADD):
    """Return the (ns, id) of a message's markers with an action."""
    return {(m.ns, m.id) for m in message.markers if m.action == action}


@pytest.fixture(scope="module")
def node(start_node):
    """A node with an empty scene and fast markers."""
    return start_node({"marker_rate": 100.0, "diagnostics_rate": 20.0})


@pytest.fixture(scope="module")
def diagnostics(client, node):
    """What the node says about itself."""
    return client.listen(DiagnosticArray, "/diagnostics")


@pytest.fixture
def effect(client, diagnostics):
    """Return the diagnostics of an effect, from a message made after the call."""

    def values(name):
        message = diagnostics_from_now(client, diagnostics)
        return diagnostics_values(message, f"effect: {name}")

    return values


@pytest.fixture(scope="module")
def empty_topics(client, node):
    """The topics before anything is in the scene."""
    wait_until(lambda: "/diagnostics" in client.topics(), "the node's topics")
    return client.topics()


@pytest.fixture(scope="module")
def scene(client, node, empty_topics):
    """Every shape once, on a frame of its own, far from each other."""
    source = client.call("RegisterSource", name="zoo").source
    frames = [FrameDescription(name=name, pose=_at(0.0)) for name in SHAPES]
    assert client.call("RegisterFrame", source=source, frames=frames).status.code == 0
    for i, (name, shape) in enumerate(SHAPES.items()):
        answer = client.call(
            "RegisterGeometry",
            source=source,
            frame=name,
            geometries=[description(name, shape, 10 * i)],
        )
        assert answer.status.code == 0, answer.status
    return source


def _at(x):
    pose = Pose(orientation=Quaternion(w=1.0))
    pose.position.x = x
    return pose


@pytest.fixture(scope="module")
def mover(client, scene):
    """Move frames of the zoo."""
    publisher = client.publisher(MultiDOFJointState, "/zoo/poses")

    def move(name, y):
        transform = Transform(translation=Vector3(y=y), rotation=Quaternion(w=1.0))
        message = MultiDOFJointState(joint_names=[name], transforms=[transform])
        message.header.stamp = client.now()
        publisher.publish(message)

    return move


def test_nothing_is_advertised_for_an_empty_scene(empty_topics, node):
    """Without geometry there are neither contacts nor markers to subscribe to."""
    ours = {topic for topic in empty_topics if topic.startswith("/scene_graph/")}
    assert not {t for t in ours if "markers" in t or "contacts" in t}
    # The log has it at level debug: most effects of most scenes are off.
    assert "is off" not in node.output()


def test_effects_come_with_the_first_geometry_that_asks(client, scene, node):
    """With both roles in the scene their topics appear; perception, not asked for, does not."""
    wanted = {
        f"/scene_graph/{name}"
        for name in ("contacts", "contact_markers", "markers/illustration", "markers/proximity")
    }
    wait_until(lambda: wanted <= client.topics(), "topics of the effects")
    assert "/scene_graph/markers/perception" not in client.topics()
    assert "effect point_contact is on: " in node.output()


def test_without_subscribers_no_work_is_done(scene, mover, effect, client):
    """Poses come in and the world is updated, but nobody listens: all counters stay at zero."""
    for i in range(20):
        mover("ball", 0.01 * i)
    wait_until(
        lambda: client.call("GetPoseInWorld", frames=["ball"]).poses[0].position.y == 0.19,
        "the last pose",
    )
    assert effect("point_contact")["computed"] == "0"
    for name in ("illustration", "proximity"):
        assert effect(name)["markers placed"] == "0"
        assert effect(name)["updates"] == "0"


def test_latecomers_with_default_qos_get_the_whole_scene(client, scene, mover):
    """Two viewers who come one after the other, volatile as viewers are, both see everything."""
    for attempt in range(2):
        mover("ball", 0.3 + attempt)
        viewer = client.listen(MarkerArray, "markers/illustration", VIEWER_QOS)
        whole = viewer.wait_for(lambda m: len(m.markers) == len(SHAPES), "all markers")
        assert {m.ns for m in whole.markers} == {f"illustration/zoo/{name}" for name in SHAPES}
        assert {m.header.frame_id for m in whole.markers} == {"world"}
        assert all(m.action == Marker.ADD for m in whole.markers)
        client.forget(viewer)


def test_a_transient_local_subscriber_gets_the_whole_scene(client, scene):
    """Also a reader that asks for the past ends up with all markers."""
    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    viewer = client.listen(MarkerArray, "markers/proximity", qos)
    viewer.wait_for(lambda m: len(m.markers) == len(SHAPES), "all markers")
    client.forget(viewer)


def test_after_the_whole_scene_only_what_moved_is_sent(client, scene, mover):
    """A move of one frame sends one marker; standing still sends nothing."""
    viewer = client.listen(MarkerArray, "markers/illustration", VIEWER_QOS)
    viewer.wait_for(lambda m: len(m.markers) == len(SHAPES), "all markers")
    before = viewer.count
    mover("can", 4.0)
    message = viewer.wait_for(lambda m: len(m.markers) == 1, "the one that moved")
    assert message.markers[0].ns == "illustration/zoo/can"
    assert message.markers[0].pose.position.y == 4.0
    # Contacts go on at the idle rate; markers of a world at rest don't.
    contacts = client.listen(ContactArray, "contacts")
    wait_until(lambda: contacts.count >= 5, "contacts of a world at rest")
    assert viewer.count == before + 1
    client.forget(contacts)
    client.forget(viewer)


def test_deleted_geometry_disappears_and_the_rest_stays(client, scene):
    """A removed geometry is deleted by its own (ns, id); nobody else is touched."""
    viewer = client.listen(MarkerArray, "markers/illustration", VIEWER_QOS)
    whole = viewer.wait_for(lambda m: len(m.markers) == len(SHAPES), "all markers")
    egg = next(key for key in ids(whole) if key[0].endswith("/egg"))
    answer = client.call(
        "RemoveGeometry", source=scene, geometries=[GeometryReference(name="egg")]
    )
    assert answer.status.code == 0, answer.status
    message = viewer.wait_for(lambda m: ids(m, Marker.DELETE), "a deletion")
    assert ids(message, Marker.DELETE) == {egg}
    assert all(m.action != Marker.DELETEALL for got in viewer.kept() for m in got.markers)
    client.forget(viewer)
    again = client.listen(MarkerArray, "markers/illustration", VIEWER_QOS)
    whole = again.wait_for(lambda m: len(m.markers) == len(SHAPES) - 1, "the others")
    assert egg not in ids(whole)
    client.forget(again)


def test_a_lost_role_deletes_the_marker_of_that_role_only(client, scene):
    """Without the illustration role the box is gone there, and stays among what collides."""
    shown = client.listen(MarkerArray, "markers/illustration", VIEWER_QOS)
    shown.wait_for(lambda m: len(m.markers) >= 7, "all markers")
    collides = client.listen(MarkerArray, "markers/proximity", VIEWER_QOS)
    collides.wait_for(lambda m: len(m.markers) >= 7, "all markers")
    client.call(
        "RemoveRole",
        source=scene,
        geometries=[GeometryReference(name="box")],
        role=RoleProperties.ILLUSTRATION,
    )
    message = shown.wait_for(lambda m: ids(m, Marker.DELETE), "a deletion")
    assert {ns for ns, _ in ids(message, Marker.DELETE)} == {"illustration/zoo/box"}
    deleted = {ns for m in collides.kept() for ns, _ in ids(m, Marker.DELETE)}
    assert "proximity/zoo/box" not in deleted
    client.forget(shown)
    client.forget(collides)


def test_contact_markers_come_and_go_with_contacts(client, scene, mover):
    """Balls and normals are shown while things touch, and deleted when they don't."""
    viewer = client.listen(MarkerArray, "contact_markers", VIEWER_QOS)
    answer = client.call(
        "RegisterAnchoredGeometry",
        source=scene,
        geometries=[description("wall", SHAPES["ball"], 0.15, (RoleProperties.PROXIMITY,))],
    )
    assert answer.status.code == 0, answer.status
    mover("ball", 0.0)
    shown = viewer.wait_for(
        lambda m: any(len(marker.points) >= 2 for marker in m.markers), "contact markers"
    )
    assert {marker.ns for marker in shown.markers} == {"contacts"}
    mover("ball", 5.0)
    viewer.wait_for_newest(
        lambda m: all(marker.action == Marker.DELETE for marker in m.markers), "deletions"
    )
    client.forget(viewer)


def test_effects_end_when_nothing_asks_any_more(client, scene, node):
    """When the source goes, its markers are deleted, then the topics."""
    viewer = client.listen(MarkerArray, "markers/illustration", VIEWER_QOS)
    # All but the egg, which was removed, and the box, which has lost the role.
    whole = viewer.wait_for(lambda m: len(ids(m)) == len(SHAPES) - 2, "all markers")
    assert client.call("RemoveSource", source=scene).status.code == 0
    message = viewer.wait_for(lambda m: ids(m, Marker.DELETE), "deletions")
    assert ids(message, Marker.DELETE) == ids(whole)
    client.forget(viewer)
    wait_until(lambda: "/scene_graph/contacts" not in client.topics(), "the end of the topics")
    effects = {e.name: e for e in client.call("ListEffects").effects}
    assert not effects["illustration"].is_on
    assert "a geometry with the illustration role would" in effects["illustration"].reason
    assert node.is_alive()
    assert "Traceback" not in node.output()

"""What Foxglove and Lichtblick are offered on the port of the page: the node's own topics."""

from __future__ import annotations

import contextlib
import re
import time

from diagnostic_msgs.msg import DiagnosticArray
from foxglove_client import FoxgloveClient
from geometry_msgs.msg import Transform, Vector3
from node_harness import diagnostics_values, wait_until
import numpy as np
from pictured_files import board, png, write_obj
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import MultiDOFJointState

from scene_graph_msgs.msg import ContactArray

pytest.importorskip("rosbags", reason="reads messages by their definitions: pip install rosbags")

SCENE = """
version: 1
sources: [{name: cell}, {name: arm}]
frames: [{name: hand, source: arm}]
geometries:
  - {name: wall, source: cell, pose: {xyz: [0, 0, 3]}, shape: {type: box, size: [9, 9, 1]},
     color: [1, 0, 0], roles: {illustration: {}, perception: {}}}
  - {name: floor, source: cell, pose: {xyz: [0, 0, -0.5]}, shape: {type: box, size: [9, 9, 1]},
     roles: {proximity: {}}}
  - {name: ball, source: arm, frame: hand, shape: {type: sphere, radius: 0.25},
     roles: {illustration: {}, proximity: {}}}
cameras:
  - {name: eye, source: cell, size: [16, 12], pose: {xyz: [0, 0, 1]}, clipping: [0.01, 10],
     intrinsics: {fx: 16, fy: 16, cx: 8, cy: 6}, depth_range: [0.1, 10], images: [color]}
"""

ILLUSTRATION = "/scene_graph/markers/illustration"
PERCEPTION = "/scene_graph/markers/perception"
PROXIMITY = "/scene_graph/markers/proximity"
CONTACTS = "/scene_graph/contacts"
IMAGE = "/scene_graph/cameras/eye/color/image"


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with a view on a port that is free."""
    path = tmp_path_factory.mktemp("scene") / "scene.yaml"
    cup = "{name: cup, source: cell, shape: {type: mesh, file: cup.obj}, roles: {perception: {}}}"
    path.write_text(SCENE.replace("cameras:", f"  - {cup}\ncameras:"))
    (path.parent / "board.png").write_bytes(png(board()))
    write_obj(path.parent, [(None, "board.png")], "cup")
    return start_node(
        {"scene": path, "browser": True, "browser_port": 0, "diagnostics_rate": 20.0}
    )


@pytest.fixture
def foxglove(node):
    """A client that has subscribed to nothing."""
    node.wait_for_output("browser view at ")
    client = FoxgloveClient(re.search(r"browser view at (http\S+)", node.output())[1])
    yield client
    client.close()


@pytest.fixture
def move(client):
    """Move the hand."""
    publisher = client.publisher(MultiDOFJointState, "/arm/poses")
    wait_until(publisher.get_subscription_count, "the node")

    def to(x, y, z):
        message = MultiDOFJointState(joint_names=["hand"])
        message.header.stamp = client.now()
        transform = Transform(translation=Vector3(x=x, y=y, z=z))
        transform.rotation.w = 1.0
        message.transforms = [transform]
        publisher.publish(message)
        return message.header.stamp

    return to


def test_all_topics_of_the_node_are_offered_with_their_definitions(foxglove):
    """Markers, contacts, cameras, diagnostics; nothing can be published."""
    offered = {
        ILLUSTRATION: "visualization_msgs/msg/MarkerArray",
        PROXIMITY: "visualization_msgs/msg/MarkerArray",
        CONTACTS: "scene_graph_msgs/msg/ContactArray",
        "/scene_graph/contact_markers": "visualization_msgs/msg/MarkerArray",
        IMAGE: "sensor_msgs/msg/Image",
        "/scene_graph/cameras/eye/color/camera_info": "sensor_msgs/msg/CameraInfo",
        "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    }
    for topic, kind in offered.items():
        channel = foxglove.take_until(lambda topic=topic: foxglove.channel(topic))
        assert channel["schemaName"] == kind
    assert foxglove.info["capabilities"] == ["assets"]
    assert foxglove.info["name"] == "/scene_graph"


def test_markers_are_whole_at_first_and_then_what_moved(foxglove, move):
    """A client that comes late sees the whole scene, another one what changes."""
    foxglove.subscribe(ILLUSTRATION, 1)
    whole = foxglove.take_message(1, lambda m: len(m.markers) == 2, ILLUSTRATION)
    assert {marker.type for marker in whole.markers} == {1, 2}  # CUBE, SPHERE
    move(1.0, 2.0, 3.0)

    def position(message):
        points = [marker.pose.position for marker in message.markers if marker.type == 2]
        return [[p.x, p.y, p.z] for p in points]

    moved = foxglove.take_message(1, lambda m: position(m) == [[1.0, 2.0, 3.0]], ILLUSTRATION)
    assert len(moved.markers) == 1


def test_a_mesh_is_fetched_by_the_address_in_its_marker(foxglove):
    """With what its file names, beside it; and nothing else, wherever it is."""
    foxglove.subscribe(PERCEPTION, 3)
    whole = foxglove.take_message(3, lambda m: len(m.markers) == 2, PERCEPTION)
    (address,) = [marker.mesh_resource for marker in whole.markers if marker.mesh_resource]
    assert address.startswith("file:///")
    assert b"mtllib cup.mtl" in foxglove.fetch(1, address)
    assert b"map_Kd board.png" in foxglove.fetch(2, address.replace("cup.obj", "cup.mtl"))
    assert foxglove.fetch(3, address.replace("cup.obj", "board.png")) == png(board())
    for number, name in ((4, "scene.yaml"), (5, "none.obj")):
        refused = foxglove.fetch(number, address.replace("cup.obj", name))
        assert refused.startswith("no mesh of the scene is of ")


def test_contacts_have_the_stamp_of_the_poses(foxglove, move):
    """The ball, radius 0.25, is 0.125 m in the floor."""
    foxglove.subscribe(CONTACTS, 4)
    stamp = move(0.0, 0.0, 0.125)
    message = foxglove.take_message(4, lambda m: len(m.points) == 1, CONTACTS)
    assert message.points[0].depth == pytest.approx(0.125, abs=1e-12)
    at = message.header.stamp
    assert (at.sec, at.nanosec) == (stamp.sec, stamp.nanosec)
    move(0.0, 0.0, 3.0)
    foxglove.take_message(4, lambda m: len(m.points) == 0, CONTACTS)


def test_images_are_rendered_for_whoever_subscribes(foxglove):
    """The camera looks at the red wall."""
    foxglove.subscribe(IMAGE, 9)
    image = foxglove.take_message(9, lambda m: True, IMAGE)
    assert (image.width, image.height, image.encoding) == (16, 12, "rgb8")
    pixels = np.asarray(image.data).reshape(12, 16, 3)
    assert pixels[6, 8, 0] > 2 * pixels[6, 8, 1]


def test_without_subscriptions_nothing_is_computed(foxglove, client, node):
    """A client that only looks at what there is costs no contacts, markers or images."""
    foxglove.take_until(lambda: foxglove.channel(IMAGE))
    listener = client.listen(DiagnosticArray, "/diagnostics")

    def counted():
        before = listener.count
        wait_until(lambda: listener.count >= before + 2, "diagnostics")
        message = listener.newest
        return [
            diagnostics_values(message, f"effect: {name}")[key]
            for name, key in (
                ("point_contact", "contact messages"),
                ("proximity", "messages"),
                ("illustration", "messages"),
                ("camera eye", "frames"),
            )
        ]

    # What earlier clients asked for may be on its way.
    wait_until(lambda: counted() == counted(), "quiet")
    before = counted()
    assert counted() == before
    assert diagnostics_values(listener.newest, "effect: browser")["Foxglove clients"] == "1"
    client.forget(listener)


def test_diagnostics_come_without_another_listener(foxglove):
    """As they go to `/diagnostics`."""
    foxglove.subscribe("/diagnostics", 3)
    message = foxglove.take_message(3, lambda m: True, "/diagnostics")
    assert any(status.name.endswith("scene_graph: world") for status in message.status)


def test_a_storm_of_subscriptions_asks_for_few_updates(start_node, client, tmp_path):
    """Without poses there are contacts ten times a second, and at most ten more for clients."""
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    node = start_node(
        {"scene": path, "browser": True, "browser_port": 0, "min_update_rate": 0.01},
        remaps=["__node:=stormy"],
    )
    node.wait_for_output("browser view at ")
    address = re.search(r"browser view at (http\S+)", node.output())[1]
    contacts = client.listen(ContactArray, "/stormy/contacts")
    foxglove = FoxgloveClient(address)
    topic = "/stormy/contacts"
    foxglove.subscribe(topic, 1)
    foxglove.take_message(1, lambda m: True, topic)
    begin, before = time.monotonic(), contacts.count
    for number in range(2, 200):
        channel = foxglove.channel(topic)["id"]
        foxglove.say("unsubscribe", subscriptionIds=[number - 1])
        foxglove.messages[number] = []
        foxglove.say("subscribe", subscriptions=[{"id": number, "channelId": channel}])
    # All of it was read when this is answered.
    foxglove.take_until(lambda: foxglove.messages[199])
    # One in 0.1 s, the first one and the one made good.
    assert contacts.count - before <= (time.monotonic() - begin) / 0.1 + 2
    client.forget(contacts)
    foxglove.close()
    assert node.stop() == 0


def test_simulated_time_is_the_time_of_messages(start_node, client, tmp_path):
    """Clients are told that there is one, and it by itself."""
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    node = start_node(
        {"scene": path, "browser": True, "browser_port": 0, "use_sim_time": True},
        remaps=["__node:=simulated"],
    )
    node.wait_for_output("browser view at ")
    clock = client.publisher(Clock, "/clock")
    wait_until(clock.get_subscription_count, "the node")
    now = Clock()
    now.clock.sec = 12
    foxglove = FoxgloveClient(re.search(r"browser view at (http\S+)", node.output())[1])

    def is_told():
        # Again and again: a reader that was matched here need not have matched there by then.
        clock.publish(now)
        with contextlib.suppress(TimeoutError):
            foxglove.take(timeout=0.1)
        return 12 * 10**9 in foxglove.times

    wait_until(is_told, "the simulated time")
    assert foxglove.info["capabilities"] == ["time", "assets"]
    topic = "/simulated/markers/illustration"
    foxglove.subscribe(topic, 1)
    foxglove.take_until(lambda: foxglove.messages[1])
    assert foxglove.messages[1][0][0] == 12 * 10**9
    foxglove.close()
    assert node.stop() == 0

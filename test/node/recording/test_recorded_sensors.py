"""Heights, images of depth and clouds over DDS: contacts and markers follow, and replays agree."""

from time import sleep

from cloud_messages import cloud_message
from diagnostic_msgs.msg import DiagnosticArray
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
import numpy as np
import pytest
from recordings import counted, replay
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from scene_graph_msgs.msg import ContactArray

SCENE = """
version: 1
sources:
  - {name: map}
  - {name: balls}
  - {name: eye, depth: {image: eye/depth, frame: world, pose: {xyz: [5, 0, 2],
     rpy: [3.141592653589793, 0, 0]}}}
  - {name: mast, points: {fills: eye, frame: world, pose: {xyz: [5, 0, 2]}, remember: true}}
  - {name: top, depth: {image: top/depth, into: voxel_grid, frame: world,
     pose: {xyz: [-5, 0, 2], rpy: [3.141592653589793, 0, 0]}}}
frames: [{name: hand, source: balls}]
geometries:
  - {name: ground, source: map, roles: {proximity: {}, illustration: {}},
     shape: {type: height_field, size: [2, 2], floor: -1, heights: [[-0.5, -0.5], [-0.5, -0.5]]}}
  - {name: ball, source: balls, frame: hand, pose: {xyz: [0, 0, 0.5]},
     shape: {type: sphere, radius: 0.25}, roles: {proximity: {}}}
  - {name: far, source: balls, frame: hand, pose: {xyz: [5, 0, 0.5]},
     shape: {type: sphere, radius: 0.25}, roles: {proximity: {}}}
  - {name: third, source: balls, frame: hand, pose: {xyz: [-5, 0, 0.5]},
     shape: {type: sphere, radius: 0.25}, roles: {proximity: {}}}
  - {name: space, source: top, pose: {xyz: [-5.5, -0.5, 0]}, roles: {proximity: {}},
     shape: {type: voxel_grid, voxel: 0.25, counts: [4, 4, 4], runs: [[0, 64]]}}
  - {name: seen, source: eye, roles: {proximity: {}}, shape: {type: point_cloud, radius: 0.0625}}
"""


def height_message(height, **fields):
    """Return a message of four equal heights."""
    message = Image(height=2, width=2, encoding="32FC1", step=8)
    message.data = np.full(4, height, "<f4").tobytes()
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def depths(message, *names):
    """Return the depths of a pair's contacts."""
    return [
        point.depth
        for point in message.points
        if {point.geometry_a.name, point.geometry_b.name} == set(names)
    ]


def test_what_sensors_send_is_felt_drawn_and_replayed(start_node, client, domain, tmp_path):
    """Ground that rises into a ball; a pixel's point in another one, cleared by a ray; a voxel."""
    folder = tmp_path / "bag"
    (tmp_path / "scene.yaml").write_text(SCENE)
    node = start_node({"scene": tmp_path / "scene.yaml", "record": folder})
    contacts = client.listen(ContactArray, "contacts")
    markers = client.listen(MarkerArray, "markers/illustration")
    heights = client.publisher(Image, "/map/heights")
    info = client.publisher(CameraInfo, "/eye/camera_info")
    images = client.publisher(Image, "/eye/depth")
    clouds = client.publisher(PointCloud2, "/mast/points")

    def send(publisher, message, told, what):
        """Publish, ten times a second, until the newest contacts say it."""

        def is_said():
            message.header.stamp = client.now()
            publisher.publish(message)
            sleep(0.1)
            return contacts.newest is not None and told(contacts.newest)

        wait_until(is_said, what)

    send(heights, height_message(0.375), lambda m: depths(m, "ground", "ball"), "a contact")
    deepest = contacts.wait_for(lambda m: depths(m, "ground", "ball"), "a contact")
    # The ball's lowest point is at 0.25, and the way out is up.
    assert max(depths(deepest, "ground", "ball")) == pytest.approx(0.125, abs=1e-9)
    drawn = markers.wait_for(
        lambda m: any(p.z == 0.375 for x in m.markers for p in x.points), "the risen ground"
    )
    assert {x.type for x in drawn.markers if x.points} == {Marker.TRIANGLE_LIST}

    lens = CameraInfo(height=1, width=1, k=[9.0, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 1.0])
    info.publish(lens)
    client.publisher(CameraInfo, "/top/camera_info").publish(lens)
    image = Image(height=1, width=1, encoding="32FC1", step=4)
    image.data = np.array([1.375], "<f4").tobytes()
    send(images, image, lambda m: depths(m, "seen", "far"), "the pixel's point in the ball")
    above = client.publisher(Image, "/top/depth")
    send(above, image, lambda m: depths(m, "space", "third"), "the pixel's voxel in the third")
    beyond = cloud_message([[0.0, 0.0, -4.0]])
    send(clouds, beyond, lambda m: not depths(m, "seen", "far"), "a ray through that point")

    client.forget(contacts)
    client.forget(markers)
    assert node.stop() == 0
    code, said = replay(domain, folder, "--check")
    assert code == 0, said
    inputs, _, _, equal, late, different = counted(said)
    assert inputs >= 4, said
    assert different == 0, said
    assert equal >= late + 3, said


def test_bad_heights_are_counted_and_change_nothing(start_node, client, tmp_path):
    """Of another size, not a number, below the floor, from the future; the ground stays."""
    (tmp_path / "scene.yaml").write_text(SCENE)
    node = start_node({"scene": tmp_path / "scene.yaml", "diagnostics_rate": 20.0})
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    heights = client.publisher(Image, "/map/heights")

    def values():
        return diagnostics_values(diagnostics_from_now(client, diagnostics), "source map heights")

    wait_until(lambda: values()["topic"] == "/map/heights", "the topic")
    for fault, message, ahead in (
        ("wrong_length", height_message(0.0, width=1), 0),
        ("not_finite", height_message(np.nan), 0),
        ("not_finite", height_message(-1.5), 0),
        ("malformed", height_message(0.0, encoding="rgb8"), 0),
        ("future", height_message(0.0), 100),
    ):
        before = int(values()[fault])
        message.header.stamp = client.now()
        message.header.stamp.sec += ahead
        heights.publish(message)
        wait_until(lambda f=fault, b=before: int(values()[f]) > b, f"one more {fault}")
    pair = {"geometries_a": ["ground"], "geometries_b": ["ball"]}
    (found,) = client.call("ComputeSignedDistancePair", **pair).pairs
    assert found.distance == pytest.approx(0.75, abs=1e-9)
    client.forget(diagnostics)
    assert node.stop() == 0
    assert "Traceback" not in node.output()

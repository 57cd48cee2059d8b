"""Maps over DDS: contacts, markers, answers and diagnostics follow, and replays agree."""

from time import sleep

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import OccupancyGrid
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
import numpy as np
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from recordings import counted, replay
from visualization_msgs.msg import MarkerArray
from workspace_messages import message_class, WORKSPACE_VARIABLES

from msg_adapters.voxel_maps import octomap_data
from scene_graph_msgs.msg import ContactArray
from scene_graph_ros.geometry import VoxelGrid

# A ball of 0.25 m at (0.625, 0.625, 0.625), and a grid of 8 x 8 x 4 voxels of 0.25 m from the
# origin on, of which nothing is known to begin with; what is unknown counts as free.
SCENE = """
version: 1
sources:
  - {name: mapper, voxels: {topic: map, type: KIND}}
  - {name: balls}
frames: [{name: hand, source: balls}]
geometries:
  - {name: space, source: mapper, roles: {proximity: {}, illustration: {}},
     shape: {type: voxel_grid, voxel: 0.25, counts: [8, 8, 4], runs: [[2, 256]],
             unknown_is_free: true}}
  - {name: ball, source: balls, frame: hand, pose: {xyz: [0.625, 0.625, 0.625]},
     shape: {type: sphere, radius: 0.25}, roles: {proximity: {}}}
"""
OF_FLAT_MAPS = (
    SCENE.replace("KIND", "nav_msgs/msg/OccupancyGrid").replace(
        "  - {name: balls}",
        "  - {name: balls}\n  - {name: other, voxels: {type: octomap_msgs/msg/Octomap}}",
    )
    + """
  - {name: unread, source: other, pose: {xyz: [9, 9, 9]},
     shape: {type: voxel_grid, voxel: 0.25, counts: [1, 1, 1], runs: [[0, 1]]}}
"""
)
OF_OCTREES = SCENE.replace("topic: map, type: KIND", "topic: tree, type: octomap_msgs/msg/Octomap")


def occupancy_grid(cells, frame="world"):
    """Return a map of cells ``(rows, cols)`` of 0.25 m from the origin on."""
    message = OccupancyGrid(data=np.asarray(cells).reshape(-1).tolist())
    message.header.frame_id = frame
    message.info.height, message.info.width = np.shape(cells)
    message.info.resolution = 0.25
    message.info.origin.orientation.w = 1.0
    return message


def octomap(states, **fields):
    """Return a map of states ``(nx, ny, nz)`` of 0.25 m from the origin on."""
    kind = message_class("octomap_msgs", "Octomap")
    data = octomap_data(VoxelGrid(states, 0.25), np.eye(4))
    message = kind(id="OcTree", binary=True, resolution=0.25, data=data)
    message.header.frame_id = "world"
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def depths(message):
    """Return the depths of contacts of the ball and the grid."""
    return [
        point.depth
        for point in message.points
        if {point.geometry_a.name, point.geometry_b.name} == {"space", "ball"}
    ]


def send(client, publisher, contacts, message, told, what):
    """Publish, ten times a second, until the newest contacts say it."""

    def is_said():
        message.header.stamp = client.now()
        publisher.publish(message)
        sleep(0.1)
        return contacts.newest is not None and told(depths(contacts.newest))

    wait_until(is_said, what)


def is_named(message):
    """Tell whether a missing package is an error of its source."""
    return any(
        status.name.endswith("source other voxels")
        and status.level == DiagnosticStatus.ERROR
        and "octomap_msgs is not installed" in status.message
        for status in message.status
    )


def test_flat_maps_are_felt_drawn_and_replayed(start_node, client, domain, tmp_path):
    """A wall into which the ball reaches, and none; the recording has both.

    Another source's messages are of a package that is not installed, which is named.
    """
    folder = tmp_path / "bag"
    (tmp_path / "scene.yaml").write_text(OF_FLAT_MAPS)
    node = start_node({"scene": tmp_path / "scene.yaml", "record": folder})
    contacts = client.listen(ContactArray, "contacts")
    markers = client.listen(MarkerArray, "markers/illustration")
    maps = client.publisher(OccupancyGrid, "/map")
    wall = np.zeros((8, 8), int)
    wall[:, 3] = 100  # from x = 0.75 on
    send(client, maps, contacts, occupancy_grid(wall), bool, "a contact")
    deepest = contacts.wait_for(depths, "a contact")
    assert max(depths(deepest)) == pytest.approx(0.125, abs=1e-9)
    markers.wait_for(
        lambda m: any(p.x in (0.75, 0.875) for x in m.markers for p in x.points), "the wall"
    )
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    diagnostics.wait_for(is_named, "the missing package")
    client.forget(diagnostics)
    free = occupancy_grid(0 * wall)
    send(client, maps, contacts, free, lambda found: not found, "no contact")
    client.forget(contacts)
    client.forget(markers)
    assert node.stop() == 0
    code, said = replay(domain, folder, "--check")
    assert code == 0, said
    inputs, _, _, equal, late, different = counted(said)
    assert inputs >= 2, said
    assert different == 0, said
    assert equal >= late + 2, said


def test_octrees_are_felt_and_bad_ones_counted(start_node, client, tmp_path):
    """Also a map that was sent once, before the node began, which never gets stale."""
    kind = message_class("octomap_msgs", "Octomap")
    (tmp_path / "scene.yaml").write_text(OF_OCTREES)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    maps = client.node.create_publisher(kind, "/tree", latched)
    states = np.full((8, 8, 4), 2)
    states[:3], states[3] = 0, 1
    message = octomap(states)
    message.header.stamp = client.now()
    message.header.stamp.sec -= 60
    maps.publish(message)
    node = start_node(
        {"scene": tmp_path / "scene.yaml", "diagnostics_rate": 20.0, "max_pose_age": 3.0},
        extra_environment=WORKSPACE_VARIABLES,
    )
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    pair = {"geometries_a": ["space"], "geometries_b": ["ball"]}

    def values():
        message = diagnostics_from_now(client, diagnostics)
        return diagnostics_values(message, "source mapper voxels")

    def distance():
        found = client.call("ComputeSignedDistancePair", **pair).pairs
        return found[0].distance if found else None

    wait_until(lambda: distance() == pytest.approx(-0.125, abs=1e-9), "the latched wall")
    told = values()
    assert told["topic"] == "/tree"
    assert told["occupied voxels"] == "32"
    assert told["unknown voxels"] == "128"
    for fault, bad, ahead in (
        ("malformed", octomap(states, data=[1, 2, 3]), 0),
        ("malformed", octomap(states, id="Stairs"), 0),
        ("unknown_frame", octomap(states, header=OccupancyGrid().header), 0),
        ("future", octomap(states), 100),
    ):
        before = int(values()[fault])
        bad.header.stamp = client.now()
        bad.header.stamp.sec += ahead
        maps.publish(bad)
        wait_until(lambda f=fault, b=before: int(values()[f]) > b, f"one more {fault}")
    assert distance() == pytest.approx(-0.125, abs=1e-9)
    client.forget(diagnostics)
    client.node.destroy_publisher(maps)
    assert node.stop() == 0
    assert "Traceback" not in node.output()

"""A voxel grid that the node's own camera fills, over DDS: free is what its images see through.

The ball of 0.1 m slides along x. A camera 2 m above it looks down, at a wall below the rail and at
a thing on a post in the ball's way; collisions are told of neither. All space is unknown first.
"""

from diagnostic_msgs.msg import DiagnosticArray
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
from plan_goals import at, Planner, post_publisher, rail_publisher, Sent
import pytest
from robot_scenes import SLIDE
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from scene_graph_msgs.msg import PlanHolds, Status
from scene_graph_msgs.srv import CheckConfigurations
from scene_graph_ros.node.runtime.qos import image_qos, latched_qos

FREE, COLLIDES = CheckConfigurations.Response.FREE, CheckConfigurations.Response.COLLIDES

SCENE = """
version: 1
sources:
  - {name: around}
  - {name: eye, depth: {image: ~/cameras/eye/depth/image, into: voxel_grid, remove: [slide]}}
robots:
  - {name: slide, urdf: %s, positions: {rail: -1}, collision: true}
frames: [{name: post, source: around, pose: {xyz: [0.5, 0, 0]}}]
geometries:
  - {name: wall, source: around, pose: {xyz: [0, 0, -0.6]}, shape: {type: box, size: [6, 6, 0.1]},
     roles: &seen_only {perception: {}}}
  - {name: thing, source: around, frame: post, shape: {type: sphere, radius: 0.15},
     roles: *seen_only}
  - name: space
    source: eye
    pose: {xyz: [-2, -0.5, -0.3]}
    shape: {type: voxel_grid, voxel: 0.05, counts: [80, 20, 12], runs: [[2, 19200]]}
    roles: {proximity: {}, illustration: {}}
cameras:
  - {name: eye, source: eye, pose: {xyz: [0, 0, 2], rpy: [3.141592653589793, 0, 0]},
     size: [120, 120], fov_y: 1.0, images: [depth], rate: 10}
"""


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with the ball, the camera and the grid."""
    folder = tmp_path_factory.mktemp("voxels")
    (folder / "slide.urdf").write_text(SLIDE)
    (folder / "scene.yaml").write_text(SCENE % (folder / "slide.urdf"))
    options = {"plan_from_unreported": True, "diagnostics_rate": 10.0}
    return start_node({"scene": folder / "scene.yaml", **options})


@pytest.fixture(scope="module")
def put(client, node):
    """Return a function that says where the ball and the thing are, ever again."""
    rail, post = rail_publisher(client), post_publisher(client)

    def tell(x):
        rail(-0.6)
        post(x)

    return tell


def outcomes(client, *rails):
    """Return the outcomes of the ball's places on its rail."""
    answer = client.call("CheckConfigurations", configurations=at(*rails))
    return list(answer.outcomes) if answer.status.code == Status.OK else answer.status.message


def test_images_free_what_they_see_through_and_clear_what_went_away(client, node, put):
    """Free, hit, unknown out of view; then the thing moves, and its old place is seen through."""
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    viewer = client.listen(MarkerArray, "markers/illustration", latched_qos())
    places = -0.5, 0.0, 0.5, -1.6

    def is_seen(x, *expected):
        put(x)
        return outcomes(client, *places) == list(expected)

    wait_until(lambda: is_seen(0.5, FREE, FREE, COLLIDES, COLLIDES), "free and occupied space")
    wait_until(lambda: is_seen(0.0, FREE, COLLIDES, FREE, COLLIDES), "the thing's new place")
    said = diagnostics_values(diagnostics_from_now(client, diagnostics), "source eye depth images")
    assert int(said["occupied voxels"]) > 10
    assert int(said["free voxels"]) > 1000
    assert int(said["unknown voxels"]) > 1000
    viewer.wait_for(
        lambda message: any(
            m.ns == "illustration/eye/world" and m.type == Marker.TRIANGLE_LIST and m.points
            for m in message.markers
        ),
        "the surface of what is not free",
    )


def test_a_proof_is_stamped_by_the_image_that_it_includes(client, node, put):
    """By a later one each time, while the ball's joint states are stamped later still."""
    sensed = client.listen(PointCloud2, "sensed/eye", image_qos())

    def is_free():
        put(0.9)
        return outcomes(client, -0.5, 0.0, 0.3) == [FREE] * 3

    wait_until(is_free, "free space between start and goal")
    planner = Planner(client)
    result, _ = Sent(planner, start=at(-0.5), goals=at(0.3)).end()
    assert (result.status.code, result.failure) == (Status.OK, 0), result.status.message
    holds = client.listen(PlanHolds, "plan_holds")

    def proven():
        put(0.9)
        images = {(s.header.stamp.sec, s.header.stamp.nanosec) for s in sensed.kept()}
        proofs = [m for m in holds.kept() if m.holds]
        stamps = {(m.header.stamp.sec, m.header.stamp.nanosec) for m in proofs}
        return len(stamps & images) >= 3

    wait_until(proven, "proofs for three images")
    planner.destroy()

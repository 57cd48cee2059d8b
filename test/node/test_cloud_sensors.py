"""Two sensors, one on a robot, over DDS: one cloud without the robot, which rays clear.

The ball of 0.1 m on its rail along x is that of `sliding_robots`. The lidar is on the ball, the
mast stands at (1, 0, 2), and a depth camera beside it fills the same cloud.
"""

from time import sleep

from cloud_messages import cloud_message
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from node_harness import diagnostics_from_now, diagnostics_values, wait_until
import numpy as np
from plan_goals import at
import pytest
from sensor_msgs.msg import CameraInfo, Image, JointState, PointCloud2
from sliding_robots import rail_scene

from scene_graph_msgs.msg import Status
from scene_graph_msgs.srv import CheckConfigurations

FREE, COLLIDES = CheckConfigurations.Response.FREE, CheckConfigurations.Response.COLLIDES

RADIUS = 0.0625
CLOUD = f"""
  - {{name: seen, source: lidar, shape: {{type: point_cloud, radius: {RADIUS}}},
     roles: {{proximity: {{}}, illustration: {{}}}}}}
"""
SENSORS = """[{name: around},
  {name: lidar, points: {remember: true, frame: slide/ball, floor: -0.5, expires: 60}},
  {name: mast, points: {fills: lidar, frame: around/post, remember: true}},
  {name: eye, depth: {fills: lidar, image: eye/depth, frame: around/post, pose: {xyz: [0, 0, 0],
    rpy: [3.141592653589793, 0, 0]}}}]"""


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with the ball on a rail and its sensors; clouds of 1000 points at most."""
    scene = rail_scene(tmp_path_factory.mktemp("rails"), more=CLOUD)
    text = scene.read_text().replace("[{name: around}]", SENSORS)
    scene.write_text(text.replace("xyz: [1, 0, 0]", "xyz: [1, 0, 2]"))
    options = {"plan_from_unreported": True, "max_points_per_cloud": 1000, "max_pose_age": 3.0}
    return start_node({"scene": scene, "diagnostics_rate": 20.0, **options})


@pytest.fixture(scope="module")
def told(client, node):
    """Return a function that tells where the ball is: a moment is remembered per update."""
    joints = client.publisher(JointState, "/joint_states")

    def tell(rail):
        state = JointState(name=["rail"], position=[rail])
        state.header.stamp = client.now()
        joints.publish(state)
        sleep(0.1)

    return tell


@pytest.fixture(scope="module")
def look(client, node, told):
    """Return a function that publishes what a sensor sees where the ball is now."""
    publishers = {
        name: client.publisher(PointCloud2, f"/{name}/points") for name in ("lidar", "mast")
    }

    def send(by, points, rail=-1.0, **fields):
        message = cloud_message(points, "a frame that the scene has not")
        for name, value in fields.items():
            setattr(message, name, value)
        told(rail)
        message.header.stamp = client.now()
        publishers[by].publish(message)
        told(rail)
        return message.header.stamp

    return send


@pytest.fixture(scope="module")
def sensed(client, node):
    """What the lidar saw, without the robot, for others."""
    listener = client.listen(PointCloud2, "sensed/lidar")
    yield listener
    client.forget(listener)


@pytest.fixture(scope="module")
def diagnostics(client, node):
    """What the node says about itself."""
    listener = client.listen(DiagnosticArray, "/diagnostics")
    yield listener
    client.forget(listener)


def outcomes(client, *rails):
    """Return the outcomes of the ball's places on its rail."""
    answer = client.call("CheckConfigurations", configurations=at(*rails))
    assert answer.status.code == Status.OK, answer.status
    return list(answer.outcomes)


def wait_for(client, send, expected, *rails):
    """Have a sensor send the same until the ball's places have these outcomes."""

    def is_there():
        send()
        return outcomes(client, *rails) == expected

    wait_until(is_there, f"outcomes {expected} at {rails}")


def points_of(message):
    """Return the points ``(n, 3)`` of a published cloud."""
    return np.frombuffer(bytes(message.data), "<f4").reshape(-1, 4)[:, :3]


def faults(client, diagnostics, source="lidar"):
    """Return what is said of a sensor's points by now."""
    return diagnostics_values(diagnostics_from_now(client, diagnostics), f"source {source} points")


def test_a_sensor_on_the_robot_sees_all_but_the_robot(client, node, look, sensed):
    """Where the ball was at its stamp; of its own ball and of the floor nothing is published."""
    seen = [[0.05, 0.05, 0.0], [1.5, 0, 0], [2.0, 0, -0.6], [float("nan")] * 3]
    wait_for(client, lambda: look("lidar", seen), [FREE, COLLIDES], -1.0, 0.5)
    look("lidar", seen)
    message = sensed.wait_for(lambda m: m.width, "points without the robot")
    assert message.header.frame_id == "world"
    np.testing.assert_allclose(points_of(message), [[0.5, 0, 0]], atol=1e-6)


def test_what_was_seen_stays_until_a_ray_goes_through_it(client, node, look):
    """From another place, of another sensor, and of a camera's image."""
    wait_for(client, lambda: look("lidar", [[2.5, 0, 0]], rail=-2.0), [COLLIDES], 0.5)
    beyond = [[4.5, 0, 0]]
    wait_for(client, lambda: look("lidar", beyond, rail=-2.0), [FREE, COLLIDES], 0.5, 2.5)
    # From (1, 0, 2) through (2.5, 0, 0), on to (2.8, 0, -0.4).
    wait_for(client, lambda: look("mast", [[1.8, 0, -2.4]], rail=-2.0), [FREE], 2.5)


def test_an_image_fills_the_same_cloud(client, node, told):
    """Of one pixel: straight down from (1, 0, 2), first to the rail, then below it."""
    info, images = (
        client.publisher(CameraInfo, "/eye/camera_info"),
        client.publisher(Image, "/eye/depth"),
    )

    def send(depth):
        lens = CameraInfo(height=1, width=1, k=[9.0, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 1.0])
        info.publish(lens)
        image = Image(height=1, width=1, encoding="32FC1", step=4)
        image.data = np.array([depth], "<f4").tobytes()
        told(-1.0)
        image.header.stamp = client.now()
        images.publish(image)
        told(-1.0)
        return outcomes(client, 1.0)

    wait_until(lambda: send(2.0) == [COLLIDES], "the pixel's point")
    wait_until(lambda: send(3.0) == [FREE], "a ray through it")


@pytest.mark.parametrize(
    ("fault", "points", "fields"),
    [
        ("malformed", [[1, 2, 3]], {"point_step": 8}),
        ("malformed", [[1, 2, 3]], {"fields": []}),
        ("malformed", [[1, 2, 3]], {"data": bytes(11)}),
        ("too_large", [[1, 2, 3]] * 1001, {}),
        ("too_large", [[1, 2, 3]] * 33_000, {}),
    ],
)
def test_faults_are_counted_and_change_nothing(
    client, node, look, diagnostics, fault, points, fields
):
    """The points before hold, and the node goes on."""
    wait_for(client, lambda: look("lidar", [[2.0, 0, 0]]), [COLLIDES], 1.0)
    before = int(faults(client, diagnostics)[fault])
    look("lidar", points, **fields)
    wait_until(lambda: int(faults(client, diagnostics)[fault]) == before + 1, f"one more {fault}")
    assert outcomes(client, 1.0) == [COLLIDES]


@pytest.mark.parametrize(("fault", "seconds"), [("future", 100), ("stale", -100)])
def test_clouds_of_another_time_are_counted(client, node, look, diagnostics, fault, seconds):
    """From the future, or older than max_pose_age."""
    publisher = client.publisher(PointCloud2, "/lidar/points")
    before = int(faults(client, diagnostics)[fault])
    message = cloud_message([[1, 2, 3]], "")
    message.header.stamp = client.now()
    message.header.stamp.sec += seconds
    publisher.publish(message)
    wait_until(lambda: int(faults(client, diagnostics)[fault]) == before + 1, f"one more {fault}")


def test_sensors_that_stop_make_their_world_old_and_that_is_said(client, node, look, diagnostics):
    """Each is STALE; what they saw holds."""
    wait_for(client, lambda: look("lidar", [[2.0, 0, 0]]), [COLLIDES], 1.0)

    def is_stale(message):
        levels = {each.name.split(": ")[-1]: each.level for each in message.status}
        return all(
            levels.get(f"source {name} points") == DiagnosticStatus.STALE
            for name in ("lidar", "mast")
        )

    message = diagnostics.wait_for(is_stale, "stale sensors")
    (status,) = [s for s in message.status if s.name.endswith("source lidar points")]
    assert status.message.startswith("no points for ")
    assert outcomes(client, 1.0) == [COLLIDES]


def test_the_node_survived_all_of_it(client, node):
    """After all this the node lives, and has no internal error on record."""
    assert node.is_alive()
    assert "Traceback" not in node.output()

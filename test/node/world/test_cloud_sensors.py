"""Clouds of sensors in a world: the robot is taken out, rays clear, points expire, several fuse.

The arm turns about z of the world; its sensor is at (1, 0, 0) on it, and its x is that of the arm.
"""

from types import SimpleNamespace

from cloud_messages import cloud_message
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.inputs import make_channel, message_type, POSES
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.point_channel import PointChannel
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.sensor_channel import PATIENCE
from scene_graph_ros.node.world.source_channel import apply_kept
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World

URDF = """<robot name="arm"><link name="root"/><link name="upper">
<collision><origin xyz="0.5 0 0"/><geometry><box size="0.6 0.1 0.1"/></geometry></collision></link>
<joint name="turn" type="continuous"><parent link="root"/><child link="upper"/><axis xyz="0 0 1"/>
</joint></robot>"""
SCENE = """
version: 1
sources:
  - name: lidar
    points: {remember: true, expires: 3, floor: -0.3, margin: 0.05,
             region: {lower: [-9, -9, -9], upper: [9, 9, 9]}}
  - {name: mast, points: {fills: lidar, frame: post, remember: true}}
  - {name: map, points: {fills: lidar, remove: []}}
  - {name: load}
robots:
  - {name: arm, urdf: arm.urdf, joint_states: joint_states, all_links: true}
frames:
  - {name: eye, source: lidar}
  - {name: post, source: load, pose: {xyz: [0, 0, 2]}}
geometries:
  - {name: seen, source: lidar, pose: {xyz: [0, 0, 1]}, shape: {type: point_cloud, radius: 0.02}}
"""
NOW, SECOND, MOST = 10**12, 10**9, 50


class Sensing:
    """A world with an arm and sensors, and the channels that move them."""

    def __init__(self, folder, text=SCENE):
        (folder / "arm.urdf").write_text(URDF)
        (folder / "scene.yaml").write_text(text)
        self.world, self.warnings, self.now = World(), [], NOW
        loader = SceneLoader("", message_type, EFFECT_NAMES)
        self.world.edit(lambda edit: loader.load(edit, str(folder / "scene.yaml")))
        self.records = self.world.records
        self.channels = {
            name: PointChannel(self.records[name], Intake(name, self.warnings.append), MOST)
            for name in ("lidar", "mast", "map")
            if name in self.records
        }
        self.joints = make_channel(POSES, self.records["arm"], self.warnings.append, "world")

    def turn(self, angle, stamp):
        """Have the arm's joint state arrive, and the update that takes it."""
        message = JointState(name=["turn"], position=[angle])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
        self.joints.store(serialize_message(message), 1)
        self.update()

    def send(self, points, frame="arm/upper", stamp=None, by="lidar"):
        """Have a cloud arrive; tell whether an update made points of it."""
        message = cloud_message(points, frame)
        stamp = self.now if stamp is None else stamp
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
        self.channels[by].store(serialize_message(message), 1)
        return self.update()

    def update(self):
        """Apply messages that wait, in the node's order; tell whether points changed."""
        limits, world = TimeLimits(now=self.now, max_age=5 * SECOND, max_lead=SECOND), self.world
        with world.lock:
            arm = world.records.get("arm")
            moves = apply_kept(self.joints, arm, lambda: world.frames("arm"), limits)
            world.note_poses()
            got = [
                apply_kept(channel, world.records.get(name), lambda: world.clouds["lidar"], limits)
                for name, channel in self.channels.items()
            ]
            sees = any(each is not None for each in got)
            sees |= world.clouds["lidar"].expire(self.now)
            if moves is not None or sees:
                world.commit(set() if moves is None else {"arm"}, 1, (), {"lidar"} if sees else ())
        return sees

    def points(self):
        """Return the points in the world, sorted."""
        snapshot = self.world.snapshot.query.snapshot
        points = snapshot.point_set(self.world.snapshot.names.geometry_id("seen")).points
        return points[np.lexsort(points.T)] + np.array([0.0, 0.0, 1.0])

    def faults(self, by="lidar"):
        """Return a sensor's faults so far."""
        return dict(self.channels[by].intake.statistics.faults)


@pytest.fixture
def sensing(tmp_path):
    """Return a world with an arm and sensors."""
    return Sensing(tmp_path)


def test_a_cloud_is_placed_by_the_joints_at_its_stamp(sensing):
    """It waits for them; the newest pose is another."""
    sensing.turn(0.0, NOW - 20_000_000)
    assert not sensing.send([[3.0, 0, 0]], stamp=NOW - 10_000_000)
    sensing.turn(1.0, NOW)
    expected = 3.0 * np.array([np.cos(0.5), np.sin(0.5), 0.0])
    np.testing.assert_allclose(sensing.points(), [expected], atol=1e-6)
    assert sensing.faults() == {}
    assert not sensing.send([[3.0, 0, 0]], stamp=NOW + 1)
    sensing.now += PATIENCE + 2
    assert not sensing.update()
    assert sensing.faults() == {Fault.NO_POSES: 1}
    assert "joint 'turn' of 'arm' was heard last" in sensing.warnings[-1]


def test_the_robot_the_floor_and_what_is_outside_are_no_points(sensing):
    """Within the padding of its box, below the floor, out of the region; not a number, too."""
    bodies = [[0.5, 0.06, 0.0], [0.81, 0.0, 0.0]]
    outside = [[2, 0, -0.31], [9.1, 0, 0], [np.nan, 1, 1]]
    assert sensing.send([*bodies, *outside, [0.5, 0.3, 0.0], [2, 0, 1]])
    np.testing.assert_allclose(sensing.points(), [[0.5, 0.3, 0.0], [2, 0, 1]], atol=1e-6)
    newest = sensing.channels["lidar"].newest
    assert newest["no points in the newest (not finite)"] == 1
    image = sensing.world.snapshot.images["lidar"]
    np.testing.assert_allclose(np.sort(image.p_WPs[:, 2]), [0, 1], atol=1e-6)
    assert image.stamp == NOW


def test_what_is_attached_is_the_robots_too(sensing):
    """The post, once it has a shape and hangs on the arm; what was seen of it goes with it."""

    def give_shape(edit):
        from scene_graph_ros.geometry import GeometryInstance, ProximityProperties, Sphere

        inspector, source = edit.scene_graph.model_inspector(), edit.records["load"].id
        ball = GeometryInstance(np.eye(4), Sphere(0.1), "ball")
        ball.set_proximity_properties(ProximityProperties())
        frame = inspector.get_frame_id_by_name(source, "post")
        edit.scene_graph.register_geometry(source, frame, ball)

    sensing.world.edit(give_shape)
    assert sensing.send([[0, 0, 1.89], [2, 0, 0]])
    assert len(sensing.points()) == 2

    def hang(edit):
        inspector = edit.scene_graph.model_inspector()
        frame = inspector.get_frame_id_by_name(edit.records["load"].id, "post")
        upper = inspector.get_frame_id_by_name(edit.records["arm"].id, "upper")
        edit.scene_graph.change_parent(edit.records["load"].id, frame, upper)

    sensing.world.edit(hang)
    sensing.now += SECOND
    assert sensing.send([[0, 1.0, 0]])
    np.testing.assert_allclose(sensing.points(), [[2, 0, 0], [0, 1, 0]], atol=1e-6)


def test_rays_clear_and_points_expire(sensing):
    """From the sensor's origin through a ball, not beside it; after three seconds all is gone."""
    assert sensing.send([[2, 0, 0], [0, 2, 0], [0, 0, 2]])
    sensing.now += SECOND
    # Along x on behind the ball, along y ending in it, along z 0.03 m beside it.
    assert sensing.send([[4, 0, 0], [0, 2.01, 0], [0.06, 0, 4]])
    expected = [[4, 0, 0], [0, 2.01, 0], [0, 0, 2], [0.06, 0, 4]]
    np.testing.assert_allclose(sensing.points(), expected, atol=1e-6)
    newest = sensing.channels["lidar"].newest
    assert (newest["points cleared by it"], newest["points seen again in it"]) == (1, 1)
    sensing.now = NOW + 3 * SECOND + 1
    assert sensing.update()
    assert len(sensing.points()) == 3
    sensing.now += SECOND
    assert sensing.update()
    assert len(sensing.points()) == 0
    assert sensing.faults() == {}


def test_several_sensors_fill_one_cloud(sensing):
    """One clears what another saw; the one that replaces replaces its own points only."""
    assert sensing.send([[2, 0, 0], [0, 2, 0]])
    assert sensing.send([[0, 0, 3], [0, 0, 4]], "world", by="map")
    assert len(sensing.points()) == 4
    sensing.now += SECOND
    # Of the post at (0, 0, 2): through (2, 0, 0) down to (2.1, 0, -0.1).
    assert sensing.send([[2.1, 0, -2.1]], "nobody knows", by="mast")
    expected = [[2.1, 0, -0.1], [0, 2, 0], [0, 0, 3], [0, 0, 4]]
    np.testing.assert_allclose(sensing.points(), expected, atol=1e-6)
    assert sensing.send([[0, 0, 5]], "world", by="map")
    np.testing.assert_allclose(sensing.points(), [*expected[:2], [0, 0, 5]], atol=1e-6)
    assert set(sensing.world.snapshot.images) == {"lidar", "mast", "map"}
    # The lidar's expire, those of the others do not.
    sensing.now = NOW + 3 * SECOND + 1
    assert sensing.update()
    np.testing.assert_allclose(sensing.points(), [expected[0], [0, 0, 5]], atol=1e-6)
    # With its source a sensor's points go.
    sensing.world.edit(lambda edit: edit.remove_source(edit.records["map"]))
    np.testing.assert_allclose(sensing.points(), [expected[0]], atol=1e-6)
    assert [sensing.faults(by) for by in sensing.channels] == [{}, {}, {}]


def test_an_older_cloud_clears_nothing_that_was_seen_later(sensing):
    """Of two sensors whose messages come late."""
    sensing.send([[2, 0, 0]])
    assert sensing.send([[4, 0, 0]], "world", by="map")
    assert sensing.send([[2.1, 0, -2.1]], stamp=NOW - SECOND, by="mast")
    assert len(sensing.points()) == 3


def test_too_many_points_lose_the_oldest_and_that_is_said(sensing):
    """Each cloud has thirty, none in another's way."""
    for k in range(3):
        sensing.now = NOW + SECOND * k // 2
        around = np.linspace(0, 1, 30) + 0.01 * k
        assert sensing.send(4 * np.stack([np.cos(around), np.sin(around), 0 * around], 1))
    assert len(sensing.points()) == MOST
    assert sensing.faults() == {Fault.TOO_LARGE: 2}
    assert "max_points_per_cloud, 50" in sensing.warnings[-1]


def test_rays_from_nowhere_are_refused(sensing):
    """A cloud in the world frame, or in none, does not say where its sensor is."""
    assert not sensing.send([[2, 0, 0]], "world")
    assert sensing.faults() == {Fault.UNKNOWN_FRAME: 1}
    assert "sources: points: frame" in sensing.warnings[-1]
    assert not sensing.send([[2, 0, 0]], "")
    assert sensing.faults() == {Fault.UNKNOWN_FRAME: 1, Fault.MALFORMED: 1}


def test_clouds_that_move_are_filled_by_messages_that_replace(tmp_path):
    """Else their points, which stay in the world, would move with them."""
    text = SCENE.replace("{name: seen, source: lidar, pose", "{name: x, source: lidar, pose")
    moving = (
        "  - {name: seen, source: load, frame: post, shape: {type: point_cloud, radius: 0.1}}\n"
    )
    sensing = Sensing(
        tmp_path, text.replace("- {name: load}", "- {name: load, points: {}}") + moving
    )
    channel = PointChannel(sensing.records["load"], Intake("load", sensing.warnings.append), MOST)
    sensing.channels = {"load": channel}
    clouds = sensing.world.clouds["load"]
    limits = TimeLimits(now=NOW, max_age=5 * SECOND, max_lead=SECOND)
    for record, expected in (
        (sensing.records["load"], {}),
        (
            SimpleNamespace(name="load", sensor=sensing.records["lidar"].sensor),
            {Fault.UNKNOWN_GEOMETRY: 1},
        ),
    ):
        channel = PointChannel(record, Intake("load", sensing.warnings.append), MOST)
        message = cloud_message([[1, 0, 0]], "post")
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(NOW, SECOND)
        channel.store(serialize_message(message), 1)
        got = apply_kept(channel, record, lambda: clouds, limits)
        assert (got is not None, dict(channel.intake.statistics.faults)) == (
            not expected,
            expected,
        )
    assert "moves with a frame" in sensing.warnings[-1]

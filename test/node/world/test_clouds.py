"""Messages of points: whose they are, in which frames, and those that change nothing."""

from types import SimpleNamespace

from cloud_messages import cloud_message
import numpy as np
import pytest
from rclpy.serialization import serialize_message

from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.intake import Intake, UNSTAMPED
from scene_graph_ros.node.world.point_channel import PointChannel
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.source_channel import apply_kept
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World

SCENE = """
version: 1
sources: [{name: camera}, {name: arm}, {name: other}]
frames:
  - {name: lens, source: camera, pose: {xyz: [0, 0, 2], rpy: [0, 0, 1.5707963267948966]}}
  - {name: hand, source: arm, pose: {xyz: [0, 3, 0]}}
  - {name: twice, source: arm}
  - {name: twice, source: other}
geometries:
  - {name: ball, source: arm, frame: hand, shape: {type: sphere, radius: 0.5}}
  - {name: seen, source: camera, frame: lens, pose: {xyz: [1, 0, 0]},
     shape: {type: point_cloud, radius: 0.125, points: [[9, 9, 9]]}}
"""
NOW = 10**12
LIMITS = TimeLimits(now=NOW, max_age=5 * 10**9, max_lead=10**9)
MOST = 20


class Sensing:
    """A world with a cloud, and the channel that moves it."""

    def __init__(self, text=SCENE):
        self.world, self.warnings = World(), []
        loader = SceneLoader("", message_type, EFFECT_NAMES)
        request = SimpleNamespace(resource="", text=text, prefix="")
        self.world.edit(lambda edit: loader.load_request(edit, request))
        self.record = self.world.records["camera"]
        self.intake = Intake("camera", self.warnings.append)
        self.channel = PointChannel(self.record, self.intake, MOST)

    def send(self, *messages, stamp=NOW):
        """Have messages arrive before one update; tell whether they changed the cloud."""
        for message in messages:
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
            self.channel.store(serialize_message(message), 1)
        return self.update()

    def update(self):
        """Apply messages that wait; tell whether they changed the cloud."""
        with self.world.lock:
            clouds = self.world.clouds
            record = self.world.records.get("camera")
            got = apply_kept(self.channel, record, lambda: clouds.get("camera"), LIMITS)
            if got is not None:
                self.world.commit((), got, (), {"camera"})
        return got is not None

    def points(self, name="seen"):
        """Return the points of a cloud in the newest snapshot."""
        snapshot = self.world.snapshot
        geometry = snapshot.names.geometry_id(name)
        return snapshot.query.snapshot.point_set(geometry).points

    def faults(self):
        """Return the faults so far."""
        return dict(self.intake.statistics.faults)


@pytest.fixture
def sensing():
    """Return a world with a cloud."""
    return Sensing()


@pytest.mark.parametrize(
    ("frame", "expected"),
    [
        # seen is at (1, 0, 0) on lens, which is at (0, 0, 2) and turned by a quarter about z:
        # x of the world is -y of lens, and y of the world is x of lens.
        ("lens", [3.0, 5.0, 6.0]),
        ("camera/lens", [3.0, 5.0, 6.0]),
        ("world", [4.0, -4.0, 4.0]),
        ("hand", [7.0, -4.0, 4.0]),
        ("arm/hand", [7.0, -4.0, 4.0]),
        ("arm/twice", [4.0, -4.0, 4.0]),
    ],
)
def test_points_are_in_the_frame_that_the_message_names(sensing, frame, expected):
    """That of the cloud, the world, or any frame of the scene."""
    assert sensing.send(cloud_message([[4, 5, 6]], frame))
    np.testing.assert_allclose(sensing.points(), [expected], atol=1e-12)
    assert sensing.faults() == {}
    assert sensing.world.snapshot.source_stamp("camera") == NOW


def test_frames_are_where_the_same_update_puts_them(sensing):
    """A hand that moves while its camera sends: its pose is taken first."""
    frames = sensing.world.frames("arm")
    with sensing.world.lock:
        frames.X_PF[frames.rows["hand"], :3, 3] = (0, 4, 0)
        sensing.channel.store(serialize_message(cloud_message([[4, 5, 6]], "hand")), 1)
        clouds = sensing.world.clouds
        apply_kept(sensing.channel, sensing.record, lambda: clouds["camera"], LIMITS)
        sensing.world.commit({"arm"}, 1, (), {"camera"})
    np.testing.assert_allclose(sensing.points(), [[8, -4, 4]], atol=1e-12)


def test_pixels_that_see_nothing_are_no_points(sensing):
    """Not a number, infinite, or too far once they are in the cloud's frame; none at all."""
    bad = [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, 1e30], [4, 5, 6]]
    assert sensing.send(cloud_message(bad, "lens"))
    np.testing.assert_array_equal(sensing.points(), [[3, 5, 6]])
    assert sensing.channel.newest == {
        "points in the newest": 1, "no points in the newest (not finite)": 3
    }  # fmt: skip
    assert sensing.send(cloud_message([], "lens"))
    assert sensing.points().shape == (0, 3)
    assert sensing.faults() == {}


def without_y(message):
    """Return a message without a field."""
    message.fields = [field for field in message.fields if field.name != "y"]
    return message


def cut(message):
    """Return a message whose data is too short."""
    message.data = message.data[:-1]
    return message


@pytest.mark.parametrize(
    ("fault", "said", "message", "late"),
    [
        ("malformed", "no frame_id", cloud_message([[1, 2, 3]], ""), 0),
        ("malformed", "no field 'y'", without_y(cloud_message([[1, 2, 3]], "lens")), 0),
        ("malformed", "bytes", cut(cloud_message([[1, 2, 3]], "lens")), 0),
        ("unknown_frame", "'/odom', which is no frame", cloud_message([[1, 2, 3]], "/odom"), 0),
        ("unknown_frame", "arm/twice", cloud_message([[1, 2, 3]], "twice"), 0),
        ("too_large", "21 points", cloud_message(np.ones((21, 3)), "lens"), 0),
        ("too_large", "bytes", cloud_message(np.ones((30_000, 3)), "lens"), 0),
        ("stale", "max_pose_age", cloud_message([[1, 2, 3]], "lens"), 6 * 10**9),
        ("future", "max_pose_lead", cloud_message([[1, 2, 3]], "lens"), -2 * 10**9),
        ("out_of_order", "go back", cloud_message([[1, 2, 3]], "lens"), 1),
    ],
)
def test_faults_are_counted_and_named_and_change_nothing(sensing, fault, said, message, late):
    """The points before hold."""
    sensing.send(cloud_message([[4, 5, 6]], "lens"))
    before = sensing.points()
    assert not sensing.send(message, stamp=NOW - late)
    assert sensing.faults() == {Fault(fault): 1}
    assert said in sensing.warnings[-1]
    assert sensing.points() is before


def test_the_newest_good_message_counts(sensing):
    """Of two between updates; a bad one does not hide the good one before it."""
    good, newer = cloud_message([[4, 5, 6]], "lens"), cloud_message([[5, 5, 6]], "lens")
    assert sensing.send(good, newer)
    np.testing.assert_array_equal(sensing.points(), [[4, 5, 6]])
    assert sensing.intake.statistics.superseded == 1
    assert sensing.send(good, without_y(newer))
    np.testing.assert_array_equal(sensing.points(), [[3, 5, 6]])
    assert sensing.faults() == {Fault.MALFORMED: 1}
    assert sensing.send(good, good, good)
    assert sensing.intake.statistics.superseded == 3


SECOND = """
  - {name: more, source: camera, shape: {type: point_cloud, radius: 0.1}}
"""


def test_of_several_clouds_the_scene_names_one():
    """Else nobody knows whose the points are."""
    sensing = Sensing(SCENE + SECOND)
    assert not sensing.send(cloud_message([[4, 5, 6]]))
    assert sensing.faults() == {Fault.UNKNOWN_GEOMETRY: 1}
    assert "2 clouds" in sensing.warnings[0]
    assert "sources: points: geometry" in sensing.warnings[0]
    named = (SCENE + SECOND).replace("{name: camera}", "{name: camera, points: {geometry: more}}")
    sensing = Sensing(named)
    assert sensing.send(cloud_message([[4, 5, 6]]))
    np.testing.assert_array_equal(sensing.points("more"), [[4, 5, 6]])
    np.testing.assert_array_equal(sensing.points(), [[9, 9, 9]])


def test_a_radius_for_each_point_is_not_sent():
    """A message has none, so that such a cloud begins with its points and keeps them."""
    sensing = Sensing(SCENE.replace("0.125", "[0.125]"))
    assert not sensing.send(cloud_message([[4, 5, 6]]))
    assert sensing.faults() == {Fault.UNKNOWN_GEOMETRY: 1}
    assert "radius for each point" in sensing.warnings[0]


def test_an_edit_carries_the_points_over(sensing):
    """The same set with its tree, so that nothing is built or proven again; not its removal."""
    sensing.send(cloud_message([[4, 5, 6]], "lens"))
    world = sensing.world
    geometry = world.snapshot.names.geometry_id("seen")
    before = world.snapshot.query.snapshot.point_set(geometry)
    world.edit(lambda edit: edit.add_source("new", token=1))
    assert world.snapshot.query.snapshot.point_set(geometry) is before
    assert world.snapshot.source_stamp("camera") == NOW
    assert not sensing.send(cloud_message([[4, 5, 6]], "lens"), stamp=NOW - 1)
    assert sensing.send(cloud_message([[5, 5, 6]], "lens"), stamp=NOW)
    np.testing.assert_array_equal(sensing.points(), [[4, 5, 6]])
    world.edit(lambda edit: edit.scene_graph.remove_geometry(sensing.record.id, geometry))
    assert not sensing.send(cloud_message([[4, 5, 6]], "lens"))
    assert world.snapshot.sensing == frozenset()


def test_stamps_are_forgotten_with_all_others(sensing):
    """After a clock that jumps back earlier points are in order again."""
    sensing.send(cloud_message([[4, 5, 6]], "lens"))
    assert not sensing.send(cloud_message([[5, 5, 6]], "lens"), stamp=NOW - 1)
    sensing.world.forget_stamps()
    assert sensing.world.snapshot.source_stamp("camera") == UNSTAMPED
    np.testing.assert_array_equal(sensing.points(), [[3, 5, 6]])
    assert sensing.send(cloud_message([[5, 5, 6]], "lens"), stamp=NOW - 1)

"""Images of depth in a world: where their camera was at their stamps, and what is wrong with them.

The world is that of ``looking_arm``.
"""

from looking_arm import ahead, Looking, MOST, NOW, SCENE, SECOND
import numpy as np
import pytest
from std_msgs.msg import Header

from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.sensor_channel import PATIENCE


@pytest.fixture
def looking(tmp_path):
    """Return a world with an arm and its camera."""
    return Looking(tmp_path)


def test_an_image_is_placed_by_the_joints_at_its_stamp(looking):
    """Between two joint states by their ratio; the newest pose is another."""
    for k in range(6):
        looking.turn(0.4 * k, NOW - 100_000_000 + 20_000_000 * k)
    assert looking.send(stamp=NOW - 55_000_000)  # 2.25 intervals after the first
    np.testing.assert_allclose(looking.middle(), ahead(0.9), atol=1e-9)
    assert looking.faults() == {}
    assert looking.world.snapshot.source_stamp("camera") == NOW - 55_000_000


def test_a_joint_that_turns_over_goes_the_short_way(looking):
    """From 3.1 to -3.1 rad through pi, not through 0."""
    looking.turn(3.1, NOW - 20_000_000)
    looking.turn(-3.1, NOW)
    assert looking.send(stamp=NOW - 10_000_000)
    np.testing.assert_allclose(looking.middle(), ahead(np.pi), atol=1e-9)


def test_an_image_waits_for_the_joints_of_its_time(looking):
    """And is placed once they came, though others came with it; those are superseded or wait."""
    looking.turn(0.0, NOW - 30_000_000)
    assert not looking.send(stamp=NOW - 10_000_000)
    assert not looking.send(stamp=NOW + 10_000_000)
    assert looking.faults() == {}
    looking.turn(0.6, NOW)
    np.testing.assert_allclose(looking.middle(), ahead(0.4), atol=1e-9)
    looking.turn(1.0, NOW + 50_000_000)
    assert looking.intake.statistics.superseded == 1  # 20 ms after the one before, at 20 Hz
    assert looking.faults() == {}


def test_of_many_images_that_wait_the_oldest_is_not_lost(looking):
    """Else joints that are always late would leave none."""
    looking.turn(0.0, NOW - 100_000_000)
    for k in range(10):
        assert not looking.send(stamp=NOW - 90_000_000 + 10_000_000 * k)
    looking.turn(0.6, NOW - 90_000_000)
    np.testing.assert_allclose(looking.middle(), ahead(0.6), atol=1e-9)


def test_an_image_that_waits_in_vain_is_named(looking):
    """Its joint is silent; and so is one that is older than all that is remembered."""
    looking.turn(0.0, NOW - SECOND)
    assert not looking.send(stamp=NOW)
    looking.now = NOW + PATIENCE
    assert not looking.update()
    assert looking.faults() == {}
    looking.now += 1
    assert not looking.update()
    assert looking.faults() == {Fault.NO_POSES: 1}
    assert "joint 'turn' of 'arm' was heard last 1.000 s before it" in looking.warnings[-1]
    assert not looking.send(stamp=NOW - 2 * SECOND)
    assert looking.faults() == {Fault.NO_POSES: 2}


def test_a_robot_that_was_never_heard_is_where_it_is(looking):
    """As elsewhere: poses hold, here those of the scene file."""
    assert looking.send()
    np.testing.assert_allclose(looking.middle(), ahead(0.0), atol=1e-9)


def test_what_the_robot_is_and_holds_is_taken_out(looking):
    """The arm in a pixel's way, and the ball once it is attached to the arm."""
    looking.turn(0.0, NOW - 10_000_000)
    looking.turn(0.0, NOW)
    depth = np.full((3, 3), 2.0)
    depth[1, 1] = 0.9  # 1.9 ahead: the ball's near side
    assert looking.send(stamp=NOW - 5_000_000, depth=depth)
    assert np.isclose(looking.points()[:, 0], 1.9).sum() == 1

    def hang(edit):
        inspector = edit.scene_graph.model_inspector()
        source = edit.records["load"].id
        frame = inspector.get_frame_id_by_name(source, "held")
        upper = inspector.get_frame_id_by_name(edit.records["arm"].id, "upper")
        edit.scene_graph.change_parent(source, frame, upper)

    looking.world.edit(hang)
    assert np.isclose(looking.points()[:, 0], 1.9).sum() == 1  # an edit keeps the points
    looking.turn(0.0, NOW + 100_000_000)
    looking.turn(0.0, NOW + 200_000_000)
    looking.now = NOW + 200_000_000
    assert looking.send(stamp=NOW + 150_000_000, depth=depth)
    assert not np.isclose(looking.points()[:, 0], 1.9).any()
    assert looking.faults() == {}


def test_later_images_clear_and_points_expire(looking):
    """A wall that steps back; after three seconds nothing is left."""
    assert looking.send(stamp=NOW, depth=1.0)
    near = np.sort(looking.points()[:, 0])
    looking.now += SECOND
    assert looking.send(stamp=NOW + SECOND, depth=2.0)
    np.testing.assert_allclose(np.sort(looking.points()[:, 0]), near + 1.0, atol=1e-9)
    assert looking.images.newest["points cleared by it"] == 6  # of 9, less the floor
    looking.now = NOW + 4 * SECOND
    assert not looking.update()
    looking.now += 1
    assert looking.update()
    assert len(looking.points()) == 0
    assert looking.faults() == {}


def test_too_many_points_lose_the_oldest_and_that_is_said(looking):
    """Each image sees six above the floor, and the arm turns once."""
    for k in range(18):
        looking.now = stamp = NOW + 100_000_000 * k
        looking.turn(0.35 * k, stamp)
        assert looking.send(stamp=stamp)
    assert len(looking.points()) == MOST
    assert set(looking.faults()) == {Fault.TOO_LARGE}
    assert "max_points_per_cloud, 50" in looking.warnings[-1]


@pytest.mark.parametrize(
    ("fault", "said", "fields"),
    [
        ("malformed", "encoding", {"encoding": "mono8"}),
        ("malformed", "data has 9 bytes", {"data": bytes(9)}),
        ("malformed", "pixels", {"height": 1000, "data": bytes(12_000)}),
        ("malformed", "more than enough", {"data": bytes(300_000)}),
        ("wrong_length", "2 x 3 pixels, its lens 3 x 3", {"width": 2}),
        ("stale", "max_pose_age", {"stamp": NOW - 6 * SECOND}),
        ("future", "max_pose_lead", {"stamp": NOW + 2 * SECOND}),
        ("out_of_order", "go back", {"stamp": NOW - 1}),
    ],
)
def test_faults_are_counted_and_named_and_change_nothing(looking, fault, said, fields):
    """The points before hold."""
    assert looking.send()
    before = looking.points()
    assert not looking.send(**{"stamp": NOW + SECOND // 2, **fields})
    assert looking.faults() == {Fault(fault): 1}
    assert said in looking.warnings[-1]
    np.testing.assert_array_equal(looking.points(), before)


def test_an_image_before_its_lens_waits_and_then_is_named(tmp_path):
    """A lens with distortion is none."""
    looking = Looking(tmp_path)
    looking.info.take()
    looking.send_info(d=[0.1])
    assert not looking.send()
    assert looking.info.intake.statistics.faults == {Fault.MALFORMED: 1}
    assert looking.faults() == {}
    looking.send_info()
    assert looking.update()
    looking.world.clouds["camera"].sensors["camera"].lens = None
    looking.now += SECOND
    assert not looking.send(stamp=NOW + SECOND // 4)
    assert looking.faults() == {Fault.NO_CAMERA_INFO: 1}
    assert "'eye/camera_info'" in looking.warnings[-1]


OPTICAL = SCENE.replace("frame: arm/upper, ", "").replace(
    "pose: {xyz: [1, 0, 0], quaternion: [-0.5, 0.5, -0.5, 0.5]}, ", ""
)


@pytest.mark.parametrize(
    ("frame", "x"), [("load/held", 2.0), ("held", 2.0), ("world", 0.0), ("eye_optical_frame", 0.5)]
)
def test_the_optical_frame_is_that_of_the_image(tmp_path, frame, x):
    """By name or path, or that of a camera of the scene itself."""
    camera = """
cameras:
  - {name: eye, source: load, frame: held, pose: {xyz: [-1.5, 0, 0]}, size: [3, 3], fov_y: 1.0}
"""
    looking = Looking(tmp_path, OPTICAL + camera)
    assert looking.send(header=Header(frame_id=frame))
    # z of an optical frame that is not turned is up.
    found = looking.points()
    np.testing.assert_allclose(np.unique(found[:, 2].round(9)), [2.0])
    np.testing.assert_allclose(np.median(found[:, 0]), x, atol=1e-9)


@pytest.mark.parametrize(("frame", "said"), [("", "no frame_id"), ("odom", "'odom'")])
def test_an_unknown_optical_frame_is_named(tmp_path, frame, said):
    """None, or none of the scene."""
    looking = Looking(tmp_path, OPTICAL)
    assert not looking.send(header=Header(frame_id=frame))
    assert looking.faults() == {Fault.UNKNOWN_FRAME: 1}
    assert said in looking.warnings[-1]


def test_a_clock_that_jumps_back_forgets_stamps(looking):
    """Earlier images are in order again, and what was seen expires after that time."""
    assert looking.send()
    looking.world.forget_stamps(NOW - SECOND)
    looking.now = NOW - SECOND
    assert looking.send(stamp=NOW - SECOND, depth=np.full((3, 3), np.nan))
    assert len(looking.points()) == 6
    looking.now = NOW + 2 * SECOND + 1
    assert looking.update()
    assert len(looking.points()) == 0


def test_the_points_of_the_newest_image_are_in_the_snapshot(looking):
    """Without what earlier ones saw: for others, who want the image without the robot."""
    assert looking.world.snapshot.images == {}
    assert looking.send()
    seen = looking.world.snapshot.images["camera"]
    assert seen.stamp == NOW
    assert len(seen.p_WPs) == len(seen.radii) == 6

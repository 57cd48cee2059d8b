"""Each type of message that poses come in: where its stamps, names and numbers are."""

from __future__ import annotations

from types import SimpleNamespace

from geometry_msgs.msg import PoseStamped, TransformStamped
import numpy as np
from pose_wires import assert_places, assert_same, known, STAMP, Target, taught, transform
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from workspace_messages import message_class

from msg_adapters.poses import (
    joints_from_msg,
    pose_stamped_to_msg,
    poses_from_pose_stamped,
    poses_from_tf,
    poses_from_transform_stamped,
)
from msg_adapters.stamps import stamp_to_msg


@pytest.fixture
def rng():
    """Numbers that are the same in each run."""
    return np.random.default_rng(7)


def stamped(rng, child="tool", stamp=STAMP):
    """Return a stamped transform."""
    message = TransformStamped(child_frame_id=child, transform=transform(rng))
    message.header.stamp = stamp_to_msg(stamp)
    message.header.frame_id = "base"
    return message


def pose(rng):
    """Return a stamped pose."""
    message = PoseStamped()
    t = transform(rng)
    message.pose.position.x, message.pose.position.y = t.translation.x, t.translation.y
    message.pose.orientation = t.rotation
    message.header.stamp = stamp_to_msg(STAMP + int(rng.integers(1000)))
    message.header.frame_id = "map"
    return message


def test_pose_stamped(rng):
    """The name of the frame comes from the scene, not from the message."""
    wire = taught("geometry_msgs/msg/PoseStamped", pose(rng))
    later = pose(rng)
    data, layout = known(wire, later)
    assert_same(layout.poses(data, ("cup",)), poses_from_pose_stamped(later, "cup"))


def test_pose_stamped_round_trip():
    """What the adapter writes, it reads back."""
    X = np.eye(4)
    X[:3, 3] = (1.0, 2.0, 3.0)
    message = pose_stamped_to_msg(X, stamp_ns=5, frame_id="map")
    wire = taught("geometry_msgs/msg/PoseStamped", message)
    data, layout = known(wire, message)
    np.testing.assert_array_equal(layout.poses(data, ("cup",)).X_PF[0], X)


def test_transform_stamped(rng):
    """The child's name is part of the layout."""
    wire = taught("geometry_msgs/msg/TransformStamped", stamped(rng))
    later = stamped(rng, stamp=STAMP + 5)
    data, layout = known(wire, later)
    assert_same(layout.poses(data), poses_from_transform_stamped(later))
    assert_places(layout, data, poses_from_transform_stamped(later))
    assert wire.find(serialize_message(stamped(rng, child="toot"))) is None


def test_transforms_with_stamps_and_names_between_their_numbers(rng):
    """Each transform has a stamp of its own, and one too old leaves all to be judged alone."""
    kind = message_class("tf2_msgs", "TFMessage")
    names = ["a", "bcd", "efghij", "kl"]

    def message(*stamps):
        parts = zip(names, stamps, strict=True)
        return kind(transforms=[stamped(rng, name, STAMP + stamp) for name, stamp in parts])

    wire = taught("tf2_msgs/msg/TFMessage", message(1, 2, 3, 4))
    later = message(9, 7, 0, 8)
    data, layout = known(wire, later)
    assert_same(layout.poses(data), poses_from_tf(later))
    assert_places(layout, data, poses_from_tf(later))
    late = serialize_message(message(9, 7, 8, -1))
    target = Target(4)
    assert not target.place(wire.find(late), late)
    assert target.is_untouched


def test_transforms_with_stamps_of_their_own(rng):
    """As a TFMessage has them: several stamps, names between the numbers."""
    kind = message_class("tf2_msgs", "TFMessage")
    names = ["a", "bcd", "efghij"]
    message = kind(transforms=[stamped(rng, name, STAMP + i) for i, name in enumerate(names)])
    wire = taught("tf2_msgs/msg/TFMessage", message)
    message.transforms = [stamped(rng, name, STAMP - i) for i, name in enumerate(names)]
    data, layout = known(wire, message)
    assert layout.stamp(data) == STAMP
    assert_same(layout.poses(data), poses_from_tf(SimpleNamespace(transforms=message.transforms)))


@pytest.mark.parametrize("extras", [False, True])
def test_joint_positions(rng, extras):
    """Positions are read, velocities and efforts are not looked at."""

    def joints(positions, stamp):
        message = JointState(name=["hip", "knee", "ankle"], position=positions)
        message.header.stamp = stamp_to_msg(stamp)
        if extras:
            message.velocity = rng.normal(size=3).tolist()
            message.effort = rng.normal(size=3).tolist()
        return message

    wire = taught("sensor_msgs/msg/JointState", joints([1.0, 2.0, 3.0], 5))
    for positions in ([0.25, -0.5, 0.75], [0.25, float("nan"), 0.75]):
        later = joints(positions, STAMP)
        data, layout = known(wire, later)
        batch, expected = layout.joints(data), joints_from_msg(later)
        assert (batch.names, batch.stamp_ns) == (expected.names, expected.stamp_ns)
        assert batch.positions.tolist() == expected.positions.tolist()
        assert batch.refused == expected.refused

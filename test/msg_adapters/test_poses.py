"""Poses in both directions, and what is refused."""

from collections.abc import Callable
import math
from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from sensor_msgs.msg import JointState, MultiDOFJointState
from std_msgs.msg import Header

from msg_adapters import poses
from msg_adapters.errors import MessageError
from msg_adapters.poses import PoseFault
from msg_adapters.stamps import stamp_to_msg
from scene_graph_ros.geometry.errors import InvalidPoseError
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE, QUATERNION_NORM_DEFECT

# (x, y, z, w) = (0.1, 0.3, 0.5, s) with s^2 = 1 - 0.01 - 0.09 - 0.25 = 0.65.
Q = (0.1, 0.3, 0.5, math.sqrt(0.65))
# R_ij from the textbook formula, e.g. R_00 = 1 - 2 (y^2 + z^2) = 1 - 2 (0.09 + 0.25).
R = np.array(
    [
        [1 - 2 * (0.09 + 0.25), 2 * (0.03 - 0.5 * Q[3]), 2 * (0.05 + 0.3 * Q[3])],
        [2 * (0.03 + 0.5 * Q[3]), 1 - 2 * (0.01 + 0.25), 2 * (0.15 - 0.1 * Q[3])],
        [2 * (0.05 - 0.3 * Q[3]), 2 * (0.15 + 0.1 * Q[3]), 1 - 2 * (0.01 + 0.09)],
    ]
)
P = (1.5, -2.25, 3.125)
STAMP = 7_000_000_011
X = np.eye(4)
X[:3, :3], X[:3, 3] = R, P


def pose_msg(p: tuple = P, q: tuple = Q) -> Pose:
    """Return a pose message from tuples."""
    return Pose(position=Point(**dict(zip("xyz", p, strict=True))), orientation=quaternion(q))


def quaternion(q: tuple = Q) -> Quaternion:
    """Return a quaternion message from x, y, z, w."""
    return Quaternion(**dict(zip("xyzw", q, strict=True)))


def transform_msg(p: tuple = P, q: tuple = Q) -> Transform:
    """Return a transform message from tuples."""
    translation = Vector3(**dict(zip("xyz", p, strict=True)))
    return Transform(translation=translation, rotation=quaternion(q))


def header(frame_id: str = "parent") -> Header:
    """Return a header with the stamp of these tests."""
    return Header(stamp=stamp_to_msg(STAMP), frame_id=frame_id)


def multi_dof(transforms: dict[str, Transform]) -> MultiDOFJointState:
    """Return a message that moves the named frames."""
    return MultiDOFJointState(
        header=header(), joint_names=list(transforms), transforms=list(transforms.values())
    )


def test_a_pose_message_has_the_order_x_y_z_w() -> None:
    """Seven distinct numbers give the rotation of the textbook formula and the position."""
    np.testing.assert_allclose(poses.pose_from_msg(pose_msg(), "p"), X, rtol=0, atol=1e-15)
    np.testing.assert_allclose(
        poses.transform_from_msg(transform_msg(), "t"), X, rtol=0, atol=1e-15
    )


def test_a_pose_becomes_the_message_it_came_from() -> None:
    """Position bit for bit, the quaternion to rounding and with w >= 0."""
    for msg in (poses.pose_to_msg(X), poses.poses_to_msg(np.stack([np.eye(4), X]))[1]):
        assert (msg.position.x, msg.position.y, msg.position.z) == P
        q = msg.orientation
        np.testing.assert_allclose((q.x, q.y, q.z, q.w), Q, rtol=0, atol=1e-15)
    transform = poses.transform_to_msg(X)
    assert (transform.translation.x, transform.translation.y, transform.translation.z) == P
    np.testing.assert_allclose(transform.rotation.w, Q[3], rtol=0, atol=1e-15)


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3),
    st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4),
)
def test_a_pose_survives_a_round_trip(p: list[float], q: list[float]) -> None:
    """Message to array to message to array: the second array is the first to rounding."""
    norm = math.hypot(*q)
    if norm < 1e-3:
        q, norm = [0.0, 0.0, 0.0, 1.0], 1.0
    first = poses.pose_from_msg(pose_msg(tuple(p), tuple(v / norm for v in q)), "first")
    again = poses.pose_from_msg(poses.pose_to_msg(first), "again")
    np.testing.assert_allclose(again, first, rtol=0, atol=4e-15)
    np.testing.assert_array_equal(again[:3, 3], p)


@pytest.mark.parametrize("defect", [0.9, -0.9])
def test_a_quaternion_of_nearly_unit_length_is_normalized(defect: float) -> None:
    """Within the accepted defect the rotation is that of the unit quaternion."""
    factor = 1.0 + defect * QUATERNION_NORM_DEFECT
    q = tuple(factor * v for v in Q)
    np.testing.assert_allclose(poses.pose_from_msg(pose_msg(q=q), "p"), X, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("p", "q", "words"),
    [
        (P, (0.0, 0.0, 0.0, 0.0), "norm"),
        (P, tuple((1.0 + 1.1 * QUATERNION_NORM_DEFECT) * v for v in Q), "norm"),
        (P, tuple((1.0 - 1.1 * QUATERNION_NORM_DEFECT) * v for v in Q), "norm"),
        ((1.0, math.nan, 0.0), Q, "finite"),
        ((1.0, 0.0, -math.inf), Q, "finite"),
        (P, (math.nan, 0.0, 0.0, 1.0), "finite"),
        (P, (1e200, 1e200, 0.0, 0.0), "norm"),
        ((0.0, 2.0 * MAX_COORDINATE, 0.0), Q, "beyond"),
    ],
)
def test_a_bad_pose_is_refused_with_its_name_and_value(p: tuple, q: tuple, words: str) -> None:
    """Not finite, not of unit length or too far away raises and says which."""
    with pytest.raises(InvalidPoseError, match=f"'gripper'.*{words}") as error:
        poses.pose_from_msg(pose_msg(p, q), "gripper")
    assert str(p[1]) in str(error.value)


def test_one_bad_pose_refuses_only_itself(over_the_wire: Callable[[Any], Any]) -> None:
    """Of five transforms the good ones keep names, order and values; each fault is told apart."""
    msg = multi_dof(
        {
            "a": transform_msg((1.0, 2.0, 3.0)),
            "nan": transform_msg((math.nan, 0.0, 0.0)),
            "b": transform_msg((4.0, 5.0, 6.0)),
            "zero": transform_msg(q=(0.0, 0.0, 0.0, 0.0)),
            "far": transform_msg((1e13, 0.0, 0.0)),
        }
    )
    batch = poses.poses_from_multi_dof_joint_state(over_the_wire(msg))
    assert batch.names == ("a", "b")
    assert batch.parents == ("parent", "parent")
    assert batch.stamps_ns.tolist() == [STAMP, STAMP]
    np.testing.assert_array_equal(batch.X_PF[:, :3, 3], [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0)])
    np.testing.assert_allclose(batch.X_PF[1, :3, :3], R, rtol=0, atol=1e-15)
    assert [(r.name, r.fault) for r in batch.refused] == [
        ("nan", PoseFault.NOT_FINITE),
        ("zero", PoseFault.NOT_UNIT_QUATERNION),
        ("far", PoseFault.FAR_AWAY),
    ]
    assert all(repr(refused.name) in refused.message for refused in batch.refused)
    assert "nan" in batch.refused[0].message


def test_poses_of_a_source_survive_the_wire(over_the_wire: Callable[[Any], Any]) -> None:
    """Names, parent, stamp and poses come back from a serialized MultiDOFJointState."""
    X_PF = np.stack([np.eye(4), X])
    msg = poses.multi_dof_joint_state_to_msg(["l", "r"], X_PF, stamp_ns=STAMP, frame_id="base")
    batch = poses.poses_from_multi_dof_joint_state(over_the_wire(msg))
    assert (batch.names, batch.parents, batch.refused) == (("l", "r"), ("base", "base"), ())
    np.testing.assert_allclose(batch.X_PF, X_PF, rtol=0, atol=1e-15)


def test_an_empty_message_is_an_empty_batch() -> None:
    """No names and no transforms are no mistake."""
    batch = poses.poses_from_multi_dof_joint_state(MultiDOFJointState())
    assert batch.names == () and batch.X_PF.shape == (0, 4, 4) and batch.refused == ()


def test_lists_that_do_not_fit_are_refused() -> None:
    """Another number of transforms than of names is no message to guess at."""
    msg = multi_dof({"a": transform_msg(), "b": transform_msg()})
    msg.joint_names = ["a"]
    with pytest.raises(MessageError, match="1 joint_names, but 2 transforms"):
        poses.poses_from_multi_dof_joint_state(msg)
    with pytest.raises(ValueError, match="1 names for 2 poses"):
        poses.multi_dof_joint_state_to_msg(
            ["a"], np.stack([X, X]), stamp_ns=STAMP, frame_id="base"
        )


def test_a_stamped_pose_moves_the_frame_it_is_read_for() -> None:
    """A PoseStamped names no frame: the caller does."""
    msg = poses.pose_stamped_to_msg(X, stamp_ns=STAMP, frame_id="map")
    assert msg == PoseStamped(header=header("map"), pose=poses.pose_to_msg(X))
    batch = poses.poses_from_pose_stamped(msg, "cup")
    assert (batch.names, batch.parents, batch.stamps_ns.tolist()) == (("cup",), ("map",), [STAMP])
    np.testing.assert_allclose(batch.X_PF[0], X, rtol=0, atol=1e-15)


def test_a_stamped_transform_moves_its_child_frame() -> None:
    """The child is what moves, the header's frame its parent."""
    msg = poses.transform_stamped_to_msg(X, stamp_ns=STAMP, frame_id="map", child_frame_id="cup")
    assert (msg.header, msg.child_frame_id) == (header("map"), "cup")
    batch = poses.poses_from_transform_stamped(msg)
    assert (batch.names, batch.parents) == (("cup",), ("map",))
    np.testing.assert_allclose(batch.X_PF[0], X, rtol=0, atol=1e-15)


def test_each_transform_of_tf_has_its_own_parent_and_stamp() -> None:
    """A TF message mixes senders; what differs between them is kept apart."""
    first, *_ = poses.tf_to_msg(["cup"], X[np.newaxis], stamp_ns=STAMP, frame_id="map")
    second = TransformStamped(
        header=Header(stamp=stamp_to_msg(STAMP + 5), frame_id="arm"),
        child_frame_id="hand",
        transform=transform_msg((9.0, 8.0, 7.0)),
    )
    batch = poses.poses_from_tf(SimpleNamespace(transforms=[first, second]))
    assert batch.names == ("cup", "hand")
    assert batch.parents == ("map", "arm")
    assert batch.stamps_ns.tolist() == [STAMP, STAMP + 5]
    np.testing.assert_array_equal(batch.X_PF[1, :3, 3], (9.0, 8.0, 7.0))


def test_joint_positions_keep_their_names_and_bad_ones_are_listed() -> None:
    """A joint that is not a number is left out; the others are used."""
    msg = JointState(header=header(), name=["j1", "j2", "j3"], position=[0.1, math.nan, 0.3])
    batch = poses.joints_from_msg(msg)
    assert batch.names == ("j1", "j3")
    assert batch.positions.tolist() == [0.1, 0.3]
    assert batch.stamp_ns == STAMP
    assert [(r.name, r.fault) for r in batch.refused] == [("j2", PoseFault.NOT_FINITE)]
    assert "'j2'" in batch.refused[0].message


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_joint_positions_beyond_all_measure_are_listed(sign: float) -> None:
    """The largest coordinate is the last that is taken, as for poses."""
    beyond = sign * math.nextafter(MAX_COORDINATE, math.inf)
    positions = [sign * MAX_COORDINATE, beyond]
    batch = poses.joints_from_msg(JointState(name=["j1", "j2"], position=positions))
    assert (batch.names, batch.positions.tolist()) == (("j1",), positions[:1])
    assert [(r.name, r.fault) for r in batch.refused] == [("j2", PoseFault.FAR_AWAY)]
    assert str(beyond) in batch.refused[0].message


def test_joints_without_positions_are_refused() -> None:
    """Names without as many positions can't be told apart."""
    with pytest.raises(MessageError, match="2 names, but 1 positions"):
        poses.joints_from_msg(JointState(name=["a", "b"], position=[1.0]))


def test_a_joint_named_twice_counts_where_both_say_the_same() -> None:
    """Else which of its two positions was meant can't be known: both are named."""
    batch = poses.joints_from_msg(JointState(name=["a", "b", "/a"], position=[1.0, 2.0, 1.0]))
    assert (batch.names, batch.positions.tolist(), batch.refused) == (("a", "b"), [1.0, 2.0], ())
    batch = poses.joints_from_msg(JointState(name=["a", "b", "a"], position=[1.0, 2.0, 3.0]))
    assert (batch.names, batch.positions.tolist()) == (("b",), [2.0])
    assert batch.refused[0].fault is poses.PoseFault.CONTRADICTORY
    assert "'a' is there twice, as 1.0 and as 3.0" in batch.refused[0].message


def test_a_frame_named_twice_counts_where_both_say_the_same() -> None:
    """With several stamps all count, the oldest first, so that the newest holds in the end."""
    rows = [(x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) for x in (3.0, 1.0, 2.0, 5.0, 6.0)]
    batch = poses.pose_batch(
        ["a", "/a", "b", "c", "c"], ["/world", "world", "", "", ""], [7, 4, 7, 7, 7], rows
    )
    assert batch.names == ("a", "a", "b")
    assert batch.parents == ("world", "world", "")
    assert batch.X_PF[:, 0, 3].tolist() == [1.0, 3.0, 2.0]
    (refused,) = batch.refused
    assert refused.name == "c"
    assert "5.0" in refused.message and "6.0" in refused.message
    same = poses.pose_batch(["c", "c"], ["", ""], [7, 7], [rows[0], rows[0]])
    assert (same.names, same.refused) == (("c",), ())

"""Poses read from bytes: the same as by the ordinary way, and never those of other names."""

from __future__ import annotations

import struct

from geometry_msgs.msg import Quaternion, Transform, Twist, Vector3
import numpy as np
from pose_wires import (
    assert_places,
    assert_same,
    CLASSES,
    known,
    MULTI,
    STAMP,
    Target,
    taught,
    transform,
    wire_of,
)
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState, MultiDOFJointState

from msg_adapters.poses import (
    poses_from_multi_dof_joint_state,
)
from msg_adapters.stamps import stamp_to_msg
from msg_adapters.wire.poses import _Places, Layout


@pytest.fixture
def rng():
    """Numbers that are the same in each run."""
    return np.random.default_rng(7)


def multi(rng, names, stamp=STAMP, frame_id="world"):
    """Return a message of named transforms."""
    message = MultiDOFJointState(joint_names=names, transforms=[transform(rng) for _ in names])
    message.header.stamp = stamp_to_msg(stamp)
    message.header.frame_id = frame_id
    return message


# Names whose ends fall on every residue of 8 bytes, so that all paddings occur.
NAMES = [["a" * n] for n in range(9)] + [[f"o{i}" for i in range(37)], ["x", "long name", "ß→"]]


@pytest.mark.parametrize("names", NAMES)
@pytest.mark.parametrize("frame_id", ["", "map", "world"])
def test_named_transforms_are_read_as_the_deserializer_does(rng, names, frame_id):
    """Whatever the lengths of names, a later message with other numbers gives the same batch."""
    wire = taught(MULTI, multi(rng, names, frame_id=frame_id))
    later = multi(rng, names, STAMP + 1, frame_id)
    data, layout = known(wire, later)
    assert layout.stamp(data) == STAMP + 1
    assert_same(layout.poses(data), poses_from_multi_dof_joint_state(later))
    assert_places(layout, data, poses_from_multi_dof_joint_state(later))


def test_a_message_that_comes_once_is_not_probed(rng):
    """Learning costs a serialization, which a message that never comes again is not worth."""
    count = 0

    def counting(message):
        nonlocal count
        count += 1
        return serialize_message(message)

    wire = wire_of(MULTI, counting)
    for i in range(50):
        message = multi(rng, [f"name{i}"])
        wire.learn(serialize_message(message), message)
    assert count == 0
    wire.learn(serialize_message(message), message)
    assert count > 0
    known(wire, message)


@pytest.mark.parametrize(
    ("names", "frame_id"),
    [(["a", "b"], "world"), (["b", "a"], "world"), (["aa", "b"], "world"), (["a", "c"], "map")],
)
def test_other_names_are_another_layout(rng, names, frame_id):
    """A message that differs in a name, their order, their number or its frame is not known."""
    wire = taught(MULTI, multi(rng, ["a", "c"]))
    assert wire.find(serialize_message(multi(rng, names, frame_id=frame_id))) is None


def test_layouts_of_the_same_size_are_told_apart(rng):
    """Many objects with a message each: every one is read with its own names."""
    messages = [multi(rng, [f"o{i:03}"]) for i in range(100)]
    wire = taught(MULTI, *messages)
    for i, message in enumerate(messages):
        data, layout = known(wire, message)
        assert layout.poses(data).names == (f"o{i:03}",)


def test_twists_and_what_else_comes_after_the_poses_is_not_looked_at(rng):
    """A message with twists is read too, also when the twists change."""
    message = multi(rng, ["a", "b"])
    message.twist = [Twist(linear=Vector3(x=1.0)), Twist()]
    wire = taught(MULTI, message)
    message.twist = [Twist(linear=Vector3(x=2.0)), Twist()]
    data, layout = known(wire, message)
    assert_same(layout.poses(data), poses_from_multi_dof_joint_state(message))
    assert wire.find(serialize_message(multi(rng, ["a", "b"]))) is None


def test_bad_poses_are_refused_as_by_the_ordinary_way(rng):
    """NaN, a far coordinate and a quaternion that is none refuse themselves, with their names."""
    wire = taught(MULTI, multi(rng, ["a", "b", "c", "d"]))
    message = multi(rng, ["a", "b", "c", "d"])
    message.transforms[0].translation.y = float("nan")
    message.transforms[2].rotation.w = 3.0
    message.transforms[3].translation.x = 1e300
    data, layout = known(wire, message)
    batch = layout.poses(data)
    expected = poses_from_multi_dof_joint_state(message)
    target = Target(4)
    assert not target.place(layout, data)
    assert target.is_untouched
    assert [refused.name for refused in batch.refused] == ["a", "c", "d"]
    assert [r.fault for r in batch.refused] == [r.fault for r in expected.refused]
    assert (batch.names, batch.parents) == (("b",), ("world",))
    np.testing.assert_array_equal(batch.X_PF, expected.X_PF)


@pytest.mark.parametrize(
    ("spoil", "is_placed"),
    [
        (lambda t: None, True),
        (lambda t: setattr(t.translation, "z", float("nan")), False),
        (lambda t: setattr(t.translation, "z", float("-inf")), False),
        (lambda t: setattr(t.translation, "z", -1.0e12), True),
        (lambda t: setattr(t.translation, "z", -1.1e12), False),
        (lambda t: setattr(t.rotation, "w", float("nan")), False),
        (lambda t: setattr(t.rotation, "w", float("inf")), False),
        (lambda t: setattr(t.rotation, "w", 1e200), False),
        (lambda t: setattr(t, "rotation", Quaternion(w=1.00099)), True),
        (lambda t: setattr(t, "rotation", Quaternion(w=1.00101)), False),
        (lambda t: setattr(t, "rotation", Quaternion(w=0.0)), False),
    ],
)
def test_all_poses_of_a_message_are_placed_or_none(rng, spoil, is_placed):
    """One bad pose, the last, leaves those before it to be judged one by one."""
    wire = taught(MULTI, multi(rng, ["a", "b", "c"]))
    message = multi(rng, ["a", "b", "c"])
    spoil(message.transforms[2])
    data, layout = known(wire, message)
    target = Target(3)
    assert target.place(layout, data) == is_placed
    assert target.is_untouched != is_placed
    assert layout.is_clean(data) == is_placed
    assert (len(layout.poses(data).refused) == 0) == is_placed


@pytest.mark.parametrize(
    ("stamp", "earliest", "latest", "placed"),
    [
        (STAMP + 5, STAMP + 5, STAMP + 5, STAMP + 5),
        (STAMP + 5, STAMP + 6, STAMP + 9, None),
        (STAMP + 5, STAMP, STAMP + 4, None),
        (STAMP, STAMP - 9, STAMP, STAMP),
        (STAMP - 1, STAMP - 9, STAMP, None),  # older than what is there
        (0, STAMP + 50, STAMP + 50, STAMP + 50),  # stands for now
        (0, STAMP + 51, STAMP + 99, None),
    ],
)
def test_limits_of_time_hold_for_messages_placed_in_one_go(rng, stamp, earliest, latest, placed):
    """They are inclusive; a message without a stamp is of now."""
    wire = taught(MULTI, multi(rng, ["a"]))
    data, layout = known(wire, multi(rng, ["a"], stamp))
    target = Target(1)
    assert target.place(layout, data, earliest, latest) == (placed is not None)
    assert target.stamps[1] == (STAMP if placed is None else placed)
    assert target.is_untouched == (placed is None)


@pytest.mark.parametrize("is_good", [True, False])
def test_numbers_that_are_not_in_a_row_are_read_without_the_kernel(is_good):
    """Something between position and quaternion, as no serializer puts it, leads to no error."""
    p, q = np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 0.6, 0.8 if is_good else np.nan])
    data = bytes(4) + struct.pack("=iI", 5, 6) + p.tobytes() + b"fill" + q.tobytes()
    gather = np.concatenate([np.arange(12, 36), np.arange(40, 72)])
    layout = Layout(_Places(np.arange(4), (4,), 12, 7, gather), ("a",), ("",), 7)
    target = Target(1)
    assert not target.place(layout, data, 0)
    assert target.is_untouched
    assert layout.is_clean(data) == is_good
    batch = layout.poses(data)
    assert batch.stamps_ns.tolist() == [5_000_000_006] * is_good
    np.testing.assert_array_equal(batch.X_PF[:, :3, 3], [p] * is_good or np.empty((0, 3)))


def test_numbers_that_look_like_marks_are_only_numbers(rng):
    """The bytes that probes use may be in a message as well."""
    message = multi(rng, ["a", "b"], stamp=0)
    message.transforms[0].translation.x = np.frombuffer(b"\x22" * 8).tolist()[0]
    message.transforms[1].translation.z = np.frombuffer(b"\x11" * 8).tolist()[0]
    wire = taught(MULTI, message)
    data, layout = known(wire, message)
    assert_same(layout.poses(data), poses_from_multi_dof_joint_state(message))


def test_an_empty_message_is_left_to_the_ordinary_way(rng):
    """Where there are no numbers there is no layout."""
    message = multi(rng, [])
    wire = taught(MULTI, message)
    assert wire.find(serialize_message(message)) is None


@pytest.mark.parametrize("data", [b"", b"\x00", bytes(100)])
def test_bytes_that_are_no_message_are_not_known(rng, data):
    """Short or foreign bytes find no layout and raise nothing."""
    assert taught(MULTI, multi(rng, ["a"])).find(data) is None


def test_a_truncated_message_is_not_known(rng):
    """Each size is another layout, so that nothing is read beyond the end."""
    wire = taught(MULTI, multi(rng, ["a"]))
    data = serialize_message(multi(rng, ["a"]))
    assert all(wire.find(data[:length]) is None for length in range(len(data)))


def test_a_message_without_the_serializers_surplus_is_read(rng):
    """Publishers send just what a message needs, where the serializer gives some bytes more."""
    message = JointState(name=["hip", "knee", "ankle"], position=[1.0, 2.0, 3.0])
    data = serialize_message(message)
    # Two empty sequences come after the positions.
    end = data.index(np.array(message.position).tobytes()) + 3 * 8 + 2 * 4
    assert deserialize_message(data[:end], JointState) == message
    assert end < len(data)
    wire = wire_of("sensor_msgs/msg/JointState")
    for _ in range(20):
        wire.learn(data[:end], message)
    layout = wire.find(data[:end])
    assert layout.joints(data[:end]).positions.tolist() == [1.0, 2.0, 3.0]


def test_stamps_before_and_far_after_the_epoch(rng):
    """Seconds are signed, nanoseconds are not."""
    wire = taught(MULTI, multi(rng, ["a"]))
    message = multi(rng, ["a"])
    message.header.stamp.sec, message.header.stamp.nanosec = -2, 4_000_000_000
    data, layout = known(wire, message)
    assert layout.stamp(data) == -2_000_000_000 + 4_000_000_000


def test_whatever_is_between_the_fields_is_not_looked_at(rng):
    """A message whose padding is anything else is read as well."""
    message = multi(rng, ["a", "bb"], frame_id="")
    wire = taught(MULTI, message)
    data, layout = known(wire, message)
    # Padding is what the deserializer does not care about.
    padding = []
    for place in range(4, layout.places.first_number):
        changed = bytearray(data)
        changed[place] ^= 0xFF
        try:
            if deserialize_message(bytes(changed), MultiDOFJointState) == message:
                padding.append(place)
        except Exception:  # noqa: BLE001 - the middleware raises whatever it likes
            continue
    assert padding
    for value in range(256):
        changed = bytearray(data)
        for place in padding:
            changed[place] = value
        batch = wire.find(bytes(changed)).poses(bytes(changed))
        assert_same(batch, poses_from_multi_dof_joint_state(message))


def test_another_order_of_bytes_is_left_to_the_ordinary_way():
    """Poses that read the same in both orders teach nothing about later ones that don't."""
    zeros = MultiDOFJointState(joint_names=["a"], transforms=[Transform()])
    zeros.transforms[0].rotation.w = 0.0
    data = bytearray(serialize_message(zeros))
    data[1] = 0
    wire = wire_of(MULTI)
    for _ in range(3):
        wire.learn(bytes(data), zeros)
    assert wire.find(bytes(data)) is None


def test_a_name_that_the_deserializer_replaced_is_left_to_it(rng):
    """Bytes that are no UTF-8 come back as other characters, of another length."""
    message = multi(rng, ["abc"])
    data = serialize_message(message).replace(b"abc\0", b"a\xffc\0")
    read = deserialize_message(data, MultiDOFJointState)
    wire = wire_of(MULTI)
    for _ in range(3):
        wire.learn(data, read)
    assert wire.find(data) is None


@pytest.mark.parametrize("pose_type", CLASSES)
def test_learning_has_the_middleware_print_nothing(pose_type, capfd):
    """It complains of counts beyond a message's end: no trial changes one, whatever its place."""
    rng = np.random.default_rng(5)
    for length in range(1, 12):
        for count in (1, 2, 3):
            kind = CLASSES[pose_type]
            message = kind()
            names = [f"{k:0{length}}"[-length:] for k in range(count)]
            message.header.frame_id = "w" * length
            if kind is MultiDOFJointState:
                message.joint_names = names
                message.transforms = [transform(rng) for _ in names]
            elif kind is JointState:
                message.name = names
                message.position = rng.normal(size=count).tolist()
            taught(pose_type, message)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("names", [1, 2, 3, 7])
@pytest.mark.parametrize("positions", [1, 2, 3, 7, 8])
def test_learning_positions_without_names_prints_nothing(capfd, names, positions):
    """Joint states with more or fewer positions than names, which somebody sends twice."""
    message = JointState(name=[f"joint_{i}" for i in range(names)], position=[0.5] * positions)
    taught("sensor_msgs/msg/JointState", message, message)
    assert capfd.readouterr().err == ""

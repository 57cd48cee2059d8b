"""Pose wires that have seen messages, and what they are compared with."""

from __future__ import annotations

from geometry_msgs.msg import PoseStamped, Quaternion, Transform, TransformStamped, Vector3
import numpy as np
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState, MultiDOFJointState

from msg_adapters.wire.poses import PoseWire

MULTI = "sensor_msgs/msg/MultiDOFJointState"


CLASSES = {
    MULTI: MultiDOFJointState,
    "sensor_msgs/msg/JointState": JointState,
    "geometry_msgs/msg/PoseStamped": PoseStamped,
    "geometry_msgs/msg/TransformStamped": TransformStamped,
}


STAMP = 1_234_567_890_987_654_321


def transform(rng):
    """Return a transform with seven distinct numbers and a unit quaternion."""
    p, q = rng.normal(size=3), rng.normal(size=4)
    q /= np.linalg.norm(q)
    return Transform(
        translation=Vector3(**dict(zip("xyz", p.tolist(), strict=True))),
        rotation=Quaternion(**dict(zip("xyzw", q.tolist(), strict=True))),
    )


def wire_of(pose_type, serialize=serialize_message):
    """Return a wire that knows nothing yet."""
    return PoseWire(pose_type, serialize)


def taught(pose_type, *messages):
    """Return a wire that has seen each message twice."""
    wire = wire_of(pose_type)
    for message in messages * 2:
        data = serialize_message(message)
        if wire.find(data) is None:
            wire.learn(data, message)
    return wire


def known(wire, message):
    """Return the bytes of a message and its layout, which must be known.

    The serializer leaves anything between fields, which it may take a few messages to see.
    """
    for _ in range(20):
        data = serialize_message(message)
        layout = wire.find(data)
        if layout is not None:
            return data, layout
        wire.learn(data, message)
    raise AssertionError("the message is not known")


def assert_same(batch, expected):
    """Compare everything in two batches of poses, to the last bit."""
    assert batch.names == expected.names
    assert batch.parents == expected.parents
    assert batch.stamps_ns.tolist() == expected.stamps_ns.tolist()
    np.testing.assert_array_equal(batch.X_PF, expected.X_PF)
    assert batch.refused == expected.refused


class Target:
    """Rows to place poses in, more than there are and in another order than those."""

    def __init__(self, count):
        self.rows = np.arange(count, 0, -1)
        self.X_PF = np.full((count + 2, 4, 4), 7.0)
        self.stamps = np.full(count + 2, STAMP)

    def place(self, layout, data, earliest=STAMP, latest=STAMP + 100):
        """Place the poses of a message."""
        limits = (STAMP + 50, earliest, latest)
        return layout.place_poses(data, self.rows, limits, self.X_PF, self.stamps)

    @property
    def is_untouched(self):
        """Whether nothing was written."""
        return bool(np.all(self.X_PF == 7.0) and np.all(self.stamps == STAMP))


def assert_places(layout, data, expected):
    """Compare the poses that are placed in one go with a batch, to the last bit."""
    target = Target(len(expected.names))
    assert target.place(layout, data)
    assert target.X_PF[target.rows].tobytes() == expected.X_PF.tobytes()
    assert target.stamps[target.rows].tolist() == expected.stamps_ns.tolist()
    assert np.all(target.X_PF[[0, -1]] == 7.0)
    assert np.all(target.stamps[[0, -1]] == STAMP)

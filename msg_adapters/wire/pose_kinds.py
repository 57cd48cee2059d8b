"""The fields read from each message type of poses, and how messages for probing are made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from sensor_msgs.msg import JointState, MultiDOFJointState
from std_msgs.msg import Header

__all__ = ["POSE_KINDS", "PoseKind"]


class PoseKind(NamedTuple):
    """The fields read from a message type, and how a message of it is made for probing."""

    width: int
    names: Callable[[Any], Sequence[str]]
    parents: Callable[[Any], Sequence[str]]
    stamps: Callable[[Any], Sequence[Any]]
    numbers: Callable[[Any], Any]
    probe: Callable[[Any, Any, float], Any]
    """(message, stamp, number) -> one of the same names with these in all their places."""


def _pose_numbers(position: Any, rotation: Any) -> tuple[float, ...]:
    return (position.x, position.y, position.z, rotation.x, rotation.y, rotation.z, rotation.w)


def _header(header: Any, stamp: Any) -> Header:
    return Header(stamp=stamp, frame_id=header.frame_id)


def _transform(number: float) -> Transform:
    return Transform(
        translation=Vector3(x=number, y=number, z=number),
        rotation=Quaternion(x=number, y=number, z=number, w=number),
    )


def _pose(number: float) -> Pose:
    t = _transform(number)
    return Pose(position=Point(x=number, y=number, z=number), orientation=t.rotation)


def _stamped(message: Any, stamp: Any, number: float) -> TransformStamped:
    return TransformStamped(
        header=_header(message.header, stamp),
        child_frame_id=message.child_frame_id,
        transform=_transform(number),
    )


_MULTI = PoseKind(
    7,
    lambda m: m.joint_names,
    lambda m: [m.header.frame_id] * len(m.joint_names),
    lambda m: [m.header.stamp],
    lambda m: [_pose_numbers(t.translation, t.rotation) for t in m.transforms],
    lambda m, stamp, x: MultiDOFJointState(
        header=_header(m.header, stamp),
        joint_names=m.joint_names,
        transforms=[_transform(x)] * len(m.transforms),
        twist=m.twist,
        wrench=m.wrench,
    ),
)
_JOINTS = PoseKind(
    1,
    lambda m: m.name,
    lambda m: [""] * len(m.name),
    lambda m: [m.header.stamp],
    lambda m: m.position,
    lambda m, stamp, x: JointState(
        header=_header(m.header, stamp),
        name=m.name,
        position=[x] * len(m.position),
        velocity=m.velocity,
        effort=m.effort,
    ),
)
_POSE = PoseKind(
    7,
    lambda m: [""],
    lambda m: [m.header.frame_id],
    lambda m: [m.header.stamp],
    lambda m: [_pose_numbers(m.pose.position, m.pose.orientation)],
    lambda m, stamp, x: PoseStamped(header=_header(m.header, stamp), pose=_pose(x)),
)
_TRANSFORM = PoseKind(
    7,
    lambda m: [m.child_frame_id],
    lambda m: [m.header.frame_id],
    lambda m: [m.header.stamp],
    lambda m: [_pose_numbers(m.transform.translation, m.transform.rotation)],
    _stamped,
)
_TF = PoseKind(
    7,
    lambda m: [t.child_frame_id for t in m.transforms],
    lambda m: [t.header.frame_id for t in m.transforms],
    lambda m: [t.header.stamp for t in m.transforms],
    lambda m: [_pose_numbers(t.transform.translation, t.transform.rotation) for t in m.transforms],
    lambda m, stamp, x: type(m)(transforms=[_stamped(t, stamp, x) for t in m.transforms]),
)

POSE_KINDS: dict[str, PoseKind] = {
    "sensor_msgs/msg/MultiDOFJointState": _MULTI,
    "sensor_msgs/msg/JointState": _JOINTS,
    "geometry_msgs/msg/PoseStamped": _POSE,
    "geometry_msgs/msg/TransformStamped": _TRANSFORM,
    "tf2_msgs/msg/TFMessage": _TF,
}

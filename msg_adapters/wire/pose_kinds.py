"""The fields read from each message type of poses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

__all__ = ["POSE_KINDS", "PoseKind"]


class PoseKind(NamedTuple):
    """The fields read from a message type."""

    names: Callable[[Any], Sequence[str]]
    parents: Callable[[Any], Sequence[str]]
    numbers: tuple[str, ...]
    """The paths (see ``wire.layout``) of position and rotation, or of positions of joints."""
    width: int = 7
    """How many numbers each name has."""
    stamps: str = "header.stamp.sec"
    """The path of the stamps: one, or one of each name."""


POSE_KINDS: dict[str, PoseKind] = {
    "sensor_msgs/msg/MultiDOFJointState": PoseKind(
        lambda m: m.joint_names,
        lambda m: [m.header.frame_id] * len(m.joint_names),
        ("transforms.translation", "transforms.rotation"),
    ),
    "sensor_msgs/msg/JointState": PoseKind(
        lambda m: m.name, lambda m: [""] * len(m.name), ("position",), width=1
    ),
    "geometry_msgs/msg/PoseStamped": PoseKind(
        lambda m: [""], lambda m: [m.header.frame_id], ("pose.position", "pose.orientation")
    ),
    "geometry_msgs/msg/TransformStamped": PoseKind(
        lambda m: [m.child_frame_id],
        lambda m: [m.header.frame_id],
        ("transform.translation", "transform.rotation"),
    ),
    "tf2_msgs/msg/TFMessage": PoseKind(
        lambda m: [t.child_frame_id for t in m.transforms],
        lambda m: [t.header.frame_id for t in m.transforms],
        ("transforms.transform.translation", "transforms.transform.rotation"),
        stamps="transforms.header.stamp.sec",
    ),
}

"""Topics that move sources: one channel for each that a source has of a kind.

Messages stay bytes until the next update.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from rclpy.node import Node

from msg_adapters.errors import MessageError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.runtime.names import BASE_TYPES, POSE_TOPICS
from scene_graph_ros.node.world.imported_types import imported_type
from scene_graph_ros.node.world.intake import Intake, SourceFrames
from scene_graph_ros.node.world.queued_channel import QUEUED, QueuedChannel
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Inputs
from scene_graph_ros.node.world.source_topics import (
    base_topic,
    DEFAULT_POSE_TYPE,
    joint_pose_topic,
    JOINT_STATE,
    TF,
)
from scene_graph_ros.node.world.world import World

__all__ = ["BASE_POSES", "JOINT_POSES", "POSES", "PoseInputs", "make_channel", "message_type"]

POSES = "poses"
BASE_POSES = "base poses"
JOINT_POSES = "joint poses"


def message_type(name: str) -> Any:
    """Import the message class of a pose input such as ``geometry_msgs/msg/PoseStamped``.

    Raises MessageError for a type that is no pose input, UnavailableError where its package is
    not installed.
    """
    if name not in POSE_TOPICS and name not in BASE_TYPES:
        known = ", ".join(POSE_TOPICS)
        raise MessageError(f"pose_type must be one of {known}, not {quoted(name)}")
    return imported_type(name)


def make_channel(
    noun: str, record: SourceRecord, warn: Callable[[str], None], world_frame: str
) -> QueuedChannel:
    """Make the channel of a source's POSES, BASE_POSES or JOINT_POSES.

    Imports the reader of the type. Raises UnavailableError where the type is not there.
    """
    if noun == JOINT_POSES:
        from scene_graph_ros.node.world.joint_pose_channel import JointPoseChannel

        kind = message_type(DEFAULT_POSE_TYPE)
        return JointPoseChannel(record, Intake(record.name, warn), kind, world_frame)
    type_name = record.pose_type if noun == POSES else record.robot.moving_base.type or TF
    kind = message_type(type_name)
    intake = Intake(record.name, warn, unknown_is_normal=type_name == TF)
    if noun == BASE_POSES:
        from scene_graph_ros.node.world.base_channel import BaseChannel, TfBaseChannel

        if type_name == TF:
            return TfBaseChannel(record, intake, kind)
        return BaseChannel(record, intake, kind, world_frame)
    if type_name == TF:
        from scene_graph_ros.node.world.tf_channel import TfChannel

        return TfChannel(record, intake, kind)
    if type_name == JOINT_STATE:
        from scene_graph_ros.node.world.joint_channel import JointChannel

        return JointChannel(record, intake, kind)
    from scene_graph_ros.node.world.pose_channel import PoseChannel

    return PoseChannel(record, intake, kind)


_IS_WANTED: dict[str, Callable[[SourceRecord], object]] = {
    POSES: lambda record: record.pose_type,
    BASE_POSES: base_topic,
    JOINT_POSES: joint_pose_topic,
}


class PoseInputs(Inputs[QueuedChannel]):
    """All subscriptions of the node to one of POSES, BASE_POSES and JOINT_POSES."""

    def __init__(
        self,
        node: Node,
        world: World,
        group: OwnThreadGroup,
        on_change: Callable[[], None],
        noun: str = POSES,
    ) -> None:
        """Call ``on_change`` when there is another subscription."""
        super().__init__(node, world, group, on_change, noun=noun, queued=QUEUED)

    def forget(self, after: int) -> None:
        """Forget messages in channels that are stamped later (ns): the clock jumped back."""
        for channel in self.channels:
            channel.forget(after)

    def _wanted(self) -> Iterable[str]:
        records, is_wanted = self._world.snapshot.records, _IS_WANTED[self.noun]
        return [name for name, record in records.items() if is_wanted(record)]

    def _target(self, name: str) -> SourceFrames:
        return self._world.frames(name)

    def _make(self, record: SourceRecord) -> QueuedChannel:
        return make_channel(self.noun, record, self._warn, self._world.world_frame)

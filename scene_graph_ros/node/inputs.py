"""Pose topics: one subscription per source; messages stay bytes until the next update.

A callback only stores the bytes. At the update the newest message of each source is decoded;
older ones are decoded, too, where the newest does not cover all that the source moves, so that
partial messages are never lost.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import importlib
import time
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from msg_adapters.errors import MessageError, UnavailableError
from msg_adapters.poses import (
    joints_from_msg,
    PoseBatch,
    poses_from_multi_dof_joint_state,
    poses_from_pose_stamped,
    poses_from_tf,
    poses_from_transform_stamped,
)
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.node.intake import Fault, Intake, SourceFrames, TimeLimits
from scene_graph_ros.node.names import default_pose_topic, POSE_TOPICS
from scene_graph_ros.node.qos import overridable, pose_qos
from scene_graph_ros.node.world import SourceRecord, World

__all__ = ["PoseInputs", "message_type"]

_QUEUED = 64
"""Messages of a source kept between two updates; at 1 kHz and 30 updates/s half of it is used."""

JOINT_STATE = "sensor_msgs/msg/JointState"
TF = "tf2_msgs/msg/TFMessage"


def message_type(name: str) -> Any:
    """Import the message class of a pose input such as ``geometry_msgs/msg/PoseStamped``.

    Raises MessageError for a type that is no pose input, UnavailableError where its package is
    not installed.
    """
    if name not in POSE_TOPICS:
        known = ", ".join(POSE_TOPICS)
        raise MessageError(f"pose_type must be one of {known}, not '{name}'")
    package, _, kind = name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), kind)
    except ModuleNotFoundError as error:
        raise UnavailableError(f"{package} is not installed, so no {name} can be read") from error


@dataclass
class _Queued:
    data: bytes
    arrival: int


class _Channel:
    """The pose topic of one source."""

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any) -> None:
        self.record = record
        self.intake = intake
        self.kind = kind
        self.queue: deque[_Queued] = deque(maxlen=_QUEUED)
        self.subscription: Any = None
        self.topic = ""
        self._link_frames: tuple[str, ...] = ()
        self._link_frames_of: SourceFrames | None = None

    def decode(self, queued: _Queued) -> Any:
        """Return the message, or None where the bytes are not one."""
        try:
            return deserialize_message(queued.data, self.kind)
        except Exception as error:  # noqa: BLE001 - the middleware raises whatever it likes
            self.intake.fault(Fault.MALFORMED, "", f"a message can't be read: {error}")
            return None

    def take(self) -> list[_Queued]:
        """Take all stored messages, oldest first."""
        taken = []
        while self.queue:
            taken.append(self.queue.popleft())
        return taken

    def apply(self, messages: list[Any], frames: SourceFrames, limits: TimeLimits) -> int:
        """Apply messages, oldest first; return how many poses were taken over."""
        applied = 0
        for message in messages:
            try:
                applied += self._apply_one(message, frames, limits)
            except SceneGraphError as error:
                self.intake.fault(Fault.MALFORMED, "", str(error))
        return applied

    def _apply_one(self, message: Any, frames: SourceFrames, limits: TimeLimits) -> int:
        if self.record.pose_type == JOINT_STATE:
            return self._apply_joints(message, frames, limits)
        return self.intake.accept(self._poses(message, frames), frames, limits)

    def _poses(self, message: Any, frames: SourceFrames) -> PoseBatch:
        match self.record.pose_type:
            case "sensor_msgs/msg/MultiDOFJointState":
                return poses_from_multi_dof_joint_state(message)
            case "geometry_msgs/msg/TransformStamped":
                return poses_from_transform_stamped(message)
            case "geometry_msgs/msg/PoseStamped":
                return poses_from_pose_stamped(message, _only_frame(frames))
        return poses_from_tf(message)

    def _apply_joints(self, message: Any, frames: SourceFrames, limits: TimeLimits) -> int:
        joints = joints_from_msg(message)
        for refused in joints.refused:
            self.intake.fault(Fault.NOT_FINITE, refused.name, refused.message)
        if not joints.names or not self.intake.in_time(joints.stamp_ns, frames, limits):
            return 0
        kinematics = self.record.robot.kinematics
        links, X_PL = kinematics.link_poses(joints.names, joints.positions)
        for name in kinematics.unknown_joints:
            self.intake.fault(Fault.UNKNOWN_FRAME, name, "the robot has no such joint")
        if frames is not self._link_frames_of:
            self._link_frames = _frame_names(self.record.robot, links, frames)
            self._link_frames_of = frames
        return self.intake.accept_poses(self._link_frames, X_PL, joints.stamp_ns, frames, limits)

    def covers(self, message: Any, frames: SourceFrames) -> bool:
        """Tell whether ``message`` alone moves all that the source moves."""
        match self.record.pose_type:
            case "sensor_msgs/msg/MultiDOFJointState":
                return frames.rows.keys() <= set(message.joint_names)
            case "sensor_msgs/msg/JointState":
                return _independent_joints(self.record.robot) <= set(message.name)
            case "geometry_msgs/msg/PoseStamped":
                return True
            case "geometry_msgs/msg/TransformStamped":
                return frames.rows.keys() <= {message.child_frame_id}
        return frames.rows.keys() <= {t.child_frame_id for t in message.transforms}


def _only_frame(frames: SourceFrames) -> str:
    if len(frames.names) != 1:
        raise MessageError(
            f"PoseStamped moves a source with one frame; '{frames.source}' has "
            f"{len(frames.names)}: {list(frames.names)}"
        )
    return frames.names[0]


def _independent_joints(robot: Any) -> set[str]:
    joints = robot.kinematics.robot.joints
    return {name for name in robot.kinematics.joint_names if joints[name].mimic is None}


def _frame_names(robot: Any, links: Sequence[str], frames: SourceFrames) -> tuple[str, ...]:
    """Return the name of each link's frame, that of the link where the frame was removed."""
    rows = [frames.row_of_id.get(robot.link_frames[link]) for link in links]
    return tuple(
        link if row is None else frames.names[row] for link, row in zip(links, rows, strict=True)
    )


class PoseInputs:
    """All pose subscriptions of the node."""

    def __init__(
        self, node: Node, world: World, group: CallbackGroup, on_message: Callable[[], None]
    ) -> None:
        self._node = node
        self._world = world
        self._group = group
        self._on_message = on_message
        self._channels: dict[str, _Channel] = {}

    @property
    def channels(self) -> Mapping[str, Any]:
        """Channels by name of the source; each has ``topic``, ``record`` and ``intake``."""
        return dict(self._channels)

    def refresh(self) -> None:
        """Subscribe for new sources, unsubscribe for removed ones."""
        records = self._world.records
        for name, channel in list(self._channels.items()):
            record = records.get(name)
            if record is None or record != channel.record:
                del self._channels[name]
                if channel.subscription is not None:
                    self._node.destroy_subscription(channel.subscription)
        for name, record in records.items():
            if name not in self._channels and record.pose_type:
                self._channels[name] = self._open(record)

    def close(self) -> None:
        """Unsubscribe from everything."""
        for channel in self._channels.values():
            self._node.destroy_subscription(channel.subscription)
        self._channels.clear()

    def discard(self) -> None:
        """Forget messages that have not been applied yet."""
        for channel in list(self._channels.values()):
            channel.take()

    def collect(self, limits: TimeLimits) -> tuple[set[str], int | None]:
        """Write what has arrived into the world's frames; hold the world's lock.

        Returns the sources that moved and the steady time when the oldest applied message
        arrived.
        """
        moved, arrivals = set(), []
        for name, channel in list(self._channels.items()):
            queued = channel.take()
            if not queued or name not in self._world.records:
                continue
            frames = self._world.frames(name)
            messages = self._needed(channel, queued, frames)
            if channel.apply(messages, frames, limits):
                moved.add(name)
                arrivals.append(queued[-len(messages)].arrival)
        return moved, min(arrivals, default=None)

    def _needed(self, channel: _Channel, queued: list[_Queued], frames: SourceFrames) -> list[Any]:
        newest = channel.decode(queued[-1])
        if len(queued) == 1 or (newest is not None and channel.covers(newest, frames)):
            channel.intake.statistics.superseded += len(queued) - 1
            return [] if newest is None else [newest]
        older = [channel.decode(entry) for entry in queued[:-1]]
        return [message for message in (*older, newest) if message is not None]

    def _open(self, record: SourceRecord) -> _Channel:
        kind = message_type(record.pose_type)
        logger = self._node.get_logger()
        intake = Intake(
            record.name,
            logger.warning,
            unknown_is_normal=record.pose_type == TF,
        )
        channel = _Channel(record, intake, kind)

        self._subscribe(channel, pose_qos(_QUEUED), overridable())
        return channel

    def _subscribe(self, channel: _Channel, qos: QoSProfile, options: Any = None) -> None:
        record = channel.record
        topic = record.pose_topic or default_pose_topic(record.name, record.pose_type)

        def store(data: bytes) -> None:
            arrival = time.monotonic_ns()
            channel.intake.statistics.arrived(arrival)
            if len(channel.queue) == _QUEUED:
                channel.intake.statistics.superseded += 1
            channel.queue.append(_Queued(data, arrival))
            self._on_message()

        channel.subscription = self._node.create_subscription(
            channel.kind,
            topic,
            store,
            qos,
            callback_group=self._group,
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=lambda event: self._on_incompatible(channel)
            ),
            raw=True,
            qos_overriding_options=options,
        )
        channel.topic = channel.subscription.topic_name

    def _on_incompatible(self, channel: _Channel) -> None:
        """Take what a best effort publisher offers; say so where that does not help either."""
        logger = self._node.get_logger()
        old = channel.subscription
        if old.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT:
            logger.warning(f"{channel.topic}: a publisher's quality of service does not fit")
            return
        logger.info(f"{channel.topic}: a publisher offers best effort only, so that is taken")
        qos = pose_qos(old.qos_profile.depth, is_reliable=False)
        self._subscribe(channel, qos)
        self._node.destroy_subscription(old)

"""Pose topics: one subscription per source; messages stay bytes until the next update.

Of messages with the same names, and the same of all else but stamps and numbers, only the newest
is read; messages with other names are read beside it, so that partial ones are never lost. They
are read by the layout of their bytes where that is known, else by the ordinary deserializer.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
import importlib
import threading
from typing import Any

from rclpy.node import Node
from rclpy.serialization import serialize_message

from msg_adapters.errors import MessageError, UnavailableError
from msg_adapters.poses import (
    JointBatch,
    joints_from_msg,
    PoseBatch,
    poses_from_multi_dof_joint_state,
    poses_from_pose_stamped,
    poses_from_tf,
    poses_from_transform_stamped,
)
from msg_adapters.wire.poses import Layout, PoseWire
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.runtime.names import POSE_TOPICS
from scene_graph_ros.node.world.intake import (
    Fault,
    Intake,
    SourceFrames,
    TimeLimits,
)
from scene_graph_ros.node.world.message_sizes import most_bytes
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Inputs, Kept, SourceChannel
from scene_graph_ros.node.world.source_topics import pose_topic
from scene_graph_ros.node.world.world import World

__all__ = ["TF", "Channel", "PoseInputs", "message_type"]

_QUEUED = 64
"""Messages of unknown layout kept per source; also how many the middleware may hold."""

_QUEUED_BYTES = 1 << 18
"""Their bytes together, unless one has more: to read them takes a tenth of a second."""

_UNSORTED_BYTES = 1 << 22
"""Bytes that may arrive of a source before those that need not be read are dropped."""

JOINT_STATE = "sensor_msgs/msg/JointState"
POSE_STAMPED = "geometry_msgs/msg/PoseStamped"
TF = "tf2_msgs/msg/TFMessage"


def message_type(name: str) -> Any:
    """Import the message class of a pose input such as ``geometry_msgs/msg/PoseStamped``.

    Raises MessageError for a type that is no pose input, UnavailableError where its package is
    not installed.
    """
    if name not in POSE_TOPICS:
        known = ", ".join(POSE_TOPICS)
        raise MessageError(f"pose_type must be one of {known}, not {quoted(name)}")
    package, _, kind = name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), kind)
    except ModuleNotFoundError as error:
        raise UnavailableError(f"{package} is not installed, so no {name} can be read") from error


@dataclass(eq=False, slots=True)
class _Reading(Kept):
    """A message whose layout was looked for; None where it is not known."""

    layout: Layout | None
    is_good: bool | None = None
    """Whether there is nothing against any of its numbers; None before it was looked at."""

    def is_clean(self) -> bool:
        """Tell whether its layout is known, and nothing is against any of its numbers."""
        if self.is_good is None:
            self.is_good = self.layout is not None and self.layout.is_clean(self.data)
        return self.is_good


class _ToRead:
    """Which of some messages are to be read: those that no other one supersedes."""

    def __init__(self, supersedes: Callable[[_Reading, _Reading], bool]) -> None:
        self._supersedes = supersedes
        self._newest: dict[Layout, _Reading] = {}
        self._loose: deque[_Reading] = deque()
        self._loose_bytes = 0
        self.readings: dict[_Reading, None] = {}
        self.dropped = 0

    def add(self, reading: _Reading) -> None:
        """Take a message, which came after the others."""
        layout = reading.layout
        if layout is not None:
            older = self._newest.get(layout)
            if older is None or self._supersedes(reading, older):
                self._newest[layout] = reading
                if older is not None:
                    self._drop(older)
                self.readings[reading] = None
                return
        # Not known, faulty or out of order: to be looked at for itself.
        self._make_room(len(reading.data))
        self._loose.append(reading)
        self._loose_bytes += len(reading.data)
        self.readings[reading] = None

    def _make_room(self, size: int) -> None:
        """Drop the oldest messages of unknown layout that are too many, or too long together."""
        while self._loose and (
            len(self._loose) == _QUEUED or self._loose_bytes + size > _QUEUED_BYTES
        ):
            oldest = self._loose.popleft()
            self._loose_bytes -= len(oldest.data)
            self._drop(oldest)

    def _drop(self, reading: _Reading) -> None:
        del self.readings[reading]
        self.dropped += 1


class Channel(SourceChannel[_Reading, SourceFrames]):
    """The pose topic of one source."""

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any) -> None:
        super().__init__(record, intake, kind)
        self._wire = PoseWire(record.pose_type, serialize_message, self._deserialize)
        self._lock = threading.Lock()
        self._begin()
        self._frames: SourceFrames | None = None
        self._only_names: tuple[str, ...] = ()
        self._only_names_of: SourceFrames | None = None
        self._link_frames: tuple[str, ...] = ()
        self._link_frames_of: SourceFrames | None = None

    def _begin(self) -> None:
        """Have no messages, and room for some."""
        self._kept: list[Kept] = []
        self._bytes = 0
        self._most, self._most_bytes = _QUEUED, _UNSORTED_BYTES

    @property
    def wanted_topic(self) -> str:
        """Name of the topic, before namespaces and remapping."""
        return pose_topic(self.record)

    def store(self, data: bytes, arrival: int) -> None:
        """Keep a message that arrived at a steady time (ns); it is looked at in the update."""
        self.intake.statistics.arrived(arrival)
        with self._lock:
            self._kept.append(Kept(data, arrival))
            self._bytes += len(data)
            if len(self._kept) >= self._most or self._bytes > self._most_bytes:
                self._drop_superseded()

    def _drop_superseded(self) -> None:
        """Keep what is worth reading alone, and have room for as many more."""
        self._kept = list(self._worth_reading(self._kept))
        self._bytes = sum(len(message.data) for message in self._kept)
        self._most = max(_QUEUED, 2 * len(self._kept))
        self._most_bytes = max(_UNSORTED_BYTES, 2 * self._bytes)

    def take(self) -> list[Kept]:
        """Take all messages that were kept, oldest first."""
        with self._lock:
            taken = self._kept
            if taken:
                self._begin()
        return taken

    def _worth_reading(self, kept: list[Kept]) -> list[_Reading]:
        """Return which messages are to be read, and count the others."""
        if len(kept) == 1:
            return [self._reading(kept[0])]
        to_read = _ToRead(self._supersedes)
        for message in kept:
            to_read.add(self._reading(message))
        self.intake.statistics.superseded += to_read.dropped
        return list(to_read.readings)

    def _reading(self, message: Kept) -> _Reading:
        if isinstance(message, _Reading):
            return message
        return _Reading(message.data, message.arrival, self._wire.find(message.data))

    def _supersedes(self, newer: _Reading, older: _Reading) -> bool:
        """Tell whether nothing is lost without ``older``, which has the same layout.

        A faulty message is not dropped, so that it is counted, and drops nothing, so that the
        good poses before it hold.
        """
        layout, frames = newer.layout, self._frames
        assert layout is not None
        if frames is None or 0 < layout.stamp(newer.data) < layout.stamp(older.data):
            return False
        return self._takes_all(layout, frames) and newer.is_clean() and older.is_clean()

    def _takes_all(self, layout: Layout, frames: SourceFrames) -> bool:
        if self.record.pose_type == JOINT_STATE:
            return set(layout.names) <= set(self.record.robot.kinematics.joint_names)
        if self.record.pose_type == POSE_STAMPED and len(frames.names) != 1:
            return False
        return self.intake.takes_all(self._names(layout, frames), layout.parents, frames)

    def _apply_one(self, kept: _Reading, frames: SourceFrames, limits: TimeLimits) -> int:
        self._frames = frames
        layout, data = kept.layout, kept.data
        if layout is None or not layout.has_times(data):
            return self._apply_message(data, frames, limits)
        if self.record.pose_type == JOINT_STATE:
            return self._apply_joints(layout.joints(data), frames, limits)
        names = self._names(layout, frames)
        applied = self.intake.accept_bytes(data, layout, names, frames, limits)
        if applied is None:
            applied = self.intake.accept(layout.poses(data, names), frames, limits)
        return applied

    def _names(self, layout: Layout, frames: SourceFrames) -> tuple[str, ...]:
        """Return the names of the frames that a message moves."""
        if self.record.pose_type != POSE_STAMPED:
            return layout.names
        if frames is not self._only_names_of:
            self._only_names, self._only_names_of = _only_frame(frames), frames
        return self._only_names

    def _apply_message(self, data: bytes, frames: SourceFrames, limits: TimeLimits) -> int:
        """Read a message the ordinary way, and learn from it."""
        robot = self.record.robot
        known = frames.names if robot is None else robot.kinematics.joint_names
        message = self._read(data, most_bytes(len(known)))
        if self.record.pose_type == JOINT_STATE:
            applied = self._apply_joints(joints_from_msg(message), frames, limits)
        else:
            applied = self.intake.accept(self._poses(message, frames), frames, limits)
        self._wire.learn(data, message)
        return applied

    def _poses(self, message: Any, frames: SourceFrames) -> PoseBatch:
        match self.record.pose_type:
            case "sensor_msgs/msg/MultiDOFJointState":
                return poses_from_multi_dof_joint_state(message)
            case "geometry_msgs/msg/TransformStamped":
                return poses_from_transform_stamped(message)
            case "geometry_msgs/msg/PoseStamped":
                return poses_from_pose_stamped(message, *_only_frame(frames))
        return poses_from_tf(message)

    def _apply_joints(self, joints: JointBatch, frames: SourceFrames, limits: TimeLimits) -> int:
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


def _only_frame(frames: SourceFrames) -> tuple[str]:
    if len(frames.names) != 1:
        raise MessageError(
            f"PoseStamped moves a source with one frame; {quoted(frames.source)} has "
            f"{len(frames.names)}: {quoted(list(frames.names))}"
        )
    return (frames.names[0],)


def _frame_names(robot: Any, links: Sequence[str], frames: SourceFrames) -> tuple[str, ...]:
    """Return the name of each link's frame, that of the link where the frame was removed."""
    rows = [frames.row_of_id.get(robot.link_frames[link]) for link in links]
    return tuple(
        link if row is None else frames.names[row] for link, row in zip(links, rows, strict=True)
    )


class PoseInputs(Inputs[Channel]):
    """All pose subscriptions of the node."""

    def __init__(
        self, node: Node, world: World, group: OwnThreadGroup, on_change: Callable[[], None]
    ) -> None:
        """Call ``on_change`` when a subscription is replaced by another."""
        super().__init__(node, world, group, on_change, noun="poses", queued=_QUEUED)

    def _wanted(self) -> list[str]:
        return [name for name, r in self._world.snapshot.records.items() if r.pose_type]

    def _target(self, name: str) -> SourceFrames:
        return self._world.frames(name)

    def _make(self, record: SourceRecord) -> Channel:
        kind = message_type(record.pose_type)
        is_tf = record.pose_type == TF
        return Channel(record, Intake(record.name, self._warn, unknown_is_normal=is_tf), kind)

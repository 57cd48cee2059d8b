"""Poses of a source's frames, in the parents that they were registered with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from msg_adapters.errors import MessageError
from msg_adapters.poses import (
    PoseBatch,
    poses_from_multi_dof_joint_state,
    poses_from_pose_stamped,
    poses_from_transform_stamped,
)
from msg_adapters.wire.poses import Layout
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.intake import Intake, SourceFrames
from scene_graph_ros.node.world.queued_channel import QueuedChannel, Reading
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Kept
from scene_graph_ros.node.world.source_topics import POSE_STAMPED, pose_topic, TRANSFORM_STAMPED
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["PoseChannel"]


class PoseChannel(QueuedChannel):
    """The pose topic of one source."""

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any) -> None:
        super().__init__(record, intake, kind, record.pose_type)
        self._only_names: tuple[str, ...] = ()
        self._only_names_of: SourceFrames | None = None

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {pose_topic(self.record): False}

    def apply(self, kept: list[Kept], target: SourceFrames, limits: TimeLimits) -> int | None:
        """Apply messages; where frames came or went, names are looked up anew."""
        if target is not self._only_names_of:
            self._only_names, self._only_names_of = (), target
        return super().apply(kept, target, limits)

    def _takes_all(self, layout: Layout, frames: SourceFrames) -> bool:
        if self.record.pose_type == POSE_STAMPED and len(frames.names) != 1:
            return False
        return self.intake.takes_all(self._names(layout, frames), layout.parents, frames)

    def _apply_layout(
        self, kept: Reading, layout: Layout, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        names, is_static = self._names(layout, frames), kept.is_static
        applied = self.intake.accept_bytes(
            kept.data, layout, names, frames, limits, is_static=is_static
        )
        if applied is None:
            poses = layout.poses(kept.data, names)
            applied = self.intake.accept(poses, frames, limits, is_static=is_static)
        return applied

    def _names(self, layout: Layout, frames: SourceFrames) -> tuple[str, ...]:
        """Return the names of the frames that a message moves."""
        if self.record.pose_type != POSE_STAMPED:
            return layout.names
        if not self._only_names:
            self._only_names = _only_frame(frames)
        return self._only_names

    def _apply_message(
        self, kept: Reading, message: Any, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        poses = self._poses(message, frames)
        return self.intake.accept(poses, frames, limits, is_static=kept.is_static)

    def _poses(self, message: Any, frames: SourceFrames) -> PoseBatch:
        if self.record.pose_type == POSE_STAMPED:
            return poses_from_pose_stamped(message, *_only_frame(frames))
        if self.record.pose_type == TRANSFORM_STAMPED:
            return poses_from_transform_stamped(message)
        return poses_from_multi_dof_joint_state(message)


def _only_frame(frames: SourceFrames) -> tuple[str]:
    if len(frames.names) != 1:
        raise MessageError(
            f"PoseStamped moves a source with one frame; {quoted(frames.source)} has "
            f"{len(frames.names)}: {quoted(list(frames.names))}"
        )
    return (frames.names[0],)

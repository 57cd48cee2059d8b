"""Where a robot stands: poses of its base, by a topic of its own or by TF."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from msg_adapters.base_poses import base_poses_from_msg
from msg_adapters.poses import PoseBatch
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import suggestion
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake, SourceFrames
from scene_graph_ros.node.world.robot_motion import MotionIntake, RobotMotion
from scene_graph_ros.node.world.robot_pose_channel import Heard, RobotPoseChannel
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_topics import base_topic
from scene_graph_ros.node.world.tf_channel import TfReader
from scene_graph_ros.node.world.tf_tree import Placed, STATIC
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["BaseChannel", "TfBaseChannel"]


class BaseChannel(RobotPoseChannel):
    """The topic on which a robot's base moves; the part that is named is a link."""

    noun = "base poses"
    part = "base"

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any, world_frame: str) -> None:
        base = record.robot.moving_base
        super().__init__(record, intake, kind, base.type)
        self._base = base
        self._parents = {"", world_frame, base.parent}

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {base_topic(self.record): False}

    def _batch(self, message: Any) -> PoseBatch:
        return base_poses_from_msg(message)

    def _part(self, name: str) -> str:
        """Return the link that a message's name means: without one the root link."""
        prefix, robot = self._base.prefix, self._motion.robot.model
        if not name:
            return self._base.link or robot.root
        return name.removeprefix(prefix) if name not in robot.links else name

    def _problem(self, part: str, parent: str) -> tuple[Fault, str] | None:
        if parent not in self._parents:
            names = " or ".join(quoted(p) for p in sorted(self._parents - {""}))
            return Fault.WRONG_PARENT, (
                f"the pose of the base is given in {quoted(parent)}, not in {names}: name the "
                "frame as 'parent' of the base if it stands where the world does"
            )
        if part in self._motion.X_BL:
            return None
        return Fault.UNKNOWN_FRAME, self._no_base(part)

    def _move(self, part: str, X: NDArray[np.float64], heard: Heard) -> bool:
        return self._move_base(part, X, heard)

    def _no_base(self, link: str) -> str:
        model = self._motion.robot.model
        if link in model.links:
            return (
                f"the pose is of link {quoted(link)}, which joints move: it has to be of the root "
                f"link {quoted(model.root)}, or of one that is fixed to it"
            )
        return f"the pose is of {quoted(link)}, which is no link of the robot" + suggestion(
            link, list(self._motion.X_BL)
        )


class TfBaseChannel(TfReader):
    """A robot's base as TF has it."""

    noun = "base poses"

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any) -> None:
        super().__init__(record, intake, kind, base_topic(record))
        self._base = record.robot.moving_base
        self._motion: RobotMotion = record.motion  # type: ignore[assignment]
        self._judge = MotionIntake(intake, self._motion)

    def _wanted(self, frames: SourceFrames) -> Iterable[tuple[str, str]]:
        return [(self._base.prefix + self._base.link, self._base.parent)]

    def _moved(
        self, placed: Mapping[str, Placed], frames: SourceFrames, limits: TimeLimits
    ) -> bool:
        ((X, stamp),) = placed.values()
        is_static = stamp == STATIC
        return self._judge.move_base(
            X, self._base.link, limits.now if is_static else stamp, frames, is_static=is_static
        )

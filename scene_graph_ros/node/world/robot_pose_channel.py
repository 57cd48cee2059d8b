"""Poses that move parts of a robot: its base, its planar and floating joints."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from msg_adapters.poses import PoseBatch
from msg_adapters.wire.poses import Layout
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake, SourceFrames
from scene_graph_ros.node.world.queued_channel import QueuedChannel, Reading
from scene_graph_ros.node.world.robot_motion import BASE, MotionIntake, RobotMotion
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["Heard", "RobotPoseChannel"]


class Heard(NamedTuple):
    """The data that all poses of a message share."""

    stamp: int
    frames: SourceFrames
    limits: TimeLimits
    is_static: bool


class RobotPoseChannel(QueuedChannel):
    """Messages of poses, each of which moves a part of the robot unless it has a newer one."""

    part = ""
    """The word for what moves."""

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any, type_name: str) -> None:
        super().__init__(record, intake, kind, type_name)
        assert record.motion is not None
        self._motion: RobotMotion = record.motion
        self._judge = MotionIntake(intake, self._motion)

    @abstractmethod
    def _batch(self, message: Any) -> PoseBatch:
        """Return the poses of a message; raises MessageError."""

    @abstractmethod
    def _part(self, name: str) -> str:
        """Return the part that a name of a message means."""

    @abstractmethod
    def _problem(self, part: str, parent: str) -> tuple[Fault, str] | None:
        """Return the fault of any pose of a part, given in ``parent``, or None."""

    @abstractmethod
    def _move(self, part: str, X: NDArray[np.float64], heard: Heard) -> bool:
        """Move a part to a pose ``(4, 4)``; tell whether it was."""

    def _takes_all(self, layout: Layout, frames: SourceFrames) -> bool:
        named = zip(layout.names, layout.parents, strict=True)
        return all(self._problem(self._part(name), parent) is None for name, parent in named)

    def _apply_layout(
        self, kept: Reading, layout: Layout, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        return self._apply(layout.poses(kept.data), kept, frames, limits)

    def _apply_message(
        self, kept: Reading, message: Any, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        return self._apply(self._batch(message), kept, frames, limits)

    def _apply(
        self, batch: PoseBatch, kept: Reading, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        for refused in batch.refused:
            self.intake.refused(refused, noun=self.part)
        if not batch.names:
            return 0
        stamp = self._judge.time_of(int(batch.stamps_ns[0]), limits, is_static=kept.is_static)
        if stamp is None:
            return 0
        heard, moved = Heard(stamp, frames, limits, kept.is_static), 0
        for name, parent, X in zip(batch.names, batch.parents, batch.X_PF, strict=True):
            part = self._part(name)
            problem = self._problem(part, parent)
            if problem is not None:
                self.intake.fault(problem[0], part, problem[1], noun=self.part)
            else:
                moved += self._move(part, X, heard)
        return moved

    def _move_base(self, link: str, X_WL: NDArray[np.float64], heard: Heard) -> bool:
        """Put the robot where a link, which is fixed to its root link, is at ``X_WL``."""
        judge = self._judge
        if not judge.in_order([BASE], heard.stamp, heard.limits):
            return False
        return judge.move_base(X_WL, link, heard.stamp, heard.frames, is_static=heard.is_static)

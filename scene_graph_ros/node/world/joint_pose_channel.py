"""Poses of a robot's planar and floating joints, and of its virtual joint: MultiDOFJointState."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from msg_adapters.poses import PoseBatch, poses_from_multi_dof_joint_state
from msg_adapters.wire.poses import Layout
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import suggestion
from scene_graph_ros.node.world.intake import Fault, Intake, SourceFrames, TimeLimits
from scene_graph_ros.node.world.queued_channel import QueuedChannel, Reading
from scene_graph_ros.node.world.robot_motion import BASE, MotionIntake, RobotMotion
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_topics import DEFAULT_POSE_TYPE, joint_pose_topic
from scene_graph_ros.robots.kinematics import JointStateError
from scene_graph_ros.robots.robot_parts import JointType

__all__ = ["JointPoseChannel"]


class JointPoseChannel(QueuedChannel):
    """Where the child of each such joint is, relative to where it is at rest.

    A virtual joint is between the world and the root link, which the pose of it moves.
    """

    noun = "joint poses"

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any, world_frame: str) -> None:
        super().__init__(record, intake, kind, DEFAULT_POSE_TYPE)
        self._motion: RobotMotion = record.motion  # type: ignore[assignment]
        self._judge = MotionIntake(intake, self._motion)
        self._virtual = record.robot.virtual_joint
        self._known = {
            joint.name
            for joint in self._motion.robot.model.joints.values()
            if joint.type in (JointType.PLANAR, JointType.FLOATING)
        }
        self._parents = {"", world_frame}
        if self._virtual is not None:
            self._parents.add(self._virtual.parent_frame)
            self._known.add(self._virtual.name)

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {joint_pose_topic(self.record): False}

    def _takes_all(self, layout: Layout, frames: SourceFrames) -> bool:
        parents = self._parents.issuperset(layout.parents)
        return parents and self._known.issuperset(layout.names)

    def _apply_layout(
        self, kept: Reading, layout: Layout, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        return self._apply(layout.poses(kept.data), kept, frames, limits)

    def _apply_message(
        self, kept: Reading, message: Any, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        return self._apply(poses_from_multi_dof_joint_state(message), kept, frames, limits)

    def _apply(
        self, batch: PoseBatch, kept: Reading, frames: SourceFrames, limits: TimeLimits
    ) -> int:
        for refused in batch.refused:
            self.intake.refused(refused, noun="joint")
        if not batch.names:
            return 0
        stamp = self._judge.time_of(int(batch.stamps_ns[0]), limits, is_static=kept.is_static)
        if stamp is None:
            return 0
        return sum(
            self._move(name, X, stamp, frames, limits, is_static=kept.is_static)
            for name, parent, X in zip(batch.names, batch.parents, batch.X_PF, strict=True)
            if self._is_known(name, parent)
        )

    def _move(
        self,
        name: str,
        X: np.ndarray,
        stamp: int,
        frames: SourceFrames,
        limits: TimeLimits,
        *,
        is_static: bool,
    ) -> bool:
        virtual, judge = self._virtual, self._judge
        if virtual is not None and name == virtual.name:
            problem = virtual.problem(X)
            if problem:
                self.intake.fault(Fault.NOT_FINITE, name, problem, noun="joint")
                return False
            if not judge.in_order([BASE], stamp, limits):
                return False
            link = virtual.child_link
            return judge.move_base(X, link, stamp, frames, is_static=is_static)
        if not judge.in_order([name], stamp, limits):
            return False
        with self._motion.trial() as trial:
            try:
                self._motion.kinematics.set_joint_pose(name, X)
            except JointStateError as error:
                self.intake.fault(Fault.NOT_UNIT, name, str(error), noun="joint")
                return False
            trial.accepted = judge.place([name], stamp, frames, is_static=is_static)
        return trial.accepted

    def _is_known(self, name: str, parent: str) -> bool:
        virtual = self._virtual
        if virtual is not None and name == virtual.name and parent not in self._parents:
            text = f"the pose is given in {quoted(parent)}, not in {quoted(virtual.parent_frame)}"
            self.intake.fault(Fault.WRONG_PARENT, name, text, noun="joint")
            return False
        if name in self._known:
            return True
        joint = self._motion.robot.model.joints.get(name)
        if joint is not None:
            text = f"the joint is {joint.type.value}: JointState messages move it"
        else:
            text = "the robot has no planar, floating or virtual joint of this name" + suggestion(
                name, sorted(self._known)
            )
        self.intake.fault(Fault.UNKNOWN_FRAME, name, text, noun="joint")
        return False

"""Poses of a robot's planar and floating joints, and of its virtual joint: MultiDOFJointState."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from msg_adapters.poses import PoseBatch, poses_from_multi_dof_joint_state
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import suggestion
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.robot_pose_channel import Heard, RobotPoseChannel
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_topics import DEFAULT_POSE_TYPE, joint_pose_topic
from scene_graph_ros.robots.kinematics import JointStateError
from scene_graph_ros.robots.robot_parts import JointType

__all__ = ["JointPoseChannel"]


class JointPoseChannel(RobotPoseChannel):
    """Where the child of each such joint is, relative to where it is at rest.

    A virtual joint is between the world and the root link, which the pose of it moves.
    """

    noun = "joint poses"
    part = "joint"

    def __init__(self, record: SourceRecord, intake: Intake, kind: Any, world_frame: str) -> None:
        super().__init__(record, intake, kind, DEFAULT_POSE_TYPE)
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

    def _batch(self, message: Any) -> PoseBatch:
        return poses_from_multi_dof_joint_state(message)

    def _part(self, name: str) -> str:
        return name

    def _problem(self, part: str, parent: str) -> tuple[Fault, str] | None:
        virtual = self._virtual
        if virtual is not None and part == virtual.name and parent not in self._parents:
            text = f"the pose is given in {quoted(parent)}, not in {quoted(virtual.parent_frame)}"
            return Fault.WRONG_PARENT, text
        if part in self._known:
            return None
        joint = self._motion.robot.model.joints.get(part)
        if joint is not None:
            text = f"the joint is {joint.type.value}: JointState messages move it"
        else:
            text = "the robot has no planar, floating or virtual joint of this name" + suggestion(
                part, sorted(self._known)
            )
        return Fault.UNKNOWN_FRAME, text

    def _move(self, part: str, X: NDArray[np.float64], heard: Heard) -> bool:
        virtual, judge = self._virtual, self._judge
        if virtual is not None and part == virtual.name:
            problem = virtual.problem(X)
            if problem:
                self.intake.fault(Fault.NOT_FINITE, part, problem, noun=self.part)
                return False
            return self._move_base(virtual.child_link, X, heard)
        if not judge.in_order([part], heard.stamp, heard.limits):
            return False
        with self._motion.trial() as trial:
            try:
                self._motion.kinematics.set_joint_pose(part, X)
            except JointStateError as error:
                self.intake.fault(Fault.NOT_UNIT, part, str(error), noun=self.part)
                return False
            trial.accepted = judge.place(
                [part], heard.stamp, heard.frames, is_static=heard.is_static
            )
        return trial.accepted

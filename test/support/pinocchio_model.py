"""Build pinocchio's model of a robot from what was read: one reader decides what a file says."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.robot_parts import Joint, JointType, Pose

__all__ = ["BuiltModel", "build_model"]


class BuiltModel(NamedTuple):
    """Pinocchio's model and how links and joints are found in it.

    Joint 0 is the root link; ``X_JL`` places a link in the frame of the joint that moves it.
    """

    pinocchio: Any
    model: Any
    joint_of_link: dict[str, int]
    X_JL: dict[str, Pose]
    q_start: dict[str, int]


def build_model(robot: RobotModel) -> BuiltModel:
    """Return the kinematic tree of ``robot``; links behind fixed joints join their parent's joint.

    Planar joints get six degrees of freedom; Kinematics keeps them in their plane. Raises
    ImportError naming the package if pinocchio is missing.
    """
    try:
        import pinocchio
    except ImportError as error:
        raise ImportError(
            "joint states need pinocchio for forward kinematics: install the package 'pin'"
        ) from error
    model = pinocchio.Model()
    model.name = robot.name
    joint_of_link = {robot.root: 0}
    X_JL = {robot.root: np.eye(4)}
    q_start: dict[str, int] = {}
    for joint in robot.joints.values():
        X_JC = X_JL[joint.parent] @ joint.X_PC
        if joint.type is JointType.FIXED:
            joint_of_link[joint.child] = joint_of_link[joint.parent]
            X_JL[joint.child] = X_JC
            continue
        placement = pinocchio.SE3(X_JC)
        index = model.addJoint(
            joint_of_link[joint.parent], _joint_model(pinocchio, joint), placement, joint.name
        )
        joint_of_link[joint.child] = index
        X_JL[joint.child] = np.eye(4)
        q_start[joint.name] = model.idx_qs[index]
    return BuiltModel(pinocchio, model, joint_of_link, X_JL, q_start)


def _joint_model(pinocchio: Any, joint: Joint) -> Any:
    axis = np.array(joint.axis)
    match joint.type:
        case JointType.REVOLUTE | JointType.CONTINUOUS:
            return pinocchio.JointModelRevoluteUnaligned(axis)
        case JointType.PRISMATIC:
            return pinocchio.JointModelPrismaticUnaligned(axis)
        case _:
            return pinocchio.JointModelFreeFlyer()

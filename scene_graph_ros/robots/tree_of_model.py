"""Make the kinematic tree of a robot that was read from a file."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.spatial.sums import length, product
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.robot_parts import Joint, JointType, RobotParts
from scene_graph_ros.robots.tree_joint import TreeJoint
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, PRISMATIC, REVOLUTE

if TYPE_CHECKING:
    from scene_graph_ros.robots.semantic_model import SemanticModel

__all__ = ["plane_of", "tree_of_model"]

_KINDS = {
    JointType.REVOLUTE: REVOLUTE,
    JointType.CONTINUOUS: REVOLUTE,
    JointType.PRISMATIC: PRISMATIC,
    JointType.PLANAR: PLANAR,
    JointType.FLOATING: FLOATING,
}


def plane_of(axis: tuple[float, float, float]) -> NDArray[np.float64]:
    """Return a pose ``(4, 4)`` without translation whose z axis is the unit vector ``axis``.

    Axes along those of the frame give permutations of it, without any rounding.
    """
    z = np.array(axis) / length(np.array(axis))
    x = np.zeros(3)
    x[(int(np.argmax(np.abs(z))) + 1) % 3] = 1.0
    x -= product(x, z) * z
    x /= length(x)
    X = np.eye(4)
    X[:3, 0], X[:3, 1], X[:3, 2] = x, np.cross(z, x), z
    return X


def tree_of_model(
    robot: RobotParts,
    semantics: SemanticModel | None = None,
    *,
    floating_base: str = "",
    follows: bool = True,
) -> KinematicTree:
    """Return the kinematic tree of a robot, with the groups of ``semantics``.

    Links behind fixed joints are moved by the joint before them. ``floating_base`` names a
    floating joint that is put before the root link, for robots that walk or fly. Without
    ``follows`` joints that mimic others have positions of their own.
    """
    joints: list[TreeJoint] = []
    places: dict[str, tuple[int, NDArray[np.float64]]] = {robot.root: (0, np.eye(4))}
    if floating_base:
        joints.append(TreeJoint(floating_base, FLOATING, 0, np.eye(4)))
        places[robot.root] = 1, np.eye(4)
    for joint in robot.joints.values():
        parent, X_JL = places[joint.parent]
        X_JC = product(X_JL, joint.X_PC)
        if joint.type is JointType.FIXED:
            places[joint.child] = parent, X_JC
            continue
        kind = _KINDS[joint.type]
        X_CJ = np.eye(4) if kind == FLOATING else plane_of(joint.axis)
        mimics, multiplier, offset = _followed(robot, joint) if follows else ("", 1.0, 0.0)
        joints.append(
            TreeJoint(
                joint.name,
                kind,
                parent,
                product(X_JC, X_CJ),
                -np.inf if joint.lower is None else joint.lower,
                np.inf if joint.upper is None else joint.upper,
                mimics,
                multiplier,
                offset,
                np.inf if joint.velocity is None else joint.velocity,
                np.inf if joint.acceleration is None else joint.acceleration,
                np.inf if joint.jerk is None else joint.jerk,
            )
        )
        places[joint.child] = len(joints), X_CJ.T
    rows = [places[name] for name in robot.links]
    return KinematicTree(
        robot.name,
        tuple(joints),
        tuple(robot.links),
        tuple(joint for joint, _ in rows),
        np.array([X for _, X in rows]).reshape(-1, 4, 4),
        groups=MappingProxyType({} if semantics is None else dict(semantics.groups)),
    )


def _followed(robot: RobotParts, joint: Joint) -> tuple[str, float, float]:
    """Return the joint at the end of a chain of those that mimic, and how it is followed."""
    multiplier, offset, last = 1.0, 0.0, joint
    while last.mimic is not None:
        offset += multiplier * last.mimic.offset
        multiplier *= last.mimic.multiplier
        last = robot.joints[last.mimic.joint]
    return ("" if last is joint else last.name), multiplier, offset

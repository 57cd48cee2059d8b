"""A robot as a URDF describes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.robots.robot_parts import Joint, JointType, Pose, RobotParts

if TYPE_CHECKING:
    from scene_graph_ros.robots.kinematic_tree import KinematicTree
    from scene_graph_ros.robots.semantic_model import SemanticModel

__all__ = ["RobotModel"]


@one_line()
@dataclass(frozen=True, eq=False)
class RobotModel(RobotParts):
    """A robot: a tree of links; parents come before their children in ``joints``."""

    def parent_joint(self, link: str) -> Joint | None:
        """Return the joint that moves ``link``, None for the root."""
        return self._joint_by_child().get(link)

    def _joint_by_child(self) -> dict[str, Joint]:
        # Computed once; the dataclass is frozen, so the cache goes around its setter.
        cached: dict[str, Joint] | None = self.__dict__.get("_by_child")
        if cached is None:
            cached = {joint.child: joint for joint in self.joints.values()}
            object.__setattr__(self, "_by_child", cached)
        return cached

    def kinematic_tree(
        self, semantics: SemanticModel | None = None, *, floating_base: str = ""
    ) -> KinematicTree:
        """Return the joints and links as arrays, for batches; see `tree_of_model`."""
        from scene_graph_ros.robots.tree_of_model import tree_of_model

        return tree_of_model(self, semantics, floating_base=floating_base)

    def fixed_to_root(self) -> dict[str, Pose]:
        """Return the poses X_BL ``(4, 4)`` of the links that do not move in the root link."""
        result = {self.root: np.eye(4)}
        for joint in self.joints.values():
            if joint.type is JointType.FIXED and joint.parent in result:
                result[joint.child] = product(result[joint.parent], joint.X_PC)
        return result

    def positioned_joints(self) -> Iterator[Joint]:
        """Yield the joints whose position is one number, mimicking ones included."""
        return (joint for joint in self.joints.values() if joint.type.has_position)

"""What compiles the kernels of robots: of joint states, and of planning."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.robots.kinematic_tree import KinematicTree, TreeJoint
from scene_graph_ros.robots.tree_kernels import REVOLUTE

__all__ = ["differentiate_links", "place_links"]


def _one_joint() -> KinematicTree:
    joint = TreeJoint("joint", REVOLUTE, 0, np.eye(4))
    return KinematicTree("warm_up", (joint,), ("link",), (1,), np.eye(4)[np.newaxis])


def place_links() -> None:
    """Ask where a robot's link is, as joint states do."""
    _one_joint().link_poses(np.zeros(1))


def differentiate_links() -> None:
    """Ask how a robot's link moves."""
    _one_joint().jacobians(np.zeros(1), "link")

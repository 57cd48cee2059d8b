"""Robots: their links and joints, where these are, which may touch. Nothing here imports ROS.

Files are read by ``scene_files``. The names below are imported when they are first used.
"""

from typing import TYPE_CHECKING

from scene_graph_ros.lazy_names import lazy_names

if TYPE_CHECKING:
    from scene_graph_ros.robots.adjacency import adjacent_pairs
    from scene_graph_ros.robots.inertias import tree_inertias, TreeInertias
    from scene_graph_ros.robots.kinematic_tree import KinematicTree
    from scene_graph_ros.robots.kinematics import JointStateError, Kinematics
    from scene_graph_ros.robots.registration import register_robot
    from scene_graph_ros.robots.robot_model import RobotModel
    from scene_graph_ros.robots.semantic_model import SemanticModel
    from scene_graph_ros.robots.tree_joint import KinematicTreeError

__all__ = [
    "JointStateError",
    "KinematicTree",
    "KinematicTreeError",
    "Kinematics",
    "RobotModel",
    "SemanticModel",
    "TreeInertias",
    "adjacent_pairs",
    "register_robot",
    "tree_inertias",
]

__getattr__, __dir__ = lazy_names(__name__)

"""Robots: their links and joints, where these are, which may touch. Nothing here imports ROS.

Files are read by ``scene_files``. The names below are imported when they are first used.
"""

import importlib
from typing import Any, TYPE_CHECKING

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

_MODULES = {
    "adjacency": ("adjacent_pairs",),
    "kinematic_tree": ("KinematicTree",),
    "kinematics": ("JointStateError", "Kinematics"),
    "registration": ("register_robot",),
    "robot_model": ("RobotModel",),
    "semantic_model": ("SemanticModel",),
    "tree_joint": ("KinematicTreeError",),
    "inertias": ("TreeInertias", "tree_inertias"),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*globals(), *__all__]

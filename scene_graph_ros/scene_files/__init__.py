"""Scenes and robots from YAML, URDF and SRDF files to the model. Nothing here imports ROS."""

from scene_graph_ros.scene_files.errors import (
    JointStateError,
    Location,
    SceneFileError,
    UnknownPackageError,
)
from scene_graph_ros.scene_files.kinematics import Kinematics
from scene_graph_ros.scene_files.packages import find_package, resolve_resource
from scene_graph_ros.scene_files.robot_model import RobotModel
from scene_graph_ros.scene_files.srdf import SemanticModel, load_srdf
from scene_graph_ros.scene_files.urdf import load_urdf

__all__ = [
    "JointStateError",
    "Kinematics",
    "Location",
    "RobotModel",
    "SceneFileError",
    "SemanticModel",
    "UnknownPackageError",
    "find_package",
    "load_srdf",
    "load_urdf",
    "resolve_resource",
]

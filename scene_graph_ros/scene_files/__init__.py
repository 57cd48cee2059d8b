"""Scenes and robots from YAML, URDF and SRDF files to the model. Nothing here imports ROS."""

from scene_graph_ros.scene_files.errors import (
    JointStateError,
    Location,
    SceneFileError,
    UnknownPackageError,
)
from scene_graph_ros.scene_files.kinematics import Kinematics
from scene_graph_ros.scene_files.loaded_scene import LoadedRobot, LoadedScene, LoadedSource
from scene_graph_ros.scene_files.packages import find_package, resolve_resource
from scene_graph_ros.scene_files.registration import register_robot
from scene_graph_ros.scene_files.robot_model import RobotModel
from scene_graph_ros.scene_files.scene import Scene, load_scene, load_scene_text
from scene_graph_ros.scene_files.schema import json_schema
from scene_graph_ros.scene_files.srdf import SemanticModel, load_srdf
from scene_graph_ros.scene_files.urdf import load_urdf

__all__ = [
    "JointStateError",
    "Kinematics",
    "LoadedRobot",
    "LoadedScene",
    "LoadedSource",
    "Location",
    "RobotModel",
    "Scene",
    "SceneFileError",
    "SemanticModel",
    "UnknownPackageError",
    "find_package",
    "json_schema",
    "load_scene",
    "load_scene_text",
    "load_srdf",
    "load_urdf",
    "register_robot",
    "resolve_resource",
]

"""Scenes and robots from YAML, URDF and SRDF files to the model. Nothing here imports ROS.

The names below are imported when they are first used, so that who needs a robot's kinematics
does not load the schema of scenes.
"""

import importlib
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
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
    from scene_graph_ros.scene_files.scene import load_scene, load_scene_text, Scene
    from scene_graph_ros.scene_files.schema import json_schema
    from scene_graph_ros.scene_files.srdf import load_srdf, SemanticModel
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

_MODULES = {
    "errors": ("JointStateError", "Location", "SceneFileError", "UnknownPackageError"),
    "kinematics": ("Kinematics",),
    "loaded_scene": ("LoadedRobot", "LoadedScene", "LoadedSource"),
    "packages": ("find_package", "resolve_resource"),
    "registration": ("register_robot",),
    "robot_model": ("RobotModel",),
    "scene": ("Scene", "load_scene", "load_scene_text"),
    "schema": ("json_schema",),
    "srdf": ("SemanticModel", "load_srdf"),
    "urdf": ("load_urdf",),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value

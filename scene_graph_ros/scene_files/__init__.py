"""Scenes and robots from YAML, URDF and SRDF files to the model. Nothing here imports ROS.

The names below are imported when they are first used, so that a robot's kinematics do not load the
schema of scenes. Those of ``robots`` are here, too, beside their readers.
"""

from typing import TYPE_CHECKING

from scene_graph_ros.lazy_names import lazy_names

if TYPE_CHECKING:
    from scene_graph_ros.located import Location, SceneFileError
    from scene_graph_ros.robots import (
        JointStateError,
        Kinematics,
        register_robot,
        RobotModel,
        SemanticModel,
    )
    from scene_graph_ros.scene_files.loaded_scene import LoadedRobot, LoadedScene, LoadedSource
    from scene_graph_ros.scene_files.packages import (
        find_package,
        resolve_resource,
        UnknownPackageError,
    )
    from scene_graph_ros.scene_files.robot_trees import load_kinematic_tree
    from scene_graph_ros.scene_files.saved_scene import save_scene
    from scene_graph_ros.scene_files.saved_values import SceneSaveError
    from scene_graph_ros.scene_files.scene import load_scene, load_scene_text, Scene
    from scene_graph_ros.scene_files.schema import json_schema
    from scene_graph_ros.scene_files.srdf import load_srdf
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
    "SceneSaveError",
    "SemanticModel",
    "UnknownPackageError",
    "find_package",
    "json_schema",
    "load_kinematic_tree",
    "load_scene",
    "load_scene_text",
    "load_srdf",
    "load_urdf",
    "register_robot",
    "resolve_resource",
    "save_scene",
]

__getattr__, __dir__ = lazy_names(__name__)

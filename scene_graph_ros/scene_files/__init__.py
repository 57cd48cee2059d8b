"""Scenes and robots from YAML, URDF and SRDF files to the model. Nothing here imports ROS.

The names below are imported when they are first used, so that a robot's kinematics do not load the
schema of scenes. Those of ``robots`` are here, too, beside their readers.
"""

import importlib
from typing import Any, TYPE_CHECKING

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

_MODULES = {
    "scene_graph_ros.located": ("Location", "SceneFileError"),
    "scene_graph_ros.robots": (
        "JointStateError",
        "Kinematics",
        "RobotModel",
        "SemanticModel",
        "register_robot",
    ),
    f"{__name__}.loaded_scene": ("LoadedRobot", "LoadedScene", "LoadedSource"),
    f"{__name__}.packages": ("UnknownPackageError", "find_package", "resolve_resource"),
    f"{__name__}.robot_trees": ("load_kinematic_tree",),
    f"{__name__}.saved_scene": ("save_scene",),
    f"{__name__}.saved_values": ("SceneSaveError",),
    f"{__name__}.scene": ("Scene", "load_scene", "load_scene_text"),
    f"{__name__}.schema": ("json_schema",),
    f"{__name__}.srdf": ("load_srdf",),
    f"{__name__}.urdf": ("load_urdf",),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        module = importlib.import_module(_MODULE_OF[name])
    except AttributeError as error:
        # As it is, it would be taken for a name that this package has not.
        raise ImportError(f"{_MODULE_OF[name]} can't be imported: {error}") from error
    value = getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*globals(), *__all__]

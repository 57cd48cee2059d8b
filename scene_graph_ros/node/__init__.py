"""Anything ROS: the node that wires the geometry core to topics, services and parameters.

Only this folder imports rclpy. ``world`` keeps the model and its poses, ``effects`` publish them,
``services`` answer requests, and ``runtime`` carries all three; ``server`` puts them together.
``runtime.parameters``, its checks and ``runtime.names`` can be read without rclpy. To embed the
node in a program: ``from scene_graph_ros.node import SceneGraphNode``, which imports it.
"""

import importlib
from typing import Any, TYPE_CHECKING

if TYPE_CHECKING:
    from scene_graph_ros.node.node import SceneGraphNode as SceneGraphNode

__all__ = ["SceneGraphNode"]


def __getattr__(name: str) -> Any:
    if name != "SceneGraphNode":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return importlib.import_module(f"{__name__}.node").SceneGraphNode


def __dir__() -> list[str]:
    return [*globals(), *__all__]

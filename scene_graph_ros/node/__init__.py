"""Anything ROS: the node that wires the geometry core to topics, services and parameters.

Only this folder imports rclpy. ``world`` keeps the model and its poses, ``effects`` publish them,
``services`` answer requests, and ``runtime`` carries all three; ``server`` puts them together.
``runtime.parameters``, its checks and ``runtime.names`` can be read without rclpy. To embed the
node in a program: ``from scene_graph_ros.node import SceneGraphNode``, which imports it.
"""

from typing import TYPE_CHECKING

from scene_graph_ros.lazy_names import lazy_names

if TYPE_CHECKING:
    from scene_graph_ros.node.node import SceneGraphNode as SceneGraphNode

__all__ = ["SceneGraphNode"]

__getattr__, __dir__ = lazy_names(__name__)

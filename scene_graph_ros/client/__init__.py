"""A client of the node, for scripts and notebooks: contacts, moving, grasping, planning.

``World`` asks the node and waits for its answers, in the thread that calls. It needs the messages
and rclpy, and none of the core: importing it compiles nothing.
"""

from scene_graph_ros.client.connection import WorldError
from scene_graph_ros.client.execution import Execution
from scene_graph_ros.client.plans import FoundPlan
from scene_graph_ros.client.shapes import (
    box,
    capsule,
    convex,
    cylinder,
    ellipsoid,
    half_space,
    mesh,
    sphere,
)
from scene_graph_ros.client.sources import Source
from scene_graph_ros.client.table import Table
from scene_graph_ros.client.world import World

__all__ = [
    "Execution",
    "FoundPlan",
    "Source",
    "Table",
    "World",
    "WorldError",
    "box",
    "capsule",
    "convex",
    "cylinder",
    "ellipsoid",
    "half_space",
    "mesh",
    "sphere",
]

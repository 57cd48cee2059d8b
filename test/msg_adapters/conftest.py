"""Field checks on, before any message module is imported: wrong types fail instead of leaking."""

import os

os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="messages are serialized by rclpy")

from rclpy.serialization import deserialize_message, serialize_message

from msg_adapters.names import SceneNames
from scene_graph_ros.geometry.model.frame import GeometryFrame
from scene_graph_ros.geometry.model.instance import GeometryInstance
from scene_graph_ros.geometry.model.properties import (
    IllustrationProperties,
    ProximityProperties,
)
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.model.scene_graph import SceneGraph
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy


@pytest.fixture(scope="session")
def over_the_wire() -> Callable[[Any], Any]:
    """Serialize and deserialize a message, as publishing does."""
    return lambda msg: deserialize_message(serialize_message(msg), type(msg))


@pytest.fixture
def scene() -> SimpleNamespace:
    """Two sources: ``arm`` with frames ``base`` and ``hand``, ``cell`` with the same ``base``.

    Geometry ``ball`` is on both bases, ``tip`` on the hand, ``floor`` is anchored.
    """
    graph = SceneGraph()
    made = SimpleNamespace(graph=graph)
    made.arm, made.cell = graph.register_source("arm"), graph.register_source("cell")
    made.base = graph.register_frame(made.arm, GeometryFrame("base", 3))
    made.hand = graph.register_frame(made.arm, GeometryFrame("hand"), parent=made.base)
    made.other_base = graph.register_frame(made.cell, GeometryFrame("base"))

    def ball(radius: float, name: str) -> GeometryInstance:
        return GeometryInstance(pose_from_xyz_rpy((1.0, 2.0, 3.0)), Sphere(radius), name)

    made.ball = graph.register_geometry(made.arm, made.base, ball(0.25, "ball"))
    made.other_ball = graph.register_geometry(made.cell, made.other_base, ball(0.5, "ball"))
    made.tip = graph.register_geometry(made.arm, made.hand, ball(0.125, "tip"))
    floor = GeometryInstance(np.eye(4), HalfSpace(), "floor")
    made.floor = graph.register_anchored_geometry(made.cell, floor)
    for source, geometry in (
        (made.arm, made.ball),
        (made.cell, made.other_ball),
        (made.arm, made.tip),
        (made.cell, made.floor),
    ):
        graph.assign_role(source, geometry, ProximityProperties())
    illustration = IllustrationProperties()
    illustration.add_property("phong", "diffuse", Rgba(0.125, 0.25, 0.5, 0.75))
    graph.assign_role(made.arm, made.tip, illustration)
    made.inspector = graph.model_inspector()
    made.names = SceneNames(made.inspector)
    return made

"""Field checks on, before any message module is imported: wrong types fail instead of leaking."""

from collections.abc import Callable
import importlib.util
import os
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"

# Without ROS there are no messages to convert.
collect_ignore_glob = [] if importlib.util.find_spec("rclpy") else ["test_*.py"]


@pytest.fixture(scope="session")
def over_the_wire() -> Callable[[Any], Any]:
    """Serialize and deserialize a message, as publishing does."""
    from rclpy.serialization import deserialize_message, serialize_message

    return lambda msg: deserialize_message(serialize_message(msg), type(msg))


@pytest.fixture
def scene() -> SimpleNamespace:
    """Make two sources: ``arm`` with frames ``base`` and ``hand``, ``cell`` with a ``base`` too.

    Geometry ``ball`` is on both bases, ``tip`` on the hand, ``floor`` is anchored.
    """
    from msg_adapters.names import SceneNames
    from scene_graph_ros import geometry as core
    from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy

    graph = core.SceneGraph()
    made = SimpleNamespace(graph=graph)
    made.arm, made.cell = graph.register_source("arm"), graph.register_source("cell")
    made.base = graph.register_frame(made.arm, core.GeometryFrame("base", 3))
    made.hand = graph.register_frame(made.arm, core.GeometryFrame("hand"), parent=made.base)
    made.other_base = graph.register_frame(made.cell, core.GeometryFrame("base"))

    def ball(radius: float, name: str) -> core.GeometryInstance:
        return core.GeometryInstance(pose_from_xyz_rpy((1.0, 2.0, 3.0)), core.Sphere(radius), name)

    made.ball = graph.register_geometry(made.arm, made.base, ball(0.25, "ball"))
    made.other_ball = graph.register_geometry(made.cell, made.other_base, ball(0.5, "ball"))
    made.tip = graph.register_geometry(made.arm, made.hand, ball(0.125, "tip"))
    floor = core.GeometryInstance(np.eye(4), core.HalfSpace(), "floor")
    made.floor = graph.register_anchored_geometry(made.cell, floor)
    for source, geometry in (
        (made.arm, made.ball),
        (made.cell, made.other_ball),
        (made.arm, made.tip),
        (made.cell, made.floor),
    ):
        graph.assign_role(source, geometry, core.ProximityProperties())
    illustration = core.IllustrationProperties()
    illustration.add_property("phong", "diffuse", core.Rgba(0.125, 0.25, 0.5, 0.75))
    graph.assign_role(made.arm, made.tip, illustration)
    made.inspector = graph.model_inspector()
    made.names = SceneNames(made.inspector)
    return made

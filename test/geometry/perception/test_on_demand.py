"""Cameras cost nothing where there are none: their code is imported by the first image."""

import subprocess
import sys

_CODE = """
import sys
import numpy as np
from scene_graph_ros.geometry import *
core = "scene_graph_ros.geometry.perception"
graph = SceneGraph()
source = graph.register_source("s")
ball = GeometryInstance(np.eye(4), Sphere(0.1), "ball")
ball.set_proximity_properties(ProximityProperties())
ball.set_perception_properties(PerceptionProperties())
graph.register_anchored_geometry(source, ball)
query = graph.query_object(graph.create_default_context())
query.compute_signed_distance_to_point([0.0, 0.0, 1.0])
assert graph.renderer_count() == 0
print(sorted(name for name in sys.modules if name.startswith(core)))
try:
    query.render_images(None, graph.world_frame_id(), np.eye(4))
except ValueError:
    assert core + ".query" in sys.modules
"""


def test_a_scene_without_cameras_imports_nothing_of_them():
    """Neither the package nor its kernels are loaded before somebody asks for an image."""
    command = [sys.executable, "-c", _CODE]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[]"

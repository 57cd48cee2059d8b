"""A scene in which nothing deforms imports nothing of it and keeps nothing for it."""

import subprocess
import sys

_CODE = """
import sys
import numpy as np
from scene_graph_ros.geometry import *
from scene_graph_ros.geometry.model.snapshot import NO_CONFIGURATIONS
graph = SceneGraph()
source = graph.register_source("rigid")
for k in range(2):
    frame = graph.register_frame(source, GeometryFrame(f"frame_{k}"))
    ball = graph.register_geometry(source, frame, GeometryInstance(np.eye(4), Sphere(0.1), "ball"))
    graph.assign_role(source, ball, ProximityProperties())
context = graph.create_default_context()
query = graph.query_object(context)
assert len(query.compute_point_pair_penetration()) == 1
context.set_configurations(source, {})
assert context._moment[0].configurations is NO_CONFIGURATIONS
assert query.inspector().num_deformable_geometries() == 0
core = "scene_graph_ros.geometry."
late = {core + "deformable", core + "model.driven_mesh", "meshio"}
late |= {core + f"meshes.{n}" for n in ("embedding", "box_grid", "tessellate", "solids.solid")}
print(sorted(late & sys.modules.keys()))
assert len(query.compute_deformable_contact()) == 0
assert core + "deformable.query" in sys.modules
"""


def test_a_rigid_scene_imports_nothing_of_it():
    """Neither the package nor what makes volume meshes is loaded before somebody asks."""
    command = [sys.executable, "-c", _CODE]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[]"

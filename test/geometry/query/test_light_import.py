import subprocess
import sys

_CODE = """
import sys
import numba, numpy as np
import numba.np.linalg
numba.np.linalg.ensure_blas()
before = set(sys.modules)  # numba itself loads a bit of scipy, with the first kernel
from scene_graph_ros.geometry import *
graph = SceneGraph()
source = graph.register_source("light")
for k, shape in enumerate((Sphere(0.1), Box(0.1, 0.2, 0.3), Capsule(0.1, 0.2))):
    frame = graph.register_frame(source, GeometryFrame(f"frame_{k}"))
    geometry = graph.register_geometry(source, frame, GeometryInstance(np.eye(4), shape, f"g{k}"))
    graph.assign_role(source, geometry, ProximityProperties())
query = graph.query_object(graph.create_default_context())
assert len(query.compute_point_pair_penetration()) == 3
assert len(query.compute_signed_distance_to_point([0.0, 0.0, 1.0])) == 3
heavy = {"scipy", "trimesh", "rclpy", "collada", "pinocchio", "yaml", "pydantic", "tqdm", "coal"}
late = {name.split(".")[0] for name in set(sys.modules) - before}
print(",".join(sorted(heavy & late)))
"""


def test_core_and_primitive_scene_import_nothing_heavy():
    """A scene of primitives needs numpy and numba only: no ROS, scipy, trimesh or readers."""
    command = [sys.executable, "-c", _CODE]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ""

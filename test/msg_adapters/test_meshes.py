"""Meshes in markers."""

from pathlib import Path

import numpy as np

from msg_adapters import meshes
from scene_graph_ros.views.triangles import Triangles


def test_triangle_points_are_the_corners_in_order() -> None:
    """Three points per triangle, with distinct numbers."""
    vertices = np.arange(12.0).reshape(4, 3)
    triangles = np.array([(3, 0, 1), (2, 1, 0)])
    points = meshes.triangle_points_to_msg(Triangles(vertices, triangles))
    assert [(p.x, p.y, p.z) for p in points] == [
        (9.0, 10.0, 11.0), (0.0, 1.0, 2.0), (3.0, 4.0, 5.0),
        (6.0, 7.0, 8.0), (3.0, 4.0, 5.0), (0.0, 1.0, 2.0),
    ]  # fmt: skip


def test_a_file_in_a_package_is_named_by_it() -> None:
    """Viewers elsewhere find packages, not paths; a folder that begins alike is no package."""
    shares = {"robot": Path("/ws/share/robot"), "cell": Path("/ws/share/cell")}
    uri = meshes.resource_uri(Path("/ws/share/robot/meshes/link.stl"), shares)
    assert uri == "package://robot/meshes/link.stl"
    for path in (Path("/ws/share/robot2/link.stl"), Path("/data/a b.stl")):
        assert meshes.resource_uri(path, shares) == path.as_uri()
    assert meshes.resource_uri(Path("/data/a b.stl")) == "file:///data/a%20b.stl"

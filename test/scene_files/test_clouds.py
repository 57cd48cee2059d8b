"""Clouds in scene files, as they are read and as they are saved."""

import numpy as np
import pytest

from scene_graph_ros.geometry import GeometryInstance, PointCloud, SceneGraph
from scene_graph_ros.scene_files import load_scene, save_scene, SceneFileError

SCENE = """version: 1
sources: [{name: camera}]
geometries:
  - {name: seen, source: camera, shape: {type: point_cloud, radius: 0.01}}
  - name: known
    source: camera
    shape: {type: point_cloud, radius: [0.5, 0], points: [[1, 2, 3], [4, 5, 6]]}
"""


def loaded(path):
    """Return the clouds of a scene file by name."""
    graph = SceneGraph()
    load_scene(path).apply(graph)
    inspector = graph.model_inspector()
    return {
        inspector.get_name(i): inspector.get_shape(i) for i in inspector.get_all_geometry_ids()
    }


def test_a_file_says_which_points_there_are_to_begin_with(tmp_path):
    """None where it says nothing."""
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    found = loaded(path)
    assert found["seen"] == PointCloud([], 0.01)
    assert found["known"] == PointCloud([[1, 2, 3], [4, 5, 6]], [0.5, 0.0])


@pytest.mark.parametrize("radius", ["-0.1", "[0.1]", "wide", ".nan"])
def test_what_is_no_cloud_is_refused(tmp_path, radius):
    """Where it stands in the file."""
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE.replace("[0.5, 0]", radius))
    with pytest.raises(SceneFileError, match=r"known|geometries"):
        loaded(path)


def test_a_cloud_is_saved_with_the_points_that_it_has(tmp_path):
    """Those that were set, of a context; without one those of the shape."""
    graph = SceneGraph()
    source = graph.register_source("camera")
    instance = GeometryInstance(np.eye(4), PointCloud([[1 / 3, 0, 0]], 0.1), "seen")
    cloud = graph.register_anchored_geometry(source, instance)
    context = graph.create_default_context()
    points, radii = np.random.default_rng(1).normal(size=(9, 3)), np.linspace(0.0, 1.0, 9)
    context.set_points(source, {cloud: (points, radii)})
    save_scene(graph, tmp_path / "now.yaml", context=context)
    assert loaded(tmp_path / "now.yaml")["seen"] == PointCloud(points, radii)
    save_scene(graph, tmp_path / "begin.yaml")
    assert loaded(tmp_path / "begin.yaml")["seen"] == PointCloud([[1 / 3, 0, 0]], 0.1)

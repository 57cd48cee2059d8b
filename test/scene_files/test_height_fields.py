"""Height fields in scene files, as they are read and as they are saved."""

import numpy as np
import pytest

from scene_graph_ros.geometry import GeometryInstance, HeightField, SceneGraph
from scene_graph_ros.scene_files import load_scene, save_scene, SceneFileError

SCENE = """version: 1
sources: [{name: map}]
geometries:
  - name: ground
    source: map
    shape: {type: height_field, heights: [[0, 0.5, 1], [0, 0, 0.25]], size: [2, 1], floor: -1}
"""
GROUND = HeightField([[0, 0.5, 1], [0, 0, 0.25]], (2.0, 1.0), -1.0)


def loaded(path):
    """Return the one shape of a scene file."""
    graph = SceneGraph()
    load_scene(path).apply(graph)
    inspector = graph.model_inspector()
    (geometry_id,) = inspector.get_all_geometry_ids()
    return inspector.get_shape(geometry_id)


def test_a_file_has_the_heights_row_by_row(tmp_path):
    """With the lengths along x and y, and the floor."""
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    assert loaded(path) == GROUND


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("floor: -1", "floor: 0"),
        ("floor: -1", "floor: low"),
        ("[2, 1]", "[2]"),
        ("[2, 1]", "[2, 0]"),
        ("[0, 0, 0.25]", "[0, 0]"),
        ("0.25", ".nan"),
        (", [0, 0, 0.25]", ""),
    ],
)
def test_what_is_no_field_is_refused(tmp_path, before, after):
    """Where it stands in the file."""
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE.replace(before, after))
    with pytest.raises(SceneFileError, match=r"ground|geometries"):
        loaded(path)


def test_a_field_is_saved_with_the_heights_that_it_has(tmp_path):
    """Those that were set, of a context; without one those of the shape."""
    graph = SceneGraph()
    source = graph.register_source("map")
    field = graph.register_anchored_geometry(source, GeometryInstance(np.eye(4), GROUND, "ground"))
    context = graph.create_default_context()
    heights = np.random.default_rng(1).uniform(0.0, 1 / 3, (2, 3))
    context.set_heights(source, {field: heights})
    save_scene(graph, tmp_path / "now.yaml", context=context)
    assert loaded(tmp_path / "now.yaml") == HeightField(heights, (2.0, 1.0), -1.0)
    save_scene(graph, tmp_path / "begin.yaml")
    assert loaded(tmp_path / "begin.yaml") == GROUND

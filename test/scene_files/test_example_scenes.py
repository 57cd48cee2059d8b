"""The scenes in config/scenes load, make contact, and what is generated there is current."""

import importlib.util
import json
from pathlib import Path
import re

import numpy as np
import pytest
import trimesh

from scene_graph_ros.geometry import SceneGraph, Sphere
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.scene_files import json_schema, load_scene

SCENES = Path(__file__).parents[2] / "config" / "scenes"


@pytest.fixture(scope="module")
def cell():
    """Return the Panda cell in a scene graph, with a context in which all is where it starts."""
    scene_graph = SceneGraph()
    loaded = load_scene(SCENES / "panda_cell.yaml").apply(scene_graph)
    context = scene_graph.create_default_context()
    loaded.set_initial_poses(context)
    return scene_graph, loaded, context


def contacts(scene_graph, context):
    """Return the pairs in contact as pairs of names."""
    inspector = scene_graph.model_inspector()
    found = scene_graph.query_object(context).compute_point_pair_penetration()
    return {frozenset((inspector.get_name(c.id_A), inspector.get_name(c.id_B))) for c in found}


def test_cell_has_every_shape(cell):
    """All eight shapes are in the cell, the objects' source has eight frames."""
    scene_graph, loaded, _ = cell
    inspector = scene_graph.model_inspector()
    kinds = {inspector.get_shape(g).kind for g in loaded.geometries.values()}
    assert kinds == set(ShapeKind)
    assert len(loaded.sources["objects"].frames) == 8
    assert loaded.warnings == ()


def test_robot_starts_clear_of_everything(cell):
    """In its default posture the Panda touches neither itself nor the cell."""
    scene_graph, loaded, context = cell
    links = set(loaded.sources["panda"].robot.model.links)
    touching = {name for pair in contacts(scene_graph, context) for name in pair}
    assert not any(name.startswith(tuple(links)) for name in touching)


def test_ball_rests_in_the_bowl_not_on_its_hull(cell):
    """The bowl's hollow is hollow: a ball in it 1 mm above the bottom touches nothing.

    The bottom inside is 12 mm above the bowl's origin at z = 0.45 m; the hull would fill it.
    """
    scene_graph, loaded, context = cell
    context = context.clone()
    ball = loaded.sources["objects"].frames["ball"]
    radius = scene_graph.model_inspector().get_shape(loaded.geometries["objects/ball/ball"])
    assert radius == Sphere(0.05)
    X_WB = np.eye(4)
    X_WB[:3, 3] = [0.62, 0.32, 0.45 + 0.012 + 0.05 + 0.001]
    context.set_frame_poses(loaded.sources["objects"].source_id, {ball: X_WB})
    assert frozenset(("ball", "bowl")) not in contacts(scene_graph, context)
    X_WB[2, 3] -= 0.003
    context.set_frame_poses(loaded.sources["objects"].source_id, {ball: X_WB})
    assert frozenset(("ball", "bowl")) in contacts(scene_graph, context)


def test_reaching_down_presses_on_the_table(cell):
    """Joint positions that put the fingers' tips below the table top make contact with it."""
    scene_graph, loaded, context = cell
    context = context.clone()
    robot = loaded.sources["panda"]
    names = [f"panda_joint{i}" for i in range(1, 8)]
    # The tool's tip is 0.443 m above the floor there, the table's top at 0.45 m.
    posture = (0.0, 0.512, 0.0, -2.199, 0.0, 2.711, 0.785)
    context.set_frame_poses(robot.source_id, robot.robot.frame_poses(names, posture))
    touched = {name for pair in contacts(scene_graph, context) for name in pair}
    assert "table_top" in touched
    assert any(name.startswith("panda_leftfinger") for name in touched)


def test_schema_for_editors_is_current():
    """The schema beside the scenes is what the code would print now."""
    assert json.loads((SCENES / "scene.schema.json").read_text()) == json_schema()


def test_meshes_are_what_their_script_writes():
    """The meshes beside the scenes come from the script beside them, closed and not convex."""
    import trimesh

    script = SCENES / "meshes" / "make_meshes.py"
    spec = importlib.util.spec_from_file_location("make_meshes", script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name, text in module.meshes().items():
        file = SCENES / "meshes" / name
        assert file.read_text() == text
        mesh = trimesh.load(file)
        assert mesh.is_watertight
        assert 0 < mesh.volume < 0.7 * mesh.convex_hull.volume


def test_examples_of_the_documentation_run(tmp_path):
    """The scene and the Python lines in docs/scene_files.md do what they say."""
    text = (SCENES.parents[1] / "docs" / "scene_files.md").read_text()
    scene, bodies, cameras, renderers, _ = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (tmp_path / "meshes").symlink_to(SCENES / "meshes")
    (tmp_path / "scene.yaml").write_text(scene + cameras + renderers)
    scene_graph = SceneGraph()
    loaded = load_scene(tmp_path / "scene.yaml").apply(scene_graph)
    assert scene_graph.has_renderer("studio")
    assert list(loaded.sources) == ["cell", "objects", "tracker", "panda"]
    assert loaded.cameras["wrist"].frame == "panda_hand"
    _load_bodies(bodies, tmp_path / "soft")
    names: dict = {}
    exec(code, names)
    poses = names["context"].frame_poses(names["source"])
    np.testing.assert_array_equal(poses, names["X_WL"])


def _load_bodies(scene, folder):
    """Load the page's scene of geometries that press and deform."""
    (folder / "meshes").mkdir(parents=True)
    trimesh.creation.box([0.1, 0.06, 0.04]).export(folder / "meshes" / "sponge.obj")
    (folder / "scene.yaml").write_text(scene)
    scene_graph = SceneGraph()
    loaded = load_scene(folder / "scene.yaml").apply(scene_graph)
    context = scene_graph.create_default_context()
    loaded.set_initial_poses(context)
    query = scene_graph.query_object(context)
    # The ball's lowest point is 2 mm below the top of the pad; the sponge is elsewhere.
    (surface,) = query.compute_contact_surfaces("triangle")
    assert surface.material_M["dynamic_friction"] == 0.8
    assert len(scene_graph.model_inspector().get_all_deformable_geometry_ids()) == 1

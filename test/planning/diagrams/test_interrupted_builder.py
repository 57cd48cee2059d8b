"""A robot or a scene whose reading is interrupted is in the diagram as a whole, or not at all."""

from functools import partial

from edited_worlds import answers_of, World
from interrupting import instruction_count, interrupted_at, places
from public_changes import uncalled_methods
import pytest
from robot_scenes import SLIDE

from scene_graph_ros.planning import RobotDiagram, RobotDiagramBuilder
from scene_graph_ros.scene_files import load_scene

SCENE = """version: 1
sources: [{name: around}, {name: thing}]
robots: [{name: right, urdf: slide.urdf, positions: {rail: 0.5}}]
frames: [{name: post, source: thing, pose: {xyz: [1, 0, 0]}}]
geometries:
  - {name: post, source: thing, frame: post, shape: {type: sphere, radius: 0.2}}
  - {name: wall, source: around, shape: {type: box, size: [1, 2, 3]}}
collision_filters: [{within: [thing, around]}]
"""


@pytest.fixture(scope="module", name="folder")
def _folder(tmp_path_factory):
    """Files of a robot and of a scene with another."""
    folder = tmp_path_factory.mktemp("builder")
    (folder / "slide.urdf").write_text(SLIDE)
    (folder / "scene.yaml").write_text(SCENE)
    return folder


EDITS = {
    "add_robot": lambda b, folder: b.add_robot(
        "left", folder / "slide.urdf", positions={"rail": 1}
    ),
    "add_scene": lambda b, folder: b.add_scene(folder / "scene.yaml", prefix="p_"),
    "build": lambda b, folder: b.build(),
}


def begun(folder):
    """Return a builder with one robot."""
    builder = RobotDiagramBuilder()
    builder.add_robot("first", folder / "slide.urdf")
    return builder


def answers(builder):
    """Return the names of all that is registered, and what becomes of it."""
    if builder.is_diagram_built():
        return "built"
    inspector = builder.scene_graph.model_inspector()
    sources = [inspector.get_name(source) for source in inspector.get_all_source_ids()]
    bodies = [inspector.get_name(each) for each in inspector.get_all_geometry_ids()]
    diagram = builder.build()
    builder._is_built = False
    frames = diagram.context.inspector().get_all_frame_ids()
    poses = [diagram.context.snapshot.X_WF[k].tolist() for k in range(len(frames))]
    return sources, bodies, diagram.tree.position_names, poses


@pytest.mark.search
@pytest.mark.parametrize("name", EDITS)
def test_an_interrupted_edit_is_done_or_not(folder, name):
    """Names, robots and poses are those before or after it, and it can then be made."""
    edit = EDITS[name]
    before, builder = answers(begun(folder)), begun(folder)
    count = instruction_count(lambda: edit(builder, folder))
    after = answers(builder)
    assert after != before
    for at in places(count, name):
        builder = begun(folder)
        interrupted_at(lambda builder=builder: edit(builder, folder), at)
        found = answers(builder)
        if found == before:
            edit(builder, folder)
            found = answers(builder)
        assert found == after, at


@pytest.mark.search
def test_an_interrupted_scene_leaves_the_scene_graph(folder):
    """That of others is as it was, and names are free again."""
    scene = load_scene(folder / "scene.yaml")
    world = World(own=True, of_graph=True)
    before = answers_of(world)
    count = instruction_count(lambda: scene.apply(world.graph))
    after = answers_of(world)
    for at in places(count, "scene", 8):
        world = World(own=True, of_graph=True)
        interrupted_at(lambda world=world: scene.apply(world.graph), at, MemoryError)
        found = answers_of(world)
        if found == before:
            scene.apply(world.graph)
            found = answers_of(world)
        assert found == after, at


def test_each_public_change_is_tried(folder):
    """A new public method has to be among the edits, or to be named as a question."""
    questions = ("is_diagram_built", "scene_graph")
    actions = [partial(edit, begun(folder), folder) for edit in EDITS.values()]
    assert uncalled_methods(RobotDiagramBuilder, questions, actions) == set()
    assert (
        uncalled_methods(RobotDiagram, ("of_loaded", "of_robots", "of_scene", "query"), ())
        == set()
    )

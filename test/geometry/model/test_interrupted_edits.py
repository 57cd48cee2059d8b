"""What is interrupted anywhere leaves the world before it or the one after it."""

from functools import cache, partial

from edited_worlds import answers_of, World
from interrupting import instruction_count, interrupted_at, places, SAMPLE, signalled_at
import numpy as np
from public_changes import uncalled_methods
import pytest
from world_edits import EDITS, EDITS_OF_POSES, PREPARATIONS

from scene_graph_ros.geometry import Context, GeometryFrame, SceneGraph, Sphere
from scene_graph_ros.geometry.model.collision_filter import CollisionFilterManager


def shifted(x):
    """Return a pose that moves along x, in m."""
    X = np.eye(4)
    X[0, 3] = x
    return X


CHANGES = EDITS | EDITS_OF_POSES
KINDS = {
    "shared": {"own": False},
    "own": {"own": True},
    "of the graph": {"own": True, "of_graph": True},
}
HOW_MANY = {"own": (SAMPLE, SAMPLE), "shared": (SAMPLE, 8), "of the graph": (5, 4)}
"""Instructions that are tried in each run of the tests, and fiftieths of those of a search."""

CASES = [
    (name, kind) for name in CHANGES for kind in KINDS if name in EDITS or kind != "of the graph"
]


first = cache(World)


def made(name, kind="own"):
    """Return a world in which an edit can be made: a copy of one that nobody edits."""
    return first(**KINDS[kind], prepare=PREPARATIONS.get(name, _nothing)).copy()


def _nothing(world):
    """Prepare nothing."""


QUESTIONS_OF = {
    SceneGraph: (
        *("accuracy", "clone", "create_default_context", "engine", "get_config", "has_renderer"),
        *("model_inspector", "query_object", "registered_renderer_names", "renderer_count"),
        *("renderer_parameter_yaml", "renderer_type_name", "source_is_registered"),
        "world_frame_id",
        "provide_queries",  # of the class, by the layer above
        "collision_filter_manager",  # what it returns changes, below
    ),
    Context: (
        *(
            "clone",
            "configuration",
            "filters",
            "frame_pose",
            "frame_poses",
            "heights",
            "inspector",
        ),
        *("model_version", "points", "pose_version", "resolve_set", "share", "snapshot", "state"),
        "voxels",
    ),
    CollisionFilterManager: ("has_transient_history", "is_active"),
}


@pytest.mark.parametrize("kind", QUESTIONS_OF)
def test_each_public_change_is_tried(kind):
    """A new public method has to be among the edits, or to be named among the questions."""
    actions = [partial(edit, made(name)) for name, edit in CHANGES.items()]
    assert uncalled_methods(kind, QUESTIONS_OF[kind], actions) == set()


@pytest.mark.search
@pytest.mark.parametrize(("name", "kind"), CASES)
def test_an_interrupted_edit_is_done_or_not(name, kind):
    """All answers are those of one of the two worlds, and the edit can then be made."""
    edit = CHANGES[name]
    world = World(**KINDS[kind], prepare=PREPARATIONS.get(name, _nothing))
    before = answers_of(world)
    count = instruction_count(lambda: edit(world))
    after = answers_of(world)
    wrong = []
    for at in places(count, f"{name} {kind}", *HOW_MANY[kind]):
        world = made(name, kind)
        if not interrupted_at(lambda world=world: edit(world), at):
            continue
        found = answers_of(world)
        if found == before:
            edit(world)
            found = answers_of(world)
        if found != after:
            wrong.append((at, [key for key in found if found[key] != after.get(key)]))
    assert not wrong, f"of {count} instructions {len(wrong)} leave a third world: {wrong[:5]}"


@pytest.mark.search
@pytest.mark.parametrize("name", CHANGES)
def test_a_signal_leaves_one_of_the_two_worlds(name):
    """Ctrl-C as it comes: some microseconds after an instruction, also inside of compiled code."""
    edit = CHANGES[name]
    before, world = (
        answers_of(World(**KINDS["own"], prepare=PREPARATIONS.get(name, _nothing))),
        made(name),
    )
    count = instruction_count(lambda: edit(world))
    after = answers_of(world)
    for at in places(count, f"signal {name}", 2, 4):
        world = made(name)
        signalled_at(lambda world=world: edit(world), at)
        found = answers_of(world)
        if found == before:
            edit(world)
            found = answers_of(world)
        assert found == after, at


def test_large_scenes_reuse_no_poses_that_were_not_written():
    """Memory for poses is lent again from a hundred frames on, and only once it was filled."""
    graph = SceneGraph()
    source = graph.register_source("s")
    for k in range(120):
        frame = graph.register_frame(source, GeometryFrame(f"f{k}"))
        graph.register_geometry(source, frame, World.instance(f"g{k}", shifted(k), Sphere(1)))
    graph.register_anchored_geometry(source, World.instance("a", shifted(-1), Sphere(1)))
    model = graph.create_default_context()
    poses = np.tile(shifted(7), (120, 1, 1))

    def step(context):
        X_WG = context.snapshot.X_WG.copy()
        context.set_frame_poses(source, poses)
        return X_WG, context.snapshot.X_WG.copy()

    expected = step(model.clone())
    for at in places(instruction_count(partial(step, model.clone())), "poses"):
        context = model.clone()
        interrupted_at(partial(step, context), at)
        context.set_frame_poses(source, np.tile(np.eye(4), (120, 1, 1)))
        assert all(map(np.array_equal, step(context), expected)), at


@pytest.mark.search
@pytest.mark.parametrize(
    "name", ["change shape", "register geometry", "remove source", "declare filters"]
)
def test_a_lack_of_memory_that_lasts_leaves_one_of_the_two_worlds(name):
    """Who looks at a world with writes that are left does them; that may be interrupted, too."""
    edit = EDITS[name]
    before, world = answers_of(made(name)), made(name)
    count = instruction_count(lambda: edit(world))
    after = answers_of(world)
    for at in places(count, name):
        world = made(name)
        for again in (None, 3, 40, 41, 70, 120):
            action = partial(edit if again is None else answers_of, world)
            interrupted_at(action, at if again is None else again, MemoryError)
        found = answers_of(world)
        if found == before:
            edit(world)
            found = answers_of(world)
        assert found == after, at

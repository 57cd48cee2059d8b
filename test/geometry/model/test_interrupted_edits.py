"""What is interrupted anywhere leaves the world before it or the one after it."""

from functools import partial

from edited_worlds import answers_of, EDITS, EDITS_OF_POSES, PREPARATIONS, World
from interrupting import instruction_count, interrupted_at, places, SAMPLE
import numpy as np
from public_changes import uncalled_methods
import pytest

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
CASES = [
    (name, kind) for name in CHANGES for kind in KINDS if name in EDITS or kind != "of the graph"
]


def made(name, kind="own"):
    """Return a world in which an edit can be made."""
    return World(**KINDS[kind], prepare=PREPARATIONS.get(name, lambda world: None))


QUESTIONS_OF = {
    SceneGraph: (
        *("accuracy", "clone", "create_default_context", "engine", "has_renderer"),
        *("model_inspector", "query_object", "registered_renderer_names", "renderer_count"),
        *("renderer_parameter_yaml", "renderer_type_name", "source_is_registered"),
        "world_frame_id",
        "provide_queries",  # of the class, by the layer above
        "collision_filter_manager",  # what it returns changes, below
    ),
    Context: (
        *("clone", "configuration", "filters", "frame_pose", "frame_poses", "inspector"),
        *("model_version", "points", "pose_version", "resolve_set", "share", "snapshot", "state"),
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
    before = answers_of(made(name, kind))
    world = made(name, kind)
    count = instruction_count(lambda: edit(world))
    after = answers_of(world)
    wrong = []
    for at in places(count, f"{name} {kind}", 5 if kind == "of the graph" else SAMPLE):
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


QUESTIONS = {
    "all": answers_of,
    "depth": lambda w: w.query.compute_point_pair_penetration(),
    "distance": lambda w: w.query.compute_signed_distance_pairwise_closest_points(
        max_distance=0.3
    ),
    "points": lambda w: w.query.compute_signed_distance_to_points(np.ones((2, 3))),
    "candidates": lambda w: w.query.find_collision_candidates(),
}


@pytest.mark.search
@pytest.mark.parametrize("name", QUESTIONS)
def test_an_interrupted_question_changes_no_answer(name):
    """Poses and shapes have changed before it, so that much is to be computed and remembered."""

    def changed():
        world = World(own=True)
        EDITS_OF_POSES["set all poses"](world)
        EDITS["change shape"](world)
        return world

    world, ask = changed(), QUESTIONS[name]
    count = instruction_count(lambda: ask(world))
    expected = answers_of(changed())
    for at in places(count, name):
        world = changed()
        interrupted_at(lambda world=world: ask(world), at)
        assert answers_of(world) == expected, at
        world.context.set_frame_poses(world.arm, world.poses(1.0))
        world.context.set_frame_poses(world.arm, world.poses(0.03))
        assert answers_of(world) == expected, at


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

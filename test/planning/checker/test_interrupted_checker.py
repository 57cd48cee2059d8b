"""A checker whose edit is interrupted is the one before or after it; questions change none."""

from functools import partial

from interrupting import instruction_count, interrupted_at, places
import numpy as np
from plain_values import plain
from public_changes import uncalled_methods
import pytest
from robot_scenes import SLIDE

from scene_graph_ros.geometry import Sphere
from scene_graph_ros.planning import (
    BodyShapeDescription,
    LinearDistanceAndInterpolationProvider,
    load_robot_diagram,
    SceneGraphCollisionChecker,
)

FAR = np.eye(4)
FAR[0, 3] = 0.5


def shape(c):
    """Describe a ball of 0.4 m on the first body."""
    return BodyShapeDescription(
        Sphere(0.4), FAR, c.bodies[0].model_instance_name, c.bodies[0].body_name
    )


def paddings(c):
    """Return all paddings, of the two balls another one."""
    matrix, (a, b) = c.get_padding_matrix(), balls(c)
    matrix[a, b] = matrix[b, a] = 0.7
    return matrix


def filters(c):
    """Return all filters, with the two balls filtered."""
    matrix, (a, b) = c.get_filtered_collision_matrix(), balls(c)
    matrix[a, b] = matrix[b, a] = 1
    return matrix


def balls(c):
    """Return the indices of the two bodies that move."""
    return [body.index for body in c.bodies if body.body_name == "ball"]


def far(q1, q2):
    """Return a distance of configurations, ten times the sum of all ways."""
    return 10.0 * float(np.abs(np.subtract(q1, q2)).sum())


def first(q1, q2, ratio):
    """Return a configuration on a way that is not straight."""
    return np.where(ratio < 1.0, q1, q2)


EDITS = {
    "add a shape": lambda c: c.add_collision_shape_to_body("more", c.bodies[0], Sphere(0.4), FAR),
    "add to a frame": lambda c: c.add_collision_shape_to_frame(
        "more", c.bodies[0], Sphere(0.4), FAR
    ),
    "add what is described": lambda c: c.add_collision_shape("more", shape(c)),
    "add shapes": lambda c: c.add_collision_shapes({"more": [shape(c)] * 2, "some": [shape(c)]}),
    "remove all shapes": lambda c: c.remove_all_added_collision_shapes(),
    "padding between": lambda c: c.set_padding_between(*balls(c), 0.1),
    "paddings between": lambda c: c.set_paddings_between({tuple(balls(c)): 0.6}),
    "paddings of geometries": lambda c: c.set_paddings_between_geometries([(None, None, 0.6)]),
    "padding matrix": lambda c: c.set_padding_matrix(paddings(c)),
    "padding of all": lambda c: c.set_padding_all_robot_robot_pairs(0.3),
    "padding to all around": lambda c: c.set_padding_all_robot_environment_pairs(0.3),
    "padding of one": lambda c: c.set_padding_one_robot_body_all_environment_pairs(
        balls(c)[0], 0.4
    ),
    "filter": lambda c: c.set_collision_filtered_between(*balls(c), True),
    "filter matrix": lambda c: c.set_collision_filter_matrix(filters(c)),
    "filter all": lambda c: c.set_collision_filtered_with_all_bodies(balls(c)[0]),
    "step size": lambda c: c.set_edge_step_size(0.01),
    "step size by its name": lambda c: setattr(c, "edge_step_size", 0.01),
    "distances": lambda c: c.set_configuration_distance_function(far),
    "ways": lambda c: c.set_configuration_interpolation_function(first),
    "provider": lambda c: c.set_distance_and_interpolation_provider(
        LinearDistanceAndInterpolationProvider(c.model.tree, [4.0, 9.0])
    ),
}
CONTEXTS = {
    "positions": lambda c: c.update_positions([0.1, 0.2]),
    "a context's positions": lambda c: c.update_context_positions(c.model_context(0), [1, 2]),
    "check there": lambda c: c.check_context_config_collision_free(c.model_context(0), [1, 2]),
    "check an edge": lambda c: c.check_context_edge_collision_free(
        c.model_context(0), [1, 2], [2, 1]
    ),
    "measure an edge": lambda c: c.measure_context_edge(c.model_context(0), [1, 2], [2, 1]),
    "measure it": lambda c: c.measure_context_edge_collision_free(
        c.model_context(0), [1, 2], [2, 1]
    ),
    "clearance there": lambda c: c.calc_context_robot_clearance(c.model_context(0), [1, 2], 1.0),
    "classify there": lambda c: c.classify_context_body_collisions(c.model_context(0), [1, 2]),
    "all contexts": lambda c: c.perform_operation_against_all_model_contexts(
        lambda model, context: context.set_positions([0.3, 0.4])
    ),
}
"""What moves contexts of a checker, one after another."""


@pytest.fixture(scope="module", name="checker")
def _checker(tmp_path_factory):
    """Two balls on one rail, each of a robot, with a shape that was added."""
    folder = tmp_path_factory.mktemp("slides")
    (folder / "slide.urdf").write_text(SLIDE)
    (folder / "two.yaml").write_text(
        "version: 1\nrobots:\n  - {name: left, urdf: slide.urdf}\n"
        "  - {name: right, urdf: slide.urdf}\n"
    )
    checker = SceneGraphCollisionChecker(
        load_robot_diagram(folder / "two.yaml"),
        configuration_distance_function=lambda q1, q2: float(np.abs(np.subtract(q1, q2)).sum()),
        implicit_context_parallelism=1,
    )
    checker.add_collision_shape_to_body("some", checker.bodies[1], Sphere(0.2), FAR)
    return checker


def answers(checker):
    """Return all that a checker says of its bodies, shapes, paddings, filters and of places."""
    rng = np.random.default_rng(1)
    q = rng.uniform(-2.0, 2.0, (40, checker._tree.num_positions))
    added = checker.get_all_added_collision_shapes()
    return (
        {group: [repr(each.shape) for each in shapes] for group, shapes in added.items()},
        checker.get_padding_matrix().tolist(),
        checker.get_filtered_collision_matrix().tolist(),
        checker.get_largest_padding(),
        checker.check_configs_collision_free(q).tolist(),
        checker.calc_robot_clearance(q[0], 9.0).distances.tolist(),
        checker.num_pairs,
        checker.edge_step_size,
        checker.compute_configuration_distance(q[0], q[1]),
        checker.interpolate_between_configurations(q[0], q[1], 0.25).tolist(),
    )


@pytest.mark.search
@pytest.mark.parametrize("name", EDITS)
def test_an_interrupted_edit_is_done_or_not(checker, name):
    """All answers are those of one of the two checkers, and the edit can then be made."""
    edit, before = EDITS[name], answers(checker)
    copy = checker.clone()
    count = instruction_count(lambda: edit(copy))
    after = answers(copy)
    assert after != before
    for at in places(count, name):
        copy = checker.clone()
        interrupted_at(lambda copy=copy: edit(copy), at)
        found = answers(copy)
        if found == before:
            edit(copy)
            found = answers(copy)
        assert found == after, at


@pytest.mark.search
@pytest.mark.parametrize("name", CONTEXTS)
def test_an_interrupted_move_is_done_or_not(checker, name):
    """A context is where it was or where it is to be, and the checker's answers are the same."""
    move, before = CONTEXTS[name], answers(checker)
    copy = checker.clone()
    start = copy.model_context(0).q.tolist()
    count = instruction_count(lambda: move(copy))
    end = copy.model_context(0).q.tolist()
    assert end != start
    for at in places(count, name, 5):
        copy = checker.clone()
        interrupted_at(lambda copy=copy: move(copy), at)
        assert copy.model_context(0).q.tolist() in (start, end), at
        assert answers(copy) == before, at


Q1, Q2 = np.array([-1.0, 0.3]), np.array([0.4, 0.35])
EDGES = np.array([[Q1, Q2], [Q2, 2.0 * Q2]])
QUESTIONS = {
    "at": lambda c: c.at(c.model.context.snapshot).calc_robot_clearance(Q1, 9.0),
    "bodies": lambda c: [body.body_name for body in c.bodies],
    "columns": lambda c: c.calc_clearance_columns([Q1, Q2], 9.0),
    "depth": lambda c: c.calc_pair_depth(Q2, pair_of(c)),
    "clearance": lambda c: c.calc_robot_clearance(Q1, 9.0),
    "clearances": lambda c: c.calc_robot_clearances([Q1, Q2], 9.0),
    "configuration": lambda c: c.check_config_collision_free(Q1),
    "configurations": lambda c: c.check_configs_collision_free([Q1, Q2], threads=2),
    "checked": lambda c: c.checked_configurations([Q1, Q2]),
    "edge": lambda c: c.check_edge(Q1, Q2),
    "edge as the spec asks": lambda c: c.check_edge_collision_free(Q1, Q2),
    "edge in threads": lambda c: c.check_edge_collision_free_parallel(Q1, Q2, threads=2),
    "edges by samples": lambda c: c.check_edges_by_samples(EDGES),
    "edges": lambda c: c.check_edges_collision_free(EDGES),
    "statuses": lambda c: c.edge_statuses(EDGES, threads=2),
    "bodies in collision": lambda c: c.classify_body_collisions(Q2),
    "clone": lambda c: c.clone().calc_robot_clearance(Q1, 9.0),
    "distance": lambda c: c.compute_configuration_distance(Q1, Q2),
    "provider": lambda c: type(c.distance_and_interpolation_provider).__name__,
    "pair": lambda c: c.find_colliding_pair(Q2),
    "collisions": lambda c: c.find_collisions([Q1, Q2]),
    "added shapes": lambda c: list(c.get_all_added_collision_shapes()),
    "body": lambda c: c.get_body(balls(c)[0]).body_name,
    "filters": lambda c: c.get_filtered_collision_matrix(),
    "filters at first": lambda c: c.get_nominal_filtered_collision_matrix(),
    "largest padding": lambda c: c.get_largest_padding(),
    "padding": lambda c: c.get_padding_between(*balls(c)),
    "paddings": lambda c: c.get_padding_matrix(),
    "zero": lambda c: c.get_zero_configuration(),
    "interpolation": lambda c: c.interpolate_between_configurations(Q1, Q2, 0.3),
    "filtered": lambda c: c.is_collision_filtered_between(*balls(c)),
    "of a robot": lambda c: c.is_part_of_robot(balls(c)[0]),
    "straight": lambda c: c.is_straight,
    "distance alone": lambda c: c.make_standalone_configuration_distance_function()(Q1, Q2),
    "way alone": lambda c: c.make_standalone_configuration_interpolation_function()(Q1, Q2, 0.3),
    "context alone": lambda c: c.make_standalone_model_context().q,
    "most distances there": lambda c: c.max_context_num_distances(c.model_context(0)),
    "most distances": lambda c: c.max_num_distances(),
    "model": lambda c: c.model.tree.position_names,
    "context": lambda c: c.model_context().q,
    "pairs": lambda c: c.num_pairs,
    "padding to all": lambda c: str(c.maybe_get_uniform_robot_environment_padding()),
    "padding of itself": lambda c: str(c.maybe_get_uniform_robot_robot_padding()),
    "measure": lambda c: c.measure_edge(Q1, Q2),
    "measured": lambda c: c.measure_edge_collision_free(Q1, Q2),
    "measured in threads": lambda c: c.measure_edge_collision_free_parallel(Q1, Q2, threads=2),
    "measures": lambda c: c.measure_edges(EDGES),
    "measures as the spec asks": lambda c: c.measure_edges_collision_free(EDGES),
    "contexts": lambda c: c.num_allocated_contexts,
    "plan": lambda c: c.plan.tree.num_positions,
    "robots": lambda c: c.robot_model_instances,
    "samples": lambda c: c.samples(Q1, Q2),
    "snapshot": lambda c: c.snapshot.X_WG,
    "parallel": lambda c: c.supports_parallel_checking(),
    "tolerance": lambda c: c.tolerance,
    "way": lambda c: c.way(Q1, Q2),
    "other paddings": lambda c: c.with_pair_paddings(np.zeros(c.num_pairs)).num_pairs,
}


def pair_of(checker):
    """Return the geometries of the first pair that is checked."""
    found = checker.find_colliding_pair(Q2)
    return found.id_A, found.id_B


@pytest.mark.search
@pytest.mark.parametrize("name", QUESTIONS)
def test_an_interrupted_question_changes_no_answer(checker, name):
    """Neither its own nor another's, whatever it remembered."""
    ask, before = QUESTIONS[name], answers(checker)
    answer = plain(ask(checker.clone()))
    copy = checker.clone()
    count = instruction_count(lambda: ask(copy))
    for at in places(count, name, 5):
        copy = checker.clone()
        interrupted_at(lambda copy=copy: ask(copy), at)
        assert plain(ask(copy)) == answer, at
        assert answers(copy) == before, at


def test_each_public_method_is_tried(checker):
    """A new one has to be an edit or a question above; `from_params` makes a checker."""
    tried = (*EDITS.values(), *CONTEXTS.values(), *QUESTIONS.values())
    actions = [partial(each, checker.clone()) for each in tried]
    assert uncalled_methods(SceneGraphCollisionChecker, ["from_params"], actions) == set()

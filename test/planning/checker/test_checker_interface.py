"""Contexts and parameters of checkers, and checkers of one's own."""

import gc
import math
import threading

import numpy as np
import pytest
from robot_scenes import BALL, diagram, DRONE, SLIDE

from scene_graph_ros.geometry import Sphere
from scene_graph_ros.planning import (
    CollisionChecker,
    CollisionCheckerError,
    CollisionCheckerParams,
    LinearDistanceAndInterpolationProvider,
    load_robot_diagram,
    plan_path,
    SceneGraphCollisionChecker,
    UnimplementedCollisionChecker,
)
from scene_graph_ros.robots import KinematicTreeError


class Band(UnimplementedCollisionChecker):
    """Nothing is free where the first position is in a band."""

    def __init__(self, lower, upper, **parameters):
        super().__init__(supports_parallel_checking=False, **parameters)
        self.lower, self.upper, self.asked = lower, upper, 0

    def check_configs_collision_free(self, configurations, *, threads=1):
        q = np.asarray(configurations)[:, 0]
        self.asked += len(q)
        return (q < self.lower) | (q > self.upper)


@pytest.fixture(name="cell", scope="module")
def panda_cell():
    """A Panda between a table and a shelf."""
    return load_robot_diagram("config/scenes/panda_cell.yaml")


@pytest.fixture(name="slide")
def ball_on_a_rail(tmp_path):
    """A ball of 0.1 m on a rail along x, and another of 0.2 m at 1 m."""
    return diagram(tmp_path, SLIDE, BALL)


def lifted(z):
    """Return a pose so far along z."""
    X = np.eye(4)
    X[2, 3] = z
    return X


def test_a_context_has_the_scene_where_its_robots_are(cell):
    """All distances of the checker are those of its query object, with what is added later."""
    checker = SceneGraphCollisionChecker(cell)
    context = checker.make_standalone_model_context()
    rng = np.random.default_rng(5)
    for step in range(6):
        if step == 3:
            checker.add_collision_shape_to_body("grasp", "panda_hand", Sphere(0.05), lifted(0.2))
        q = rng.uniform(cell.tree.lower, cell.tree.upper)
        found = checker.calc_context_robot_clearance(context, q, 0.3)
        assert (context.q == q).all()
        query = context.query_object()
        for pair, distance in zip(found.pairs, found.distances, strict=True):
            there = query.compute_signed_distance_pair_closest_points(*pair).distance
            assert there == pytest.approx(distance, abs=1e-12)
        assert len(found.pairs) > 10
        free = checker.check_context_config_collision_free(context, q)
        assert free == checker.check_config_collision_free(q)
        kinds = checker.classify_context_body_collisions(context, q)
        assert kinds == checker.classify_body_collisions(q)
    (added,) = set(checker.snapshot.inspector.get_all_geometry_ids()) - set(
        cell.context.snapshot.inspector.get_all_geometry_ids()
    )
    assert any(added in pair for pair in found.pairs)
    assert checker.max_context_num_distances(context) == checker.num_pairs


def test_a_query_object_of_a_context_stays_as_it_was(slide):
    """It is of one moment; the context goes on."""
    checker = SceneGraphCollisionChecker(slide)
    context = checker.update_positions([0.0])
    before = context.query_object()
    assert not before.has_collisions()
    checker.update_context_positions(context, [0.8])
    assert context.query_object().has_collisions()
    assert not before.has_collisions()
    assert checker.measure_context_edge(context, [0.0], [1.0]).alpha == pytest.approx(
        0.7, abs=2e-6
    )
    assert context.q.tolist() == [1.0]
    with pytest.raises(ValueError, match="read-only"):
        context.q[0] = 3.0


def test_contexts_have_numbers_or_stand_alone(slide):
    """As many as asked for; an operation reaches all that are still there, and no other's."""
    checker = SceneGraphCollisionChecker(slide, implicit_context_parallelism=3)
    assert checker.num_allocated_contexts == 3
    assert checker.supports_parallel_checking()
    assert checker.model_context() is checker.model_context(0)
    assert checker.update_positions([0.5], 2) is checker.model_context(2)
    assert checker.model_context(2).q.tolist() == [0.5]
    kept, gone = (checker.make_standalone_model_context() for _ in range(2))
    checker.update_context_positions(kept, [0.25])
    del gone
    gc.collect()
    seen = []
    checker.perform_operation_against_all_model_contexts(
        lambda model, context: seen.append((model is slide, context.q.tolist()))
    )
    assert seen == [(True, [0.0]), (True, [0.0]), (True, [0.5]), (True, [0.25])]
    for number in (3, -1, True, "1"):
        with pytest.raises(CollisionCheckerError, match=f"from 0 to 2, not '?{number}'?"):
            checker.model_context(number)
    other = checker.clone()
    with pytest.raises(CollisionCheckerError, match="model_context is another checker's"):
        other.check_context_config_collision_free(kept, [0.0])
    with pytest.raises(CollisionCheckerError, match="must be a CollisionCheckerContext, not None"):
        checker.check_context_edge_collision_free(None, [0.0], [1.0])
    with pytest.raises(KinematicTreeError, match="'rail' of configuration 0 must be finite"):
        checker.update_context_positions(kept, [math.nan])
    assert kept.q.tolist() == [0.25]


def test_contexts_of_a_clone_have_its_shapes(slide):
    """What is added to the one is not in the other's scene."""
    checker = SceneGraphCollisionChecker(slide)
    other = checker.clone()
    checker.add_collision_shape_to_body("front", "ball", Sphere(0.5), np.eye(4))
    assert checker.update_positions([0.5]).query_object().has_collisions()
    assert not other.update_positions([0.5]).query_object().has_collisions()


def test_threads_with_contexts_of_their_own(slide):
    """Each sees its own positions."""
    checker = SceneGraphCollisionChecker(slide)
    found = {}

    def ask(k):
        context = checker.make_standalone_model_context()
        q = -0.95 + 0.1 * k
        free = checker.check_context_config_collision_free(context, [q])
        found[k] = (free, not context.query_object().has_collisions())

    threads = [threading.Thread(target=ask, args=(k,)) for k in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    # The balls overlap from 1 - 0.2 - 0.1 on.
    assert found == {k: (-0.95 + 0.1 * k < 0.7,) * 2 for k in range(20)}


def test_parameters_make_the_same_checker(slide):
    """By one value; all fields are used."""
    provider = LinearDistanceAndInterpolationProvider(slide.tree, [4.0])
    params = CollisionCheckerParams(
        model=slide,
        robot_model_instances=["robot"],
        edge_step_size=0.125,
        env_collision_padding=0.05,
        self_collision_padding=-0.01,
        distance_and_interpolation_provider=provider,
        implicit_context_parallelism=2,
    )
    checker = SceneGraphCollisionChecker.from_params(params, tolerance=1e-5)
    assert isinstance(checker, CollisionChecker)
    assert checker.robot_model_instances == ("robot",)
    assert checker.edge_step_size == 0.125
    assert checker.maybe_get_uniform_robot_environment_padding() == 0.05
    assert checker.maybe_get_uniform_robot_robot_padding() in (-0.01, 0.0)
    assert checker.distance_and_interpolation_provider is provider
    assert checker.num_allocated_contexts == 2
    assert checker.tolerance == 1e-5
    # The distance is 0.7 - q, of which 0.05 has to be kept.
    assert checker.measure_edge([0.0], [1.0]).alpha == pytest.approx(0.65, abs=3e-5)
    assert checker.get_zero_configuration().tolist() == [0.0]


def test_parameters_are_refused_by_name(slide):
    """Each with its value; robots that are not there, or missing."""
    good = {"model": slide, "robot_model_instances": ["robot"], "edge_step_size": 0.1}
    for bad, match in (
        ({"model": None}, "model must be a RobotDiagram, not None"),
        ({"robot_model_instances": []}, r"robot_model_instances must be names, one .*, not \[\]"),
        ({"robot_model_instances": "robot"}, "must be names, one at least, not 'robot'"),
        ({"edge_step_size": 0.0}, r"edge_step_size must be positive, not 0\.0"),
        ({"env_collision_padding": math.inf}, "env_collision_padding must be a finite number"),
        ({"self_collision_padding": "x"}, "self_collision_padding must be a finite number"),
        (
            {
                "distance_and_interpolation_provider": LinearDistanceAndInterpolationProvider(
                    slide.tree
                ),
                "configuration_distance_function": lambda q1, q2: 1.0,
            },
            "only one of distance_and_interpolation_provider",
        ),
    ):
        with pytest.raises(CollisionCheckerError, match=match):
            CollisionCheckerParams(**(good | bad))
    for names, match in (
        (["world"], "there is no robot 'world'"),
        ([], "one at least, of 'robot'"),
    ):
        with pytest.raises(CollisionCheckerError, match=match):
            SceneGraphCollisionChecker(slide, robot_model_instances=names)
    for count in (0, 1.5, "2"):
        with pytest.raises(CollisionCheckerError, match="implicit_context_parallelism must be a"):
            SceneGraphCollisionChecker(slide, implicit_context_parallelism=count)


def test_nothing_of_the_unimplemented_one_answers(slide):
    """Each question raises, with the method's name; what is no question is there."""
    checker = UnimplementedCollisionChecker(model=slide, supports_parallel_checking=False)
    for method, ask in {
        "check_configs_collision_free": lambda: checker.check_config_collision_free([0.0]),
        "check_configs_collision_free ": lambda: checker.check_edge_collision_free([0.0], [1.0]),
        "measure_edges": lambda: checker.measure_edge([0.0], [1.0]),
        "calc_robot_clearance": lambda: checker.calc_robot_clearance([0.0], 1.0),
        "classify_body_collisions": lambda: checker.classify_body_collisions([0.0]),
        "max_num_distances": checker.max_num_distances,
    }.items():
        with pytest.raises(NotImplementedError, match=f"does not implement {method.strip()}$"):
            ask()
    assert not checker.supports_parallel_checking()
    assert checker.num_allocated_contexts == 1
    checker.set_padding_all_robot_environment_pairs(0.25)
    assert checker.get_largest_padding() == 0.25
    assert checker.compute_configuration_distance([0.0], [2.0]) == 2.0
    assert checker.add_collision_shape_to_body("front", "ball", Sphere(0.1), np.eye(4))
    with pytest.raises(TypeError, match="abstract"):
        CollisionChecker(slide)


def test_edges_of_a_checker_of_ones_own_are_sampled(tmp_path):
    """At steps of at most the step size, both ends included; what is thinner is not found."""
    slide = diagram(tmp_path, SLIDE)
    checker = Band(0.5, 0.53, model=slide, edge_step_size=0.05)
    assert checker.check_config_collision_free([0.4])
    assert not checker.check_config_collision_free([0.51])
    checker.asked = 0
    assert not checker.check_edge_collision_free([0.0], [1.0])
    assert checker.asked == 21
    free = checker.check_edges_collision_free([[[0.0], [0.4]], [[0.51], [0.9]], [[0.9], [0.51]]])
    assert free.tolist() == [True, False, False]
    # From 0.51 - 0.2 in steps of 0.2 the band is passed over.
    checker.set_edge_step_size(0.4)
    assert checker.check_edge_collision_free([0.31], [1.11])
    with pytest.raises(CollisionCheckerError, match=r"shape \(n, 2, 1\), not \(3, 1\)"):
        checker.check_edges_collision_free(np.zeros((3, 1)))
    drone = Band(0.9, 2.0, model=diagram(tmp_path, DRONE))
    # Half a turn about z: cos of half the angle is above 0.9 at first.
    assert not drone.check_edge_collision_free([0.8, 0, 0, 0.6, 0, 0, 0], [1.0, 0, 0, 0, 0, 0, 0])
    assert drone.check_edge_collision_free([0.8, 0, 0, 0.6, 0, 0, 0], [0.6, 0, 0, 0.8, 0, 0, 0])


@pytest.mark.parametrize("bad", [[math.nan], [math.inf], [0.0, 0.0], "no"])
def test_checkers_of_ones_own_refuse_what_is_no_number(tmp_path, bad):
    """Before the function that answers sees it."""
    checker = Band(0.5, 0.53, model=diagram(tmp_path, SLIDE), edge_step_size=0.05)
    checker.asked = 0
    with pytest.raises((KinematicTreeError, CollisionCheckerError)):
        checker.check_config_collision_free(bad)
    assert checker.asked == 0


def test_a_robot_without_joints_has_one_configuration(tmp_path):
    """It is welded to what is around it, so nothing is checked, and all questions have answers."""
    post = """<robot name="post"><link name="base"><collision><geometry><sphere radius="0.3"/>
      </geometry></collision></link></robot>"""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, post, BALL))
    assert checker.num_pairs == 0
    assert checker.get_zero_configuration().shape == (0,)
    assert checker.check_configs_collision_free(np.zeros((3, 0))).tolist() == [True] * 3
    assert checker.measure_edge([], []).completely_free
    assert checker.compute_configuration_distance([], []) == 0.0
    assert plan_path(checker, [], []).is_success

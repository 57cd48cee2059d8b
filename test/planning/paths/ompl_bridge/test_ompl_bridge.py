"""OMPL's planners: their states are our configurations, and each motion is proven by us."""

from concurrent.futures import ThreadPoolExecutor
import gc
import math
import sys
import weakref

import numpy as np
import pytest
from robot_scenes import ARM, BALL, diagram, DRONE, PLATE, POSTS, ROD, SLIDE
from scipy.spatial.transform import Rotation

from scene_graph_ros.planning import (
    load_robot_diagram,
    MissingOmplError,
    OmplPlanner,
    OmplSpace,
    plan_path,
    PlanFailure,
    PlanningError,
    Roadmap,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.paths.ompl_bridge import ompl_library

CELL = "config/scenes/panda_cell.yaml"
HOME = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])

# Between these the stretched arm has to fold past a ball.
START, GOAL = [0.0, 0.0], [1.3, 0.0]


@pytest.fixture
def arm(tmp_path):
    """An arm of two joints between two posts."""
    return SceneGraphCollisionChecker(diagram(tmp_path, ARM, POSTS))


@pytest.fixture
def rod(tmp_path):
    """A rod that turns without an end, and a plate of 0.1 mm in its way at 0.5."""
    return SceneGraphCollisionChecker(diagram(tmp_path, ROD, PLATE))


def is_free_along(checker, path, count=1000):
    """Tell whether none of so many configurations on each edge collides."""
    t = np.linspace(0.0, 1.0, count)[:, np.newaxis, np.newaxis]
    along = ((1.0 - t) * path[:-1] + t * path[1:]).reshape(-1, path.shape[1])
    return checker.check_configs_collision_free(along).all()


@pytest.mark.parametrize(
    "planner",
    [
        OmplPlanner("RRTConnect"),
        OmplPlanner("PRM"),
        OmplPlanner("RRTstar", parameters={"range": 0.5, "goal_bias": 0.1}),
        OmplPlanner("BITstar", edges=500),
        OmplPlanner("KPIECE1"),
    ],
    ids=lambda planner: planner.name,
)
def test_paths_are_proven(arm, planner):
    """From the start to the goal, around the ball; each edge once more by the checker itself."""
    assert not arm.check_edge_collision_free(START, GOAL)
    plan = plan_path(arm, START, GOAL, planner=planner, timeout=60)
    assert plan.is_success and plan.proven, plan.reason
    np.testing.assert_array_equal(plan.configurations[[0, -1]], [START, GOAL])
    edges = np.stack([plan.configurations[:-1], plan.configurations[1:]], axis=1)
    assert all(measure.completely_free for measure in arm.measure_edges(edges))
    assert is_free_along(arm, plan.configurations) and plan.least_clearance > 0.0
    assert plan.edges >= (planner.edges or 1)


def test_a_panda_goes_through_its_cell():
    """Joints of the group move, the fingers stay; any of two goals will do."""
    checker = SceneGraphCollisionChecker(load_robot_diagram(CELL))
    far = HOME + np.array([1.8, 0.3, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0])
    goals = [HOME + 1.5 * np.eye(8)[1], far]  # the first collides
    plan = plan_path(
        checker, HOME, goals, planner=OmplPlanner("RRTConnect"), group="arm", timeout=60
    )
    assert plan.is_success and plan.goal == 1, plan.reason
    np.testing.assert_array_equal(plan.configurations[-1], far)
    assert (plan.configurations[:, -1] == HOME[-1]).all()
    assert is_free_along(checker, plan.configurations)


def test_the_validator_sees_what_is_between_samples(rod):
    """A motion over the plate is refused, one that ends before it is not."""
    space = OmplSpace(rod, [0.0])
    before, inside, behind = (space.state([angle]) for angle in (0.4, 0.5, 0.6))
    information = space.information
    assert information.isValid(before) and information.isValid(behind)
    assert not information.isValid(inside)
    assert not information.checkMotion(before, behind)
    assert information.checkMotion(space.state([0.1]), before)
    # The short way round is the motion, also where angles begin anew.
    assert information.checkMotion(space.state([3.0]), space.state([3.0 + 1.0]))
    assert space.edges == 3


def test_a_joint_without_an_end_goes_round(rod):
    """It is past the plate already one turn on: the rod gets there the other way."""
    plan = plan_path(rod, [7.0], [0.3], planner=OmplPlanner("RRTConnect"), timeout=60)
    assert plan.is_success, plan.reason
    path = plan.configurations[:, 0]
    assert path[0] == 7.0
    # At 7.0 the plate, at 0.5 + 2 pi, is behind; 0.3 comes again one turn later.
    assert path[-1] == pytest.approx(0.3 + 4.0 * math.pi, abs=1e-12)
    assert is_free_along(rod, plan.configurations)


def test_distances_and_limits_are_ours(arm, tmp_path):
    """Euclidean where all joints have limits; else the parts of OMPL's space add up."""
    rng = np.random.default_rng(3)
    tree = arm.plan.tree
    space = OmplSpace(arm, START)
    a, b = rng.uniform(tree.lower, tree.upper, (2, 20, 2))
    distance = space.information.distance
    found = [distance(*map(space.state, ends)) for ends in zip(a, b, strict=True)]
    np.testing.assert_allclose(found, np.linalg.norm(a - b, axis=1), rtol=1e-15)
    for q, is_inside in ((tree.lower, True), (tree.upper + 1e-6, False)):
        assert space.information.satisfiesBounds(space.state(q)) is is_inside
    (tmp_path / "drone").mkdir()
    drone = SceneGraphCollisionChecker(diagram(tmp_path / "drone", DRONE, POSTS))
    space = OmplSpace(drone, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    turn = Rotation.from_rotvec([0.0, 0.7, 0.0]).as_quat(scalar_first=True)
    q = [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], [*-turn, 0.3, 0.4, 1.0]]
    # The angle, and the way of the body's origin.
    found = space.information.distance(space.state(q[0]), space.state(q[1]))
    assert found == pytest.approx(0.7 + 0.5, rel=1e-14)
    np.testing.assert_allclose(space.configuration(space.state(q[1])), q[1], atol=1e-15)


def test_a_body_that_floats_gets_past_a_post(tmp_path):
    """Its quaternions stay of length one, and each edge is proven."""
    post = """
geometries:
  - {name: post, source: around, pose: {xyz: [1, 0, 0]}, shape: {type: box, size: [0.2, 2, 2]}}
"""
    drone = SceneGraphCollisionChecker(diagram(tmp_path, DRONE, post))
    start, goal = ([1.0, 0.0, 0.0, 0.0, x, 0.0, 0.0] for x in (0.0, 2.0))
    plan = plan_path(drone, start, goal, planner=OmplPlanner("RRTConnect"), timeout=60)
    assert plan.is_success, plan.reason
    lengths = np.linalg.norm(plan.configurations[:, :4], axis=1)
    np.testing.assert_allclose(lengths, 1.0, atol=1e-12)
    edges = np.stack([plan.configurations[:-1], plan.configurations[1:]], axis=1)
    assert all(measure.completely_free for measure in drone.measure_edges(edges))


def test_the_seed_decides(arm):
    """The same gives the same path."""
    planner = OmplPlanner("RRTConnect", parameters={"range": 0.3})
    one, two, other = (
        plan_path(arm, START, GOAL, planner=planner, seed=seed, timeout=60).configurations
        for seed in (4, 4, 5)
    )
    np.testing.assert_array_equal(one, two)
    assert not np.array_equal(one, other)


def test_threads_plan_beside_each_other(arm):
    """Each gets a path of its own."""
    planner = OmplPlanner("RRTConnect")

    def plan(seed):
        return plan_path(arm, START, GOAL, planner=planner, seed=seed, timeout=60)

    with ThreadPoolExecutor(3) as pool:
        assert all(each.is_success for each in pool.map(plan, range(6)))


def test_time_limit(tmp_path):
    """What is walled in is not reached, and the reason says who looked for it how long."""
    slide = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    plan = plan_path(slide, [-3.0], [3.0], planner=OmplPlanner("RRTConnect"), timeout=0.2)
    assert plan.failure is PlanFailure.TIMEOUT
    assert "within 0.2 s: OMPL's RRTConnect looked at" in plan.reason
    ended = plan_path(slide, [-3.0], [3.0], planner=OmplPlanner("BITstar", edges=50), timeout=60)
    assert ended.failure is PlanFailure.EXHAUSTED and ended.edges >= 50


def test_what_makes_no_sense_is_refused(arm):
    """Errors name the argument, and what there is instead."""
    for planner, words in (
        (OmplPlanner("RRTConect"), "no planner 'RRTConect'.*RRTConnect"),
        (OmplPlanner("RRTConnect", parameters={"rnage": 1}), "no parameter 'rnage'.*range"),
        (OmplPlanner("RRTConnect", parameters={"range": "x"}), "'range' of RRTConnect"),
        ("ompl", "or an OmplPlanner"),
    ):
        with pytest.raises(PlanningError, match=words):
            plan_path(arm, START, GOAL, planner=planner)
    with pytest.raises(PlanningError, match="roadmap"):
        plan_path(arm, START, GOAL, planner=OmplPlanner("PRM"), roadmap=Roadmap())
    for arguments, words in (
        ({"name": 3}, "name"),
        ({"name": "PRM", "edges": 0}, "edges"),
        ({"name": "PRM", "edges": 1.5}, "edges"),
        ({"name": "PRM", "parameters": [1]}, "parameters"),
    ):
        with pytest.raises(PlanningError, match=words):
            OmplPlanner(**arguments)
    with pytest.raises(PlanningError, match="q must have shape"):
        OmplSpace(arm, [START])


def test_ompl_that_is_missing_is_named(monkeypatch, arm):
    """The error says what to install."""
    ompl_library.get_ompl.cache_clear()
    monkeypatch.setitem(sys.modules, "ompl.base", None)
    try:
        with pytest.raises(MissingOmplError, match="pip install ompl"):
            plan_path(arm, START, GOAL, planner=OmplPlanner("RRTConnect"))
    finally:
        ompl_library.get_ompl.cache_clear()


def test_ompl_keeps_nothing_of_ours(arm):
    """A search's arrays are gone with it, and OMPL's objects without them say so."""
    space = OmplSpace(arm, START)
    information, state = space.information, space.state(START)
    proofs = weakref.ref(space._proofs)
    assert information.isValid(state)
    del space
    gc.collect()
    assert proofs() is None
    with pytest.raises(PlanningError, match="keep it"):
        information.isValid(state)

"""Paths and trajectories that hold constraints at all times, or why there are none.

Truths are samples of kinematics that share nothing with the package's.
"""

from itertools import pairwise
import math
from pathlib import Path

import numpy as np
from plain_kinematics import PlainRobot, random_robot, slerped
import pytest
from robot_scenes import BALL, CART, diagram, POST

from scene_graph_ros.planning import (
    AngleBetweenVectorsConstraint,
    inverse_kinematics,
    load_robot_diagram,
    OrientationConstraint,
    plan_path,
    plan_straight,
    plan_trajectory,
    PlanFailure,
    PlanningError,
    PoseTarget,
    PositionConstraint,
    prove_trajectory,
    SceneGraphCollisionChecker,
    StraightFailure,
    thin_trajectory,
    time_path,
    TimingFailure,
)
from scene_graph_ros.planning.trajectories import MotionLimits
from scene_graph_ros.scene_files import resolve_resource

START = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])
ARM = tuple(f"panda_joint{i}" for i in range(1, 8))
PANDA = "package://example-robot-data/robots/panda_description/urdf/panda.urdf"
HAND = "panda_hand"
DOWN = np.diag([1.0, -1.0, -1.0])


@pytest.fixture(scope="module")
def cell():
    """A Panda between a table and a shelf, with what stands on them."""
    return SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))


@pytest.fixture(scope="module")
def panda():
    """The same arm, by matrices."""
    return PlainRobot(Path(resolve_resource(PANDA)).read_text())


@pytest.fixture(scope="module")
def carried(cell):
    """Two configurations whose hand points down: over the table, and above the shelf's board."""
    found = []
    for p, yaw in (((0.5, -0.3, 0.8), 0.3), ((0.1, 0.55, 1.0), 1.5)):
        X = np.eye(4)
        c, s = math.cos(yaw), math.sin(yaw)
        X[:3, :3] = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ DOWN
        X[:3, 3] = p
        answer = inverse_kinematics(cell, PoseTarget(HAND, X), near=START, group="arm")
        assert answer.is_success
        found.append(answer.configurations[0])
    return found


def upright(angle):
    """Return that the hand points down but for an angle."""
    return AngleBetweenVectorsConstraint(HAND, [0, 0, -1], [0, 0, 1], angle)


def on_edges(robot, path, order, samples=60):
    """Return configurations on all edges, in the order of the plain robot's positions."""
    q = path[:, np.argsort(order)] if order is not None else path
    t = np.linspace(0.0, 1.0, samples)
    return np.array([slerped(robot, a, b, each) for a, b in pairwise(q) for each in t])


def tilts(robot, configurations):
    """Return the angles between the hand's axis and straight down."""
    z = np.array([robot.relative(q, None, HAND)[:3, 2] for q in configurations])
    return np.arctan2(np.hypot(z[:, 0], z[:, 1]), -z[:, 2])


@pytest.mark.parametrize("angle", [0.3, 0.02, 0.002])
def test_a_cup_stays_upright(cell, panda, carried, angle):
    """From the table to the shelf: each sample of each edge, by another kinematics."""
    plan = plan_path(cell, *carried, group="arm", constraints=[upright(angle)], timeout=60.0)
    assert plan.is_success and plan.proven, plan.reason
    np.testing.assert_array_equal(plan.configurations[[0, -1]], carried)
    assert tilts(panda, on_edges(panda, plan.configurations, None)).max() <= angle + 2e-9
    q = plan.configurations
    assert cell.check_edges_collision_free(np.stack([q[:-1], q[1:]], axis=1)).all()
    assert (q[:, 7] == START[7]).all()
    # Without the constraint the hand is tilted on the way.
    free = plan_path(cell, *carried, group="arm").configurations
    assert tilts(panda, on_edges(panda, free, None)).max() > 0.03


def test_it_is_the_same_path_again(cell, carried):
    """For the same seed, whatever was planned before."""
    both = [
        plan_path(cell, *carried, group="arm", constraints=[upright(0.1)], seed=3, timeout=60.0)
        for _ in range(2)
    ]
    np.testing.assert_array_equal(both[0].configurations, both[1].configurations)
    assert both[0].edges == both[1].edges


def test_trajectories_hold_it_at_all_times(cell, panda, carried):
    """Also on rounded corners, and where points are left out; limits are kept."""
    limits = MotionLimits([2.175] * 4 + [2.61] * 3, [15.0] * 7, ARM, [500.0] * 7)
    held = [upright(0.05)]
    how = {"group": "arm", "constraints": held, "timeout": 60.0}
    motion = plan_trajectory(cell, *carried, limits, **how)
    assert motion.is_success, motion.reason
    thin = thin_trajectory(cell, motion, limits, 12, deviation=0.05, constraints=held)
    for each in (motion, thin) if thin.is_success else (motion,):
        q = each.trajectory.value(np.linspace(0.0, each.duration, 600))
        assert tilts(panda, q).max() <= 0.05 + 2e-9
        assert cell.check_configs_collision_free(q).all()
    assert prove_trajectory(cell, motion.points, limits, constraints=held).is_success
    late = prove_trajectory(cell, motion.points, limits, constraints=[upright(0.01)])
    assert late.failure is TimingFailure.CONSTRAINT
    assert "constraint 0 (AngleBetweenVectorsConstraint on 'panda_hand')" in late.reason


def test_a_tool_stays_in_a_box(cell, panda):
    """A point before the hand keeps to a slab; the hand may turn."""
    goal = START + np.array([1.0, 0.3, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0])
    ends = np.stack([START, goal])

    def heights(q):
        X = np.array([panda.relative(each, None, HAND) for each in q])
        return (X @ np.array([0.0, 0.0, 0.1, 1.0]))[:, 2] + 0.4  # the pedestal

    z = heights(ends)
    low, high = z.min() - 0.01, z.max() + 0.01
    box = PositionConstraint(HAND, [-1.0, -1.0, low], [1.0, np.inf, high], [0.0, 0.0, 0.1])
    plan = plan_path(cell, START, goal, group="arm", constraints=[box], timeout=60.0)
    assert plan.is_success, plan.reason
    along = heights(on_edges(panda, plan.configurations, None))
    assert along.min() >= low - 2e-9 and along.max() <= high + 2e-9


def test_reasons_name_constraint_value_and_bound(cell, carried):
    """Of the start, of the goal, of several goals; and those of limits come first."""
    tilted = carried[1] + np.array([0, 0, 0, 0, 0, 0.4, 0, 0])
    how = {"group": "arm", "constraints": [upright(0.05)]}
    plan = plan_path(cell, tilted, carried[0], **how)
    assert plan.failure is PlanFailure.START_VIOLATES_CONSTRAINT
    assert plan.reason == (
        "the start violates constraint 0 (AngleBetweenVectorsConstraint on 'panda_hand'): the"
        " angle in the world must be from 0 to 0.05 rad, and is 0.4"
    )
    plan = plan_path(cell, carried[0], [tilted, tilted], **how)
    assert plan.failure is PlanFailure.GOAL_VIOLATES_CONSTRAINT
    assert plan.reason.startswith("none of 2 goals can be reached: goal 0 violates constraint 0")
    assert plan_path(cell, carried[0], [tilted, carried[1]], **how, timeout=60.0).goal == 1
    turned = OrientationConstraint("panda_link5", np.eye(3), 0.1)
    plan = plan_path(cell, carried[0], carried[1], group="arm", constraints=[turned])
    assert "theta_bound is 0.1" in plan.reason and "'panda_link5'" in plan.reason
    X_WT = np.eye(4)
    X_WT[:3, 3] = (0.5, -0.3, 0.9)
    X_WT[:3, :3] = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    plan = plan_path(cell, carried[0], PoseTarget(HAND, X_WT), **how, timeout=60.0)
    assert plan.failure in (PlanFailure.GOAL_VIOLATES_CONSTRAINT, PlanFailure.GOAL_COLLIDES)


def test_what_can_not_be_planned_for(cell, carried):
    """Other planners, and no constraints at all."""
    with pytest.raises(PlanningError, match="planner 'rrt_connect', not for 'prm'"):
        plan_path(cell, *carried, planner="prm", constraints=[upright(0.1)])
    with pytest.raises(PlanningError, match="constraints must be"):
        plan_path(cell, *carried, constraints=upright(0.1))
    plain, empty = (plan_path(cell, *carried, group="arm", **k) for k in ({}, {"constraints": []}))
    np.testing.assert_array_equal(plain.configurations, empty.configurations)


@pytest.fixture(scope="module")
def cart(tmp_path_factory):
    """A ball on two rails with a post at (1, 0.5), both of radius 0.1."""
    robots = diagram(tmp_path_factory.mktemp("cart"), CART, POST.format(x=1.0, y=0.5))
    return SceneGraphCollisionChecker(robots)


def corridor(low, high):
    """Return that the ball's y is between two numbers."""
    return PositionConstraint("ball", [-np.inf, low, -np.inf], [np.inf, high, np.inf])


def test_a_box_decides_the_side_of_a_post(cart):
    """Between y = 0.35 and 1 the ball passes above it, between 0 and 0.65 below."""
    ends = np.array([[0.0, 0.5], [2.0, 0.5]])
    for low, high in ((0.35, 1.0), (0.0, 0.65)):
        plan = plan_path(cart, *ends, constraints=[corridor(low, high)], timeout=60.0)
        assert plan.is_success, plan.reason
        y = plan.configurations[:, 1]
        assert low - 1e-9 <= y.min() and y.max() <= high + 1e-9
        assert (y.max() > 0.7) == (high == 1.0)


@pytest.mark.parametrize(("beyond", "holds"), [(3e-4, True), (8e-4, False)])
def test_the_way_back_to_limits_holds_constraints_too(cart, beyond, holds):
    """The ball is beyond its limit; the constraint holds within it, and up to 0.5 mm beyond."""
    limit = float(cart.plan.tree.lower[0])
    box = PositionConstraint("ball", [limit - 5e-4, -np.inf, -np.inf], [np.inf] * 3)
    start, goal = [limit - beyond, 0.0], [limit + 0.2, 0.0]
    plan = plan_path(cart, start, goal, constraints=[box], start_tolerance=1e-3, timeout=60.0)
    assert plan.is_success == holds, plan.reason
    if not holds:
        assert plan.failure is PlanFailure.START_VIOLATES_CONSTRAINT
        assert plan.reason.startswith("the way from the start back to limits")
        assert "constraint 0 (PositionConstraint on 'ball')" in plan.reason


def test_what_no_path_can_hold_ends_with_the_time(cart):
    """A corridor that the post closes: the search says how far it came."""
    plan = plan_path(cart, [0.0, 0.5], [2.0, 0.5], constraints=[corridor(0.35, 0.65)], timeout=0.3)
    assert plan.failure is PlanFailure.TIMEOUT
    assert "the trees from start and goal have" in plan.reason and "0.3 s" in plan.reason
    late = plan_path(cart, [0.0, 0.5], [2.0, 0.5], constraints=[corridor(0, 1)], timeout=0.0)
    assert late.failure is PlanFailure.TIMEOUT


def test_who_watches_may_end_it(cart):
    """The exception of a function that watches comes out of a search with constraints."""

    class EnoughError(Exception):
        pass

    def enough(progress):
        if progress.edges > 0:
            raise EnoughError

    with pytest.raises(EnoughError):
        plan_path(
            cart,
            [0.0, 0.5],
            [2.0, 0.5],
            constraints=[corridor(0.35, 0.65)],
            watch=enough,
            timeout=60.0,
        )


def test_rounded_corners_hold_constraints(cell, panda, carried):
    """A path with few corners is timed within its tolerance: corners are rounded less, or not."""
    held, limits = [upright(0.01)], MotionLimits([2.0] * 7, [8.0] * 7, ARM)
    plan = plan_path(cell, *carried, group="arm", constraints=held, timeout=60.0)
    kept = time_path(cell, plan.configurations, limits, constraints=held)
    assert kept.is_success, kept.reason
    q = kept.trajectory.value(np.linspace(0.0, kept.duration, 600))
    assert tilts(panda, q).max() <= 0.01 + 2e-9


def test_paths_of_others_that_violate_constraints_are_not_timed(cart):
    """The failure says which one, where it is, and when."""
    path, limits = np.array([[0.0, 0.0], [0.5, 0.0]]), MotionLimits([1, 1], [2, 2], ("x", "y"))
    none = time_path(cart, path, limits, constraints=[corridor(0.1, 1.0)])
    assert none.failure is TimingFailure.CONSTRAINT and "between 0 and" in none.reason
    assert "y of its point in the box must be from 0.1 to 1 m, and is 0" in none.reason
    assert time_path(cart, path, limits, constraints=[corridor(0.0, 1.0)]).is_success


def test_straight_motions_end_at_a_constraint(cell):
    """The hand goes along y up to the side of a box, less one step; and starts inside of it."""
    tree = cell.plan.tree
    X_1 = tree.link_poses(START, [HAND])[0]
    X_2 = X_1.copy()
    X_2[1, 3] += 0.2
    most = X_1[1, 3] + 0.1
    box = PositionConstraint(HAND, [-9.0] * 3, [9.0, most, 9.0])
    way = plan_straight(cell, START, [X_2], HAND, group="arm", constraints=[box])
    assert way.failure is StraightFailure.CONSTRAINT and "constraint 0" in way.reason
    assert 0.2 < way.fraction <= 0.5
    ends = tree.link_poses(way.configurations, [HAND])[:, 0, 1, 3]
    assert ends.max() <= most + 1e-9
    outside = PositionConstraint(HAND, [-9.0] * 3, [9.0, X_1[1, 3] - 0.1, 9.0])
    way = plan_straight(cell, START, [X_2], HAND, group="arm", constraints=[outside])
    assert way.failure is StraightFailure.START_VIOLATES_CONSTRAINT
    assert "violates constraint 0" in way.reason
    wide = PositionConstraint(HAND, [-9.0] * 3, [9.0] * 3)
    assert plan_straight(cell, START, [X_2], HAND, group="arm", constraints=[wide]).is_success


@pytest.mark.parametrize("seed", range(6))
def test_random_robots(tmp_path, seed):
    """Turning without end, sliding, planar and floating joints: paths hold what they should."""
    floats = seed % 2 == 0
    urdf = random_robot(np.random.default_rng(seed + 40), floats=floats)
    robot = PlainRobot(urdf)
    checker = SceneGraphCollisionChecker(
        diagram(tmp_path, urdf, BALL.replace("1, 0, 0", "9, 9, 9"))
    )
    tree = checker.plan.tree
    order = [robot.position_names.index(name) for name in tree.position_names]
    rng = np.random.default_rng(seed)
    a = robot.random(rng)
    b = a + 0.6 * rng.standard_normal(len(a))
    link = str(rng.choice(robot.links[2:]))
    axes = [robot.relative(q, None, link)[:3, 2] for q in (a, b)]
    middle = axes[0] + axes[1]
    middle /= np.linalg.norm(middle)
    angle = math.acos(np.clip(axes[0] @ middle, -1.0, 1.0)) + 0.02
    places = np.array([robot.relative(q, None, "l6")[:3, 3] for q in (a, b)])
    held = [
        AngleBetweenVectorsConstraint(link, middle, [0, 0, 1], min(angle, math.pi)),
        PositionConstraint("l6", places.min(axis=0) - 0.05, places.max(axis=0) + 0.05),
    ]
    plan = plan_path(checker, a[order], b[order], constraints=held, timeout=60.0)
    assert plan.is_success, plan.reason
    for q in on_edges(robot, plan.configurations, order, 40):
        z = robot.relative(q, None, link)[:3, 2]
        assert math.atan2(np.linalg.norm(np.cross(z, middle)), z @ middle) <= angle + 2e-9
        p = robot.relative(q, None, "l6")[:3, 3]
        assert (p >= held[1].p_FQ_lower - 2e-9).all() and (p <= held[1].p_FQ_upper + 2e-9).all()


def test_a_constraint_on_what_no_joint_of_the_group_moves(cell, carried):
    """The base's: held by all paths, or by none."""
    held = PositionConstraint("panda_link0", [-0.1, -0.1, 0.3], [0.1, 0.1, 0.5])
    plan = plan_path(cell, *carried, group="arm", constraints=[held], timeout=60.0)
    assert plan.is_success
    never = PositionConstraint("panda_link0", [0.1, -0.1, 0.3], [0.2, 0.1, 0.5])
    plan = plan_path(cell, *carried, group="arm", constraints=[never])
    assert plan.failure is PlanFailure.START_VIOLATES_CONSTRAINT

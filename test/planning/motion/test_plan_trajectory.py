"""Motions in one call: fast, within limits, free at all times; or why there is none.

Truths are closed forms of how fast joints are, and samples that the proofs don't know.
"""

from itertools import pairwise

import numpy as np
import pytest
from robot_scenes import BALL, CART, diagram, POST, SLIDE

from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperrectangle, Point
from scene_graph_ros.planning import (
    load_robot_diagram,
    plan_trajectory,
    PlanFailure,
    PlanningError,
    PlanStage,
    PoseTarget,
    SceneGraphCollisionChecker,
    time_path,
    TimingFailure,
)
from scene_graph_ros.planning.trajectories import find_excess, MotionLimits, TrajectoryError
from scene_graph_ros.trajectories.straight_motion import least_duration

START = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])
GOAL = START + 0.9 * np.eye(8)[0]
ARM = [f"panda_joint{i}" for i in range(1, 8)]


@pytest.fixture(scope="module")
def cart(tmp_path_factory):
    """A ball on two rails with a post at (1, 0), both of radius 0.1."""
    robots = diagram(tmp_path_factory.mktemp("cart"), CART, POST.format(x=1.0, y=0.0))
    return SceneGraphCollisionChecker(robots)


@pytest.fixture(scope="module")
def cell():
    """A Panda between a table and a shelf, with what stands on them."""
    return SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))


def cart_limits(v=1.0, a=2.0, jerk=20.0):
    """Return limits of both rails."""
    return MotionLimits([v] * 2, [a] * 2, ("x", "y"), None if jerk is None else [jerk] * 2)


def panda_limits():
    """Return limits of the arm's joints."""
    return MotionLimits([2.175] * 4 + [2.61] * 3, [15.0] * 7, tuple(ARM), [500.0] * 7)


def assert_sound(checker, motion, start, goal, limits):
    """It leads from the start to the goal, from rest to rest, within limits, and is free."""
    assert motion.is_success, motion.reason
    points, tree = motion.points, checker.plan.tree
    np.testing.assert_array_equal(points.positions[[0, -1]], [start, goal])
    assert not points.velocities[[0, -1]].any()
    rows = [tree.position_index(name) for name in limits.names]
    own = points.of(np.array(rows))
    assert find_excess(own.trajectory(), limits) is None
    t = np.linspace(0.0, motion.duration, 400)
    along = motion.trajectory.value(t)
    assert (along >= tree.lower - 1e-9).all() and (along <= tree.upper + 1e-9).all()
    assert checker.check_configs_collision_free(along).all()
    nearest = min(
        checker.calc_robot_clearance(q, 2.0).distances.min(initial=2.0) for q in along[::8]
    )
    assert 0.0 <= motion.least_clearance <= nearest + 1e-12
    assert motion.plan.is_success
    np.testing.assert_array_equal(motion.plan.configurations[[0, -1]], [start, goal])


@pytest.mark.parametrize("jerk", [20.0, None])
def test_a_ball_goes_round_a_post_without_losing_time(cart, jerk):
    """Two metres along x, where 0.2 m aside cost nothing: x alone says how long it has to take."""
    limits = cart_limits(jerk=jerk)
    start, goal = np.array([0.0, 0.0]), np.array([2.0, 0.0])
    motion = plan_trajectory(cart, start, goal, limits)
    assert_sound(cart, motion, start, goal, limits)
    least = least_duration(goal - start, limits)
    assert least == pytest.approx(2.0 + 0.5 + (0.0 if jerk is None else 0.1))
    assert least <= motion.duration <= 1.04 * least
    if jerk is not None:
        along = time_path(cart, motion.plan.configurations, limits)
        assert motion.duration < along.duration
    assert (motion.points.accelerations is None) == (jerk is None)


def test_a_straight_way_takes_the_closed_form(cart):
    """A metre at 1 m/s, 2 m/s^2 and 20 m/s^3: 1 / 1 + 1 / 2 + 2 / 20 s."""
    start, goal = np.array([0.0, 0.5]), np.array([1.0, 0.9])
    motion = plan_trajectory(cart, start, [goal, goal + 0.0], cart_limits())
    assert_sound(cart, motion, start, goal, cart_limits())
    assert motion.duration == pytest.approx(1.6, rel=1e-6)
    assert motion.plan.goal == 0


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_slow_and_fast_robots_are_planned_for_alike(cart, scale):
    """Limits are scaled as if another clock ran: all durations are, but for nanoseconds."""
    start, goal = np.array([0.0, 0.0]), np.array([2.0, 0.1])
    limits = cart_limits(scale, 2.0 * scale**2, 20.0 * scale**3)
    motion = plan_trajectory(cart, start, goal, limits)
    assert_sound(cart, motion, start, goal, limits)
    assert motion.duration * scale == pytest.approx(2.6, rel=0.05)


def test_a_motion_that_is_next_to_nothing(cart):
    """A micrometre, and nothing at all."""
    start = np.array([0.3, 0.7])
    for way in (1e-6, 0.0):
        goal = start + np.array([way, 0.0])
        motion = plan_trajectory(cart, start, goal, cart_limits())
        assert_sound(cart, motion, start, goal, cart_limits())
        assert motion.duration < 0.03


def test_what_touches_at_the_start_leaves_it(cart):
    """The ball begins a tenth of a millimetre from the post and goes to its other side."""
    start, goal = np.array([0.7999, 0.0]), np.array([1.2001, 0.0])
    motion = plan_trajectory(cart, start, goal, cart_limits())
    assert_sound(cart, motion, start, goal, cart_limits())
    assert motion.least_clearance <= 1e-4


def test_an_arm_gets_out_of_a_shelf(cell):
    """Faster than along the path, the same for the same seed, another arm's joints at rest."""
    limits = panda_limits()
    motion = plan_trajectory(cell, START, GOAL, limits, group="arm", seed=3)
    assert_sound(cell, motion, START, GOAL, limits)
    again = plan_trajectory(cell, START, GOAL, limits, group="arm", seed=3)
    np.testing.assert_array_equal(motion.points.positions, again.points.positions)
    assert motion.duration <= 1.03 * least_duration((GOAL - START)[:7], limits)


def test_goals_may_be_poses_and_sets(cell):
    """A tool's pose, the nearest corner of a box of configurations, a point."""
    limits, tree = panda_limits(), cell.plan.tree
    X_WT = np.diag([1.0, -1.0, -1.0, 1.0])
    X_WT[:3, 3] = (0.5, 0.3, 0.85)
    target = PoseTarget("panda_hand", X_WT)
    motion = plan_trajectory(cell, START, target, limits, group="arm")
    end = motion.points.positions[-1]
    assert_sound(cell, motion, START, end, limits)
    np.testing.assert_allclose(tree.link_poses(end, ["panda_hand"])[0], X_WT, atol=2e-9)

    around = np.array([[0.3] + 6 * [-3.0], [0.6] + 6 * [3.0]])
    box = Hyperrectangle(*(START[:7] + around))
    motion = plan_trajectory(cell, START, box, limits, group="arm")
    end = motion.points.positions[-1]
    assert_sound(cell, motion, START, end, limits)
    np.testing.assert_allclose(end, START + 0.3 * np.eye(8)[0], atol=1e-7)
    assert motion.plan.goal == 0

    motion = plan_trajectory(cell, START, Point(GOAL[:7]), limits, group="arm")
    np.testing.assert_allclose(motion.points.positions[-1], GOAL, atol=1e-9)


def test_a_set_whose_nearest_point_collides_has_others(cart):
    """The nearest point of a line of goals is inside the post; a goal beside it is reached."""
    line = Hyperrectangle([1.0, -1.0], [1.0, 1.0])
    motion = plan_trajectory(cart, [0.0, 0.0], line, cart_limits())
    end = motion.points.positions[-1]
    assert_sound(cart, motion, [0.0, 0.0], end, cart_limits())
    assert end[0] == pytest.approx(1.0, abs=1e-9) and 0.2 < abs(end[1]) <= 1.0


def test_sets_that_make_no_sense_are_refused(cell, cart):
    """Another dimension, an empty one; one beyond limits is a goal beyond limits."""
    with pytest.raises(
        PlanningError, match="set in 8 dimensions, and the positions of group 'arm'"
    ):
        plan_trajectory(cell, START, Point(GOAL), panda_limits(), group="arm")
    empty = HPolyhedron([[1.0, 0.0], [-1.0, 0.0]], [0.0, -1.0])
    with pytest.raises(PlanningError, match="empty"):
        plan_trajectory(cart, [0.0, 0.0], empty, cart_limits())
    motion = plan_trajectory(cart, [0.0, 0.0], Point([5.0, 0.0]), cart_limits())
    assert motion.failure is TimingFailure.NO_PATH
    assert motion.plan.failure is PlanFailure.GOAL_BEYOND_LIMITS
    assert "'x'" in motion.reason


def test_a_motion_may_begin_with_a_velocity(cart):
    """It goes on at half a metre a second, and is proven where that takes it."""
    start, goal = np.array([0.0, 0.5]), np.array([2.0, 0.5])
    motion = plan_trajectory(cart, start, goal, cart_limits(), start_velocity=[0.5, 0.0])
    assert motion.is_success, motion.reason
    np.testing.assert_allclose(motion.points.velocities[0], [0.5, 0.0])
    assert find_excess(motion.trajectory, cart_limits()) is None
    still = plan_trajectory(cart, start, goal, cart_limits())
    assert motion.duration < still.duration
    with pytest.raises(TrajectoryError, match="start_velocity"):
        plan_trajectory(cart, start, goal, cart_limits(), start_velocity=[2.0, 0.0])


def test_a_start_that_collides_is_led_out_first(cart):
    """The ball is a millimetre deep in the post."""
    start, goal = np.array([0.801, 0.0]), np.array([0.0, 0.5])
    refused = plan_trajectory(cart, start, goal, cart_limits())
    assert refused.failure is TimingFailure.NO_PATH
    assert refused.plan.failure is PlanFailure.START_COLLIDES
    assert "post" in refused.reason
    motion = plan_trajectory(cart, start, goal, cart_limits(), start_overlap=0.01)
    assert motion.is_success and motion.free_from > 0
    after = motion.points.positions[motion.free_from :]
    assert cart.check_configs_collision_free(after).all()


def test_a_goal_that_is_walled_in_and_time_that_is_over(tmp_path):
    """No time, and a goal behind a ball that fills the slide."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    names = checker.plan.tree.position_names
    limits = MotionLimits([1.0] * len(names), [1.0] * len(names), names, [10.0] * len(names))
    start = checker.plan.tree.zero_configuration()
    late = plan_trajectory(checker, start, start + 0.01, limits, timeout=0.0)
    assert late.failure is TimingFailure.TIMEOUT and late.plan.failure is PlanFailure.TIMEOUT


def test_who_watches_sees_the_stages_and_may_end_it(cell):
    """Feedback has the time since the beginning of all; an exception comes out."""
    seen = []
    plan_trajectory(cell, START, GOAL, panda_limits(), group="arm", watch=seen.append)
    assert seen[0].stage is PlanStage.CHECKING and seen[-1].stage is PlanStage.TIMING
    assert all(a.seconds <= b.seconds for a, b in pairwise(seen))

    class EnoughError(Exception):
        pass

    def enough(progress):
        if progress.stage is PlanStage.TIMING:
            raise EnoughError

    with pytest.raises(EnoughError):
        plan_trajectory(cell, START, GOAL, panda_limits(), group="arm", watch=enough)


def test_what_makes_no_sense_is_refused(cell):
    """Limits without names, of other joints than move, and what `plan_path` refuses."""
    without = MotionLimits([1.0] * 7, [1.0] * 7)
    with pytest.raises(TrajectoryError, match="names"):
        plan_trajectory(cell, START, GOAL, without, group="arm")
    others = MotionLimits([1.0], [1.0], ("panda_joint2",))
    with pytest.raises(TrajectoryError, match="moves position 'panda_joint1'"):
        plan_trajectory(cell, START, GOAL, others, group="arm")
    with pytest.raises(PlanningError, match="timeout"):
        plan_trajectory(cell, START, GOAL, panda_limits(), group="arm", timeout=-1.0)
    with pytest.raises(PlanningError, match="seed"):
        plan_trajectory(cell, START, GOAL, panda_limits(), group="arm", seed=0.5)


def test_a_path_is_what_it_follows_where_no_spline_is_free(cell, monkeypatch):
    """Without a spline the path itself is timed, as `time_path` does."""
    way = [0.9, -0.2, 0.3, 0.4, 0.0, 0.0, 0.0, 0.0]
    monkeypatch.setattr(
        "scene_graph_ros.planning.motion.trajectory_planner.spline_motion", lambda *_: None
    )
    goal = START + way
    motion = plan_trajectory(cell, START, goal, panda_limits(), group="arm")
    assert_sound(cell, motion, START, goal, panda_limits())
    timed = time_path(cell, motion.plan.configurations, panda_limits())
    np.testing.assert_array_equal(motion.points.nanoseconds, timed.points.nanoseconds)

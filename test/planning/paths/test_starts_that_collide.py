"""Starts in a slight collision: led out, and proven from where they are free."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from scene_graph_ros.planning import (
    plan_path,
    PlanFailure,
    PlanningError,
    RobotDiagramBuilder,
    SceneGraphCollisionChecker,
    time_path,
)
from scene_graph_ros.planning.paths.lead_out import least_change
from scene_graph_ros.planning.trajectories import MotionLimits
from scene_graph_ros.trajectories.errors import TrajectoryError

LIMIT = '<limit lower="-2" upper="2" effort="1" velocity="1"/>'


def ball(at):
    """Return a ball of 0.1 m."""
    return (
        f'<collision><origin xyz="{at}"/><geometry><sphere radius="0.1"/></geometry></collision>'
    )


URDF = f"""<robot name="r">
  <link name="base">{ball("1 0 0")}</link><link name="x"/>
  <link name="hand">{ball("0 0 0")}</link>
  <joint name="x_j" type="prismatic"><parent link="base"/><child link="x"/><axis xyz="1 0 0"/>
    {LIMIT}</joint>
  <joint name="y_j" type="prismatic"><parent link="x"/><child link="hand"/><axis xyz="0 1 0"/>
    {LIMIT}</joint>
</robot>"""
SRDF = '<robot name="r"><group name="x"><joint name="x_j"/></group></robot>'


def checker_of(urdf=URDF, srdf=SRDF, **paddings):
    """Return a checker of one robot."""
    builder = RobotDiagramBuilder()
    builder.add_robot("r", urdf, srdf)
    return SceneGraphCollisionChecker(builder.build(), **paddings)


@pytest.fixture(scope="module")
def checker():
    """A ball that moves in x and y, beside one at x = 1."""
    return checker_of()


def overlap(configurations):
    """Return by how much the two balls overlap: two radii less the way between centres."""
    return 0.2 - np.linalg.norm(configurations - [1.0, 0.0], axis=-1)


@pytest.mark.parametrize(
    ("depth", "angle"), [(0.0, 0.0), (1e-7, 2.0), (1e-4, 3.0), (0.005, math.pi), (0.0199, 2.0)]
)
def test_a_start_in_slight_collision_is_led_out(checker, depth, angle):
    """The least change leads straight away from the other ball, a millimetre beyond touch."""
    start = np.array([1.0, 0.0]) + (0.2 - depth) * np.array([math.cos(angle), math.sin(angle)])
    plan = plan_path(checker, start, np.array([-1.0, 0.5]), start_overlap=0.02, timeout=20.0)
    assert plan.is_success, plan.reason
    q = plan.configurations
    np.testing.assert_array_equal(q[0], start)
    assert plan.free_from == 1
    assert 0.0 < plan.least_clearance <= -overlap(q[1])
    np.testing.assert_allclose(
        q[1], [1.0 + 0.201 * math.cos(angle), 0.201 * math.sin(angle)], atol=6e-4
    )
    assert checker.check_edges_collision_free(np.stack([q[1:-1], q[2:]], axis=1)).all()
    along = np.linspace(q[0], q[1], 100)
    assert overlap(along).max() <= depth + 1e-5


@pytest.mark.parametrize(("allowed", "words"), [(0.0, ""), (0.004, "start_overlap allows 4 mm")])
def test_a_start_that_is_deeper_is_refused(checker, allowed, words):
    """The reason has the depth, and how much is allowed."""
    plan = plan_path(checker, np.array([0.805, 0.0]), np.zeros(2), start_overlap=allowed)
    assert plan.failure is PlanFailure.START_COLLIDES
    assert "overlap by 5 mm" in plan.reason
    assert plan.reason.endswith(words)


def test_a_free_start_is_as_without(checker):
    """It costs no configuration."""
    plan = plan_path(checker, np.array([0.7, 0.0]), np.zeros(2), start_overlap=0.02)
    assert (len(plan.configurations), plan.free_from) == (2, 0)


def test_paddings_count_as_what_must_be_kept():
    """Nearer than the padding is a collision like others."""
    checker = checker_of(self_collision_padding=0.05)
    plan = plan_path(checker, np.array([0.77, 0.0]), np.zeros(2), start_overlap=0.03)
    assert plan.is_success, plan.reason
    assert plan.configurations[1, 0] == pytest.approx(0.749, abs=6e-4)


def test_only_what_may_move_leads_out(checker):
    """A group of one joint goes along it; without a way along it the reason says so."""
    start = np.array([0.99, 0.198])
    plan = plan_path(
        checker, start, np.array([0.0, 0.198]), start_overlap=0.02, group="x", timeout=20.0
    )
    assert plan.is_success, plan.reason
    np.testing.assert_array_equal(plan.configurations[:, 1], 0.198)
    still = URDF.replace('lower="-2" upper="2"', 'lower="0.98" upper="1"', 1)
    plan = plan_path(checker_of(still), start, start, start_overlap=0.02, group="x")
    assert plan.failure is PlanFailure.START_COLLIDES
    assert "no way was found that leads out" in plan.reason


def test_leading_out_does_not_lead_into_another(checker):
    """Straight away from one, 0.197 m from the other's centre, would be in the other."""
    both = checker_of(URDF.replace(ball("1 0 0"), ball("1 0 0") + ball("0.603 0.02 0")))
    start = np.array([0.815, 0.0])
    assert not both.check_config_collision_free([0.799, 0.0])
    plan = plan_path(both, start, np.array([0.8, -0.5]), start_overlap=0.02, timeout=20.0)
    assert plan.is_success, plan.reason
    q = plan.configurations
    assert both.check_edges_collision_free(
        np.stack([q[plan.free_from : -1], q[plan.free_from + 1 :]], axis=1)
    ).all()
    way = np.concatenate([np.linspace(a, b, 50) for a, b in itertools.pairwise(q)])
    assert np.linalg.norm(way - [0.603, 0.02], axis=1).min() > 0.2
    assert overlap(way).max() <= 0.015 + 1e-5


@pytest.mark.parametrize("rise_time", [0.0, 0.1])
def test_a_trajectory_rests_where_it_is_free(checker, rise_time):
    """From there on it is proven with all paddings; before, it gets no deeper."""
    start = np.array([0.81, 0.0])
    plan = plan_path(checker, start, np.array([0.0, 1.0]), start_overlap=0.02)
    limits = MotionLimits.of_tree(checker.plan.tree, accelerations=2.0)
    refused = time_path(checker, plan.configurations, limits, rise_time=rise_time)
    assert "not proven apart" in refused.reason
    timed = time_path(
        checker, plan.configurations, limits, rise_time=rise_time, free_from=plan.free_from
    )
    assert timed.is_success, timed.reason
    k = timed.free_from
    np.testing.assert_array_equal(timed.points.positions[k], plan.configurations[1])
    np.testing.assert_array_equal(timed.points.velocities[k], 0.0)
    assert timed.least_clearance > 0.0
    at = timed.trajectory.value(np.linspace(0.0, timed.duration, 500))
    assert overlap(at).max() <= 0.01 + 1e-5
    curves = timed.trajectory.control_points[k:]
    assert checker.check_edges_collision_free(curves).all()


@pytest.mark.parametrize("row", [-1, 0.5, 2, math.nan])
def test_odd_numbers_are_refused(checker, row):
    """A configuration that the path has not, and a depth that is none."""
    limits = MotionLimits.of_tree(checker.plan.tree, accelerations=2.0)
    with pytest.raises(TrajectoryError, match="free_from must be a configuration of the path"):
        time_path(checker, np.zeros((2, 2)), limits, free_from=row)
    for depth in (-1e-3, math.nan, math.inf):
        with pytest.raises(PlanningError, match="start_overlap must be m from 0 on"):
            plan_path(checker, np.zeros(2), np.zeros(2), start_overlap=depth)


@pytest.mark.parametrize("seed", range(5))
def test_the_least_change_is_the_projection(seed):
    """On one plane it is known; with many, no point that fulfils them all is nearer to 0."""
    rng = np.random.default_rng(seed)
    g, h = rng.standard_normal(3), rng.uniform(0.1, 2.0)
    np.testing.assert_allclose(least_change(g[np.newaxis], np.array([h])), h * g / (g @ g))
    G, h = rng.standard_normal((4, 3)), rng.uniform(-1.0, 1.0, 4)
    x = least_change(G, h)
    assert x is not None
    assert (G @ x >= h - 1e-9).all()
    # Of a convex set the projection of 0: all others are beyond the plane through it.
    others = rng.uniform(-4.0, 4.0, (4000, 3))
    others = others[(others @ G.T >= h).all(axis=1)]
    assert (others @ x >= x @ x - 1e-9).all()


def test_what_can_not_be_is_no_change():
    """Two planes that exclude each other, and one that no change moves."""
    assert least_change(np.array([[1.0], [-1.0]]), np.array([1.0, 0.0])) is None
    assert least_change(np.zeros((1, 2)), np.array([0.1])) is None
    np.testing.assert_array_equal(least_change(np.zeros((0, 2)), np.zeros(0)), [0.0, 0.0])

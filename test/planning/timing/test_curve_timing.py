"""Trajectories along curves, and regions of some positions alone: what robots are told to run.

Truths are closed forms of how fast a joint is there, and samples that the proofs don't know.
"""

import itertools
import math

import numpy as np
import pytest
from robot_scenes import CART, diagram, POST

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    GraphOfConvexSetsOptions,
    Hyperrectangle,
)
from scene_graph_ros.planning import (
    IrisZoOptions,
    load_robot_diagram,
    plan_path,
    plan_through_regions,
    region_around,
    RegionError,
    regions_along,
    SceneGraphCollisionChecker,
    time_curve,
    TimingFailure,
)
from scene_graph_ros.planning.trajectories import (
    BezierCurve,
    BsplineTrajectory,
    CompositeTrajectory,
    ExponentialPlusPiecewisePolynomial,
    find_excess,
    MotionLimits,
    PiecewisePolynomial,
    retime,
    TrajectoryError,
)
from scene_graph_ros.robots.tree_joint import KinematicTreeError

CELL = "config/scenes/panda_cell.yaml"
START = np.array([-0.5, 0.3, 0.0, -2.0, 0.0, 2.3, 0.785, 0.02])
GOAL = np.array([-0.3, 0.2, 0.1, -2.1, 0.1, 2.4, 0.7, 0.02])
FAST = IrisZoOptions(num_particles=200, epsilon=0.05, mixing_steps=20, max_iterations=1)


@pytest.fixture(scope="module")
def cart(tmp_path_factory):
    """A ball on two rails with a post at (1, 0.5), both of radius 0.1, and its limits."""
    robots = diagram(tmp_path_factory.mktemp("cart"), CART, POST.format(x=1.0, y=0.5))
    return SceneGraphCollisionChecker(robots), MotionLimits.of_tree(robots.tree, accelerations=2.0)


@pytest.fixture(scope="module")
def panda():
    """A Panda in its cell."""
    return SceneGraphCollisionChecker(load_robot_diagram(CELL))


def line(*points):
    """Return straight segments of order 3 with one control point after another evenly."""
    segments = []
    for k, (a, b) in enumerate(itertools.pairwise(points)):
        shares = np.linspace(0.0, 1.0, 4)[:, np.newaxis]
        segments.append(BezierCurve(k, k + 1.0, (1.0 - shares) * a + shares * np.array(b)))
    return CompositeTrajectory(tuple(segments))


def test_a_straight_curve_takes_as_long_as_it_must(cart):
    """Two metres at 1 m/s and 2 m/s^2: 2 / 1 + 1 / 2 s, whatever its own times were."""
    checker, limits = cart
    timed = time_curve(checker, line([0.0, 0.0], [1.0, 0.0], [2.0, 0.0]), limits, at=[9.0, 9.0])
    assert timed.is_success, timed.reason
    assert timed.duration == pytest.approx(2.5, rel=1e-6)
    assert timed.stops == 0
    assert find_excess(timed.trajectory, limits) is None
    np.testing.assert_allclose(timed.trajectory.value([0.0, 9.0]), [[0, 0], [2, 0]], atol=1e-12)
    # The post's middle is 0.5 m away: 0.3 m are kept, of which half is promised.
    assert 0.15 - 1e-9 <= timed.least_clearance <= 0.3


def test_it_stops_at_a_corner_and_turns_round_a_quarter_circle(cart):
    """Two metres with a stop take 2 (1 + 1 / 2) s; a curve around the corner has none."""
    checker, limits = cart
    corner = line([0.0, 0.0], [1.0, 0.0], [1.0, -1.0])
    timed = time_curve(checker, corner, limits, at=[0.0, 0.0])
    assert timed.duration == pytest.approx(3.0, rel=1e-6)
    assert timed.stops == 1
    # Waiting while accelerations rise is one stop, too: each half takes 0.1 s longer.
    soft = time_curve(checker, corner, limits, at=[0.0, 0.0], rise_time=0.1)
    assert soft.stops == 1
    assert soft.duration == pytest.approx(3.2, rel=1e-6)
    k = 4.0 / 3.0 * (math.sqrt(2.0) - 1.0)
    points = np.array([[0.0, 0.0], [k, 0.0], [1.0, -1.0 + k], [1.0, -1.0]])
    round_ = PiecewisePolynomial([0.0, 1.0], points[np.newaxis])
    timed = time_curve(checker, round_, limits, at=[0.0, 0.0])
    assert timed.stops == 0
    assert find_excess(timed.trajectory, limits) is None
    radii = np.linalg.norm(timed.trajectory.value(np.linspace(0, 9, 999)) - [0, -1], axis=1)
    # Bezier's quarter is round to 3e-4; cubics through its points are as near.
    np.testing.assert_allclose(radii, 1.0, atol=1e-3)


def test_curves_of_all_kinds_of_polynomials_are_timed_alike(cart):
    """The same arc as a B-spline, a Bezier curve, joined, and as polynomials."""
    checker, limits = cart
    points = [[0.0, 0.0], [0.7, 0.0], [1.2, -0.4], [1.2, -1.0]]
    spline = BsplineTrajectory.clamped_uniform(points, 3, 0.0, 2.0)
    bezier = BezierCurve(0.0, 2.0, points)
    polynomials = spline.piecewise_polynomial()
    whole = retime(polynomials, limits)
    for curve in (spline, bezier, CompositeTrajectory((spline,)), polynomials):
        timed = time_curve(checker, curve, limits, at=[0.0, 0.0])
        assert timed.is_success, timed.reason
        assert timed.stops == 0
        assert find_excess(timed.trajectory, limits) is None
        assert timed.duration == pytest.approx(whole.duration, rel=0.05)
        assert retime(curve, limits).duration == pytest.approx(whole.duration, rel=1e-12)
        half = MotionLimits([0.35] * 2, [10.0] * 2)
        # It leaves at 3 / 2 * 0.7 m/s.
        assert find_excess(curve, half).value == pytest.approx(1.05)


def test_what_is_no_polynomial_is_refused(cart):
    """With what to do."""
    checker, limits = cart
    grows = ExponentialPlusPiecewisePolynomial(
        [1.0], np.ones((1, 1, 2)), PiecewisePolynomial([0.0, 1.0], np.zeros((1, 1, 2)))
    )
    for act, name in (
        (lambda: time_curve(checker, grows, limits, at=[0.0, 0.0]), "curve"),
        (lambda: retime(grows, limits), "path"),
        (lambda: find_excess(grows, limits), "trajectory"),
    ):
        with pytest.raises(TrajectoryError, match=f"^{name} must be polynomials.*cubic_hermite"):
            act()


def test_with_a_rise_time_accelerations_are_continuous(cart):
    """It takes so much longer."""
    checker, limits = cart
    way = line([0.0, 0.0], [2.0, 0.0])
    timed = time_curve(checker, way, limits, at=[0.0, 0.0], rise_time=0.1)
    assert timed.duration == pytest.approx(2.6, rel=1e-6)
    assert timed.points.accelerations is not None


def test_what_is_in_the_way_or_beyond_limits_is_told(cart):
    """The post is on the line y = 0.5; x ends at 3."""
    checker, limits = cart
    timed = time_curve(checker, line([0.0, 0.5], [2.0, 0.5]), limits, at=[0.0, 0.0])
    assert timed.failure is TimingFailure.NOT_FREE
    assert "post" in timed.reason
    timed = time_curve(checker, line([0.0, 0.0], [3.5, 0.0]), limits, at=[0.0, 0.0])
    assert timed.failure is TimingFailure.LIMIT
    assert "position of 'x' is 3.5" in timed.reason


@pytest.mark.parametrize(
    ("curve", "words"),
    [
        (line([0.0], [1.0]), "curve has 1 rows, and limits name 2 positions"),
        (line([0.0, 0.0], [0.0, 0.0]), "curve leads nowhere"),
        (
            PiecewisePolynomial([0, 1, 2], [[[0, 0], [1, 0]], [[1.1, 0], [2, 0]]]),
            "curve jumps between two of its segments",
        ),
    ],
)
def test_a_curve_that_makes_no_sense_is_named(cart, curve, words):
    """By what is wrong with it."""
    checker, limits = cart
    with pytest.raises(TrajectoryError, match=words):
        time_curve(checker, curve, limits, at=[0.0, 0.0])


def test_segments_that_lead_nowhere_are_left_out(cart):
    """A region that is only passed has a segment of no length."""
    checker, limits = cart
    still = line([0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [2.0, 0.0])
    timed = time_curve(checker, still, limits, at=[0.0, 0.0])
    assert timed.duration == pytest.approx(2.5, rel=1e-6)


# Regions of a group.


def test_regions_of_a_group_keep_all_other_positions(panda):
    """Seven joints move, and the fingers are as they are: samples of what is found are free."""
    path = plan_path(panda, START, GOAL, group="arm", timeout=30.0)
    assert path.is_success, path.reason
    regions = regions_along(panda, path.configurations, options=FAST, group="arm")
    assert regions[0].region.ambient_dimension == 7
    assert regions[0].region.point_in_set(START[:7], 0.0)
    assert regions[-1].region.point_in_set(GOAL[:7], 0.0)
    rows = panda.model.tree.group_positions("arm")
    limits = MotionLimits.of_tree(panda.model.tree, accelerations=5.0, positions=rows)
    plan = plan_through_regions(
        [each.region for each in regions],
        START,
        GOAL,
        velocities=limits.velocities,
        checker=panda,
        group="arm",
        options=GraphOfConvexSetsOptions(convex_relaxation=False),
    )
    assert plan.is_success, plan.reason
    assert plan.trajectory.rows == 7
    assert len(plan.regions) == plan.trajectory.num_segments
    # No joint is faster than it may be.
    needed = float((np.abs(GOAL - START)[:7] / limits.velocities).max())
    assert plan.result.cost >= needed - 1e-9
    timed = time_curve(panda, plan.trajectory, limits, at=START)
    assert timed.is_success, timed.reason
    q = timed.trajectory.value(np.linspace(0.0, timed.duration, 500))
    np.testing.assert_allclose(q[:, 7], START[7], rtol=1e-15)
    assert panda.check_configs_collision_free(q).all()


def test_what_a_group_does_not_have_is_told(panda):
    """Another group, a finger that moves, and a group without a checker."""
    moved = START.copy()
    moved[7] = 0.0
    with pytest.raises(RegionError, match=r"path moves position 'panda_finger_joint1'.*'arm'"):
        regions_along(panda, [START, moved], options=FAST, group="arm")
    with pytest.raises(KinematicTreeError, match="leg"):
        region_around(panda, START, options=FAST, group="leg")
    box = Hyperrectangle(START[:7] - 0.1, START[:7] + 0.1)
    given = {"velocities": np.ones(7), "group": "arm"}
    with pytest.raises(ConvexSetError, match="goal: position 'panda_finger_joint1' is not of"):
        plan_through_regions([box], START, moved, checker=panda, **given)
    with pytest.raises(ConvexSetError, match="group needs a checker"):
        plan_through_regions([box], START, START, **given)

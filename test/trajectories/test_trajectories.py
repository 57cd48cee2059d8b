"""Curves and the fastest trajectories along them, where the answer is known."""

import numpy as np
from numpy.polynomial import Polynomial
import pytest

from scene_graph_ros.planning.trajectories import (
    find_excess,
    MotionLimits,
    PathParameterizedTrajectory,
    PiecewisePolynomial,
    retime,
    TrajectoryError,
    TrajectoryPoints,
)
from scene_graph_ros.trajectories.corners import CornerPath
from scene_graph_ros.trajectories.extremes import largest_ratios
from scene_graph_ros.trajectories.sampling import gentler, sample, slowed


def limits(count, velocity=2.0, acceleration=10.0):
    """Return the same limits for all entries."""
    return MotionLimits(np.full(count, velocity), np.full(count, acceleration))


def random_corners(seed, count=6, rows=7):
    """Return a path of random corners, and limits that differ from entry to entry."""
    rng = np.random.default_rng(seed)
    most = MotionLimits(rng.uniform(0.5, 3.0, rows), rng.uniform(2.0, 20.0, rows))
    return CornerPath(rng.uniform(-2.0, 2.0, (count, rows)), most.velocities), most


def rounded(corners, part):
    """Return the path with corners rounded by a part of what is possible."""
    return corners.rounded(part * corners.largest_sizes())


# Curves.


def test_a_hermite_curve_is_the_polynomial_whose_values_it_was_made_of():
    """A quintic of numpy's, cut at three places, and its derivatives of all orders."""
    p = Polynomial([0.3, -1.0, 2.0, 0.5, -0.25, 1.0 / 3.0])
    breaks = np.array([-1.0, 0.2, 0.5, 2.0])
    at = [np.stack([p.deriv(k)(breaks), -p.deriv(k)(breaks)], axis=1) for k in (1, 2)]
    values = np.stack([p(breaks), -p(breaks)], axis=1)
    curve = PiecewisePolynomial.quintic_hermite(breaks, values, *at)
    t = np.linspace(-1.0, 2.0, 50)
    for order in range(7):
        expected = p.deriv(order)(t) if order else p(t)
        found = curve.derivative(order).value(t)
        size = 1e-13 * 10.0**order
        np.testing.assert_allclose(found, np.stack([expected, -expected], axis=1), atol=size)
    cubic = Polynomial([1.0, 2.0, 3.0, 4.0])
    own = PiecewisePolynomial.cubic_hermite(
        breaks, cubic(breaks)[:, None], cubic.deriv()(breaks)[:, None]
    )
    np.testing.assert_allclose(own.value(t)[:, 0], cubic(t), atol=1e-13)
    assert own.value(0.7).shape == (1,)


def test_curves_are_reversed_slowed_moved_joined_and_raised():
    """Each is compared with the first at the times that it should have."""
    rng = np.random.default_rng(1)
    curve = PiecewisePolynomial(np.array([1.0, 1.5, 4.0]), rng.normal(size=(2, 4, 3)))
    t = np.linspace(1.0, 4.0, 30)[1:-1]
    np.testing.assert_allclose(curve.reverse_time().value(5.0 - t), curve.value(t), atol=1e-14)
    np.testing.assert_array_equal(curve.scale_time(2.0).value(2.0 * t), curve.value(t))
    np.testing.assert_allclose(curve.shift_right(3.0).value(t + 3.0), curve.value(t), atol=1e-13)
    np.testing.assert_allclose(curve.elevate_degree(6).value(t), curve.value(t), atol=1e-14)
    line = PiecewisePolynomial.first_order_hold([4.0, 5.0], np.eye(2, 3))
    both = curve.concatenate_in_time(line)
    assert (both.start_time, both.end_time, both.num_segments, both.degree) == (1.0, 5.0, 3, 3)
    np.testing.assert_allclose(both.value(t), curve.value(t), atol=1e-14)
    np.testing.assert_allclose(both.value(4.25), [0.75, 0.25, 0.0], atol=1e-15)
    # A break belongs to what comes after it; beyond the ends it is as at the ends.
    np.testing.assert_array_equal(curve.value(1.5), curve.control_points[1, 0])
    np.testing.assert_array_equal(curve.value([0.0, 9.0]), curve.value([1.0, 4.0]))


def test_a_trajectory_along_a_path_follows_the_chain_rule():
    """q(s) = (s^2, s) with s(t) = t^2 is (t^4, t^2)."""
    path = PiecewisePolynomial([0.0, 1.0], [[[0.0, 0.0], [0.0, 0.5], [1.0, 1.0]]])
    squares = PiecewisePolynomial([0.0, 1.0], [[[0.0], [0.0], [1.0]]])
    trajectory = PathParameterizedTrajectory(path, squares)
    t = np.linspace(0.0, 1.0, 9)
    np.testing.assert_allclose(trajectory.value(t), np.stack([t**4, t**2], axis=1), atol=1e-15)
    np.testing.assert_allclose(
        trajectory.eval_derivative(t), np.stack([4.0 * t**3, 2.0 * t], axis=1), atol=1e-14
    )
    np.testing.assert_allclose(
        trajectory.eval_derivative(t, 2),
        np.stack([12.0 * t**2, 2.0 + 0.0 * t], axis=1),
        atol=1e-13,
    )


@pytest.mark.parametrize("degree", [1, 2, 3, 5, 8])
def test_no_sample_of_a_curve_is_above_its_bound(degree):
    """And the bound is taken, at the time that is named."""
    rng = np.random.default_rng(degree)
    curve = PiecewisePolynomial(np.arange(5.0), rng.normal(size=(4, degree + 1, 3)))
    upper, lower = np.array([1.0, 2.0, 0.5]), -np.array([3.0, 0.7, 0.5])
    peak = largest_ratios(curve, lower, upper)
    # What ends at a break is there just before it: the curve jumps.
    t = np.concatenate([np.linspace(0.0, 4.0, 40001), np.nextafter(np.arange(1.0, 4.0), 0.0)])
    q = curve.value(t)
    samples = np.maximum(q / upper, q / lower).max(axis=0)
    assert (samples <= peak.bounds + 1e-13).all()
    assert (peak.bounds <= samples * (1.0 + 1e-6)).all()
    for entry, time in enumerate(peak.times):
        near = curve.value([np.nextafter(time, -1.0), time])[:, entry]
        best = np.maximum(near / upper[entry], near / lower[entry]).max()
        assert best == pytest.approx(peak.bounds[entry], rel=1e-11)


def test_a_peak_between_all_samples_is_found():
    """64 t^3 (1 - t)^3 is 1 at 1/2, and 1 - 1e-6 at 0.5 +- 2.9e-4."""
    ridge = [0.0, 0.0, 0.0, 64.0 / 20.0, 0.0, 0.0, 0.0]
    curve = PiecewisePolynomial([0.0, 1.0], np.array(ridge)[np.newaxis, :, np.newaxis])
    peak = largest_ratios(curve, np.array([-1.0]), np.array([1.0]))
    assert peak.bounds[0] == pytest.approx(1.0, abs=1e-12)
    assert peak.times[0] == pytest.approx(0.5, abs=1e-6)


# The fastest trajectory.


@pytest.mark.parametrize("way", [10.0, 1.0, 0.8, 1e-3, 1e-6])
def test_a_straight_way_takes_as_long_as_it_must(way):
    """2 sqrt(L / a) where the limit of velocity is not reached, else L / v + v / a.

    Of two entries the first is the slower one, for which v is 2 and a is 5.
    """
    most = MotionLimits(np.array([2.0, 2.0]), np.array([5.0, 5.0]))
    path = PiecewisePolynomial.first_order_hold([0.0, 1.0], [[0.0, 0.0], [way, 0.5 * way]])
    motion = retime(path, most)
    least = 2.0 * np.sqrt(way / 5.0) if way < 2.0**2 / 5.0 else way / 2.0 + 2.0 / 5.0
    assert motion.duration == pytest.approx(least, rel=1e-10)
    points = sample(motion, most).points
    # In whole nanoseconds, and not less than the least.
    assert least * (1.0 - 1e-12) <= points.duration <= least * (1.0 + 1e-6) + 1e-8
    assert find_excess(points.trajectory(), most) is None


def test_corners_that_are_not_rounded_are_stopped_at():
    """Each edge takes as long as it does by itself."""
    q = np.array([[0.0, 0.0], [1.0, 0.2], [1.0, 0.2], [0.5, 2.0], [0.4, 2.0]])
    most = limits(2)
    alone = 0.0
    for way in (1.0, 1.8, 0.1):
        alone += 2.0 * np.sqrt(way / 10.0) if way < 0.4 else way / 2.0 + 0.2
    motion = retime(rounded(CornerPath(q, most.velocities), 0.0), most)
    assert motion.duration == pytest.approx(alone, rel=1e-12)


def test_a_corner_is_rounded_as_fast_as_its_curvature_allows():
    """A right angle between edges of 1 is cut by d on both sides.

    There q'' is 1 / (2 d) in one entry and the opposite in the other, so that x may be 2 d a at
    most, whatever u is. Each edge is begun and left with what time that takes.
    """
    d, a = 1e-4, 4.0
    most = limits(2, velocity=1.0, acceleration=a)
    corners = CornerPath(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]), most.velocities)
    motion = retime(corners.rounded(np.array([[d, d]])), most)
    v = np.sqrt(2.0 * d * a)
    edge = 1.0 / a + (1.0 - v) / a + (1.0 - d) - 1.0 / (2.0 * a) - (1.0 - v**2) / (2.0 * a)
    assert motion.duration == pytest.approx(2.0 * edge + 2.0 * d / v, rel=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_all_limits_are_kept_at_all_times(seed):
    """Of what runs through the points, cubics and quintics; by bounds, and at 20 000 times."""
    corners, most = random_corners(seed)
    for part in (0.0, 0.1, 1.0):
        motion = retime(rounded(corners, part), most)
        for rise_time in (0.0, 0.04):
            found = sample(motion, most, rise_time=rise_time)
            assert found.excess is None
            assert found.factor < 1.003
            trajectory = found.points.trajectory()
            assert find_excess(trajectory, most) is None
            t = np.linspace(0.0, found.points.duration, 20001)
            for order, most_rates in ((1, most.velocities), (2, most.accelerations)):
                rates = trajectory.derivative(order).value(t)
                assert (np.abs(rates) <= most_rates * (1.0 + 1e-12)).all()
            for end, rest in ((0.0, 0), (found.points.duration, -1)):
                np.testing.assert_array_equal(trajectory.value(end), corners.points[rest])
                assert not trajectory.derivative().value(end).any()


def test_limits_are_kept_between_the_nodes_of_a_path():
    """Before anything is slowed down: along parabolas they hold to rounding, however few nodes."""
    for seed in range(3):
        corners, most = random_corners(seed)
        for grid_points in (1, 3, 16):
            motion = retime(rounded(corners, 1.0), most, grid_points=grid_points)
            t = np.linspace(0.0, motion.duration, 30001)
            for order, limit in ((1, most.velocities), (2, most.accelerations)):
                assert (np.abs(motion.eval_derivative(t, order)) <= limit * (1.0 + 1e-8)).all()


def test_more_nodes_are_faster_and_converge():
    """The error against many nodes falls about as their distance, or faster."""
    corners, most = random_corners(9)
    path = rounded(corners, 1.0)
    best = retime(path, most, grid_points=512).duration
    errors = [retime(path, most, grid_points=n).duration / best - 1.0 for n in (4, 16, 64)]
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2] > 0.0
    assert errors[1] < 0.01


def test_a_rise_time_makes_accelerations_continuous():
    """They change by two limits in the rise time at most, which is what it takes longer."""
    corners, most = random_corners(5)
    motion, rise_time = retime(rounded(corners, 0.5), most), 0.05
    found = sample(motion, most, rise_time=rise_time)
    acceleration = found.points.trajectory().derivative(2)
    jumps = acceleration.control_points[1:, 0] - acceleration.control_points[:-1, -1]
    assert np.abs(jumps).max() < 1e-6
    assert not acceleration.value(0.0).any()
    jerk = np.abs(acceleration.derivative().control_points) * rise_time
    assert (jerk <= 2.0 * most.accelerations * 1.01).all()
    assert found.points.duration == pytest.approx(motion.duration + rise_time, rel=1e-6)


# Hard cases.


@pytest.mark.parametrize("way", [1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("rise_time", [0.0, 0.02])
def test_tiny_moves_have_times(way, rise_time):
    """Also where they are a few hundred steps of the floats that they end at."""
    q = np.array([[1.0, 2.0], [1.0 + way, 2.0], [1.0 + way, 2.0 - way]])
    most = limits(2)
    found = sample(
        retime(rounded(CornerPath(q, most.velocities), 0.5), most), most, rise_time=rise_time
    )
    assert found.excess is None
    assert (np.diff(found.points.nanoseconds) >= 1).all()
    assert found.points.duration < 1e-2 + 10.0 * rise_time
    np.testing.assert_array_equal(found.points.positions[[0, -1]], q[[0, -1]])


def test_huge_and_tiny_limits_and_sixty_joints():
    """From 1e-6 to 1e12 at once."""
    rng = np.random.default_rng(3)
    velocities, accelerations = 10.0 ** rng.uniform(-6, 12, (2, 60))
    most = MotionLimits(velocities, accelerations)
    q = rng.normal(size=(4, 60))
    found = sample(retime(rounded(CornerPath(q, velocities), 1.0), most), most)
    assert found.excess is None
    assert find_excess(found.points.trajectory(), most) is None
    ways = np.abs(np.diff(q, axis=0)) / velocities
    assert found.points.duration >= 0.5 * ways.max(axis=1).sum()
    fast = limits(60, 1e12, 1e12)
    quick = sample(retime(rounded(CornerPath(q, fast.velocities), 1.0), fast), fast)
    # Phases are not shorter than what their times can tell.
    assert quick.excess is None
    assert np.diff(quick.points.nanoseconds).min() >= 2999


def test_steps_that_vanish_in_rounding_are_none():
    """Points next to each other on a long way, also at its end, and speeds that come at once."""
    most = limits(2, 1.0, 1e15)
    near = np.nextafter(2.0, 3.0)
    q = np.array([[0.0, 0.0], [2.0, 0.0], [near, 0.0], [near, 9e3], [0.0, 9e3], [1e-16, 9e3]])
    corners = CornerPath(q, most.velocities)
    np.testing.assert_array_equal(corners.points, q[[0, 1, 3, 5]])
    for part in (0.0, 1.0):
        assert retime(rounded(corners, part), most).duration <= 2.0 + 9e3 + 2.0 + 1e-9
        path = rounded(corners, part)
        found = sample(retime(path, gentler(path, most)), most)
        assert found.excess is None
        np.testing.assert_array_equal(found.points.positions[[0, -1]], q[[0, -1]])
    stopped = sample(
        retime(rounded(corners, 0.0), gentler(rounded(corners, 0.0), most)), most
    ).points.duration
    # A nanosecond of the 3 us in which it comes to full speed.
    assert stopped == pytest.approx(2.0 + 9e3 + 2.0, rel=1e-9 / 3e-6)
    # Where all is so small, nothing is left out.
    tiny = CornerPath(q[[1, 2]], most.velocities)
    np.testing.assert_array_equal(tiny.points, q[[1, 2]])


def test_an_excess_of_less_than_a_nanosecond_is_made_good():
    """Where its last time is the same nanosecond again, it is slowed down by more.

    A cubic from 0 to 1 in 1 s is as fast as 1.5 in its middle, and the limit is 2e-12 below.
    """
    path = PiecewisePolynomial.first_order_hold([0.0, 1.0], [[0.0], [1.0]])
    motion = PathParameterizedTrajectory(path, path)
    most = MotionLimits([1.5 * (1.0 - 2e-12)], [100.0])

    def states(nanoseconds, factor):
        return np.array([[0.0], [1.0]]), np.zeros((2, 1)), None

    found = slowed(np.array([0.0, 1.0]), states, most, lambda: motion)
    assert found.excess is None
    assert 1_000_000_000 < found.points.nanoseconds[-1] <= 1_000_000_002


def test_turns_beyond_pi_are_just_numbers():
    """A joint that goes round has the time of the way that it goes."""
    most = limits(1)
    path = PiecewisePolynomial.first_order_hold([0.0, 1.0], [[3.0], [3.0 + 4.0 * np.pi]])
    assert retime(path, most).duration == pytest.approx(2.0 * np.pi + 0.2, rel=1e-12)


def test_an_excess_says_which_limit_by_how_much_and_when():
    """The cube of t, in a second: its derivatives end at 3 and 6."""
    curve = PiecewisePolynomial([0.0, 1.0], [[[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 1.0]]])
    found = find_excess(curve, limits(2, 10.0, 5.0))
    assert (found.kind, found.row, found.time) == ("acceleration", 1, 1.0)
    assert (found.value, found.limit) == pytest.approx((6.0, 5.0))
    assert found.words("x") == ("acceleration of 'x' is 6 at 1 s, beyond its limit 5 by 1")
    assert find_excess(curve, limits(2, 2.0, 7.0)).kind == "velocity"
    assert find_excess(curve, limits(2, 3.0, 6.0)) is None
    beyond = find_excess(
        curve, limits(2, 3.0, 6.0), lower=np.full(2, -np.inf), upper=np.array([0.0, 0.75])
    )
    assert (beyond.kind, beyond.row) == ("position", 1)
    assert beyond.value == pytest.approx(1.0)
    at = find_excess(curve, limits(2, 3.0, 6.0), lower=np.zeros(2), upper=np.ones(2))
    assert at is None


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: MotionLimits([1.0, 0.0], [1.0, 1.0], ("a", "b")), "velocities of 'b'.*not 0"),
        (lambda: MotionLimits([1.0], [np.nan], ("a",)), "accelerations of 'a'.*not nan"),
        (lambda: MotionLimits([np.inf], [1.0]), "velocities of '0'.*not inf"),
        (lambda: MotionLimits([1.0, 2.0], [1.0]), "2 velocities and 1 accelerations"),
        (lambda: PiecewisePolynomial([0.0, 0.0], np.zeros((1, 2, 1))), "breaks must grow"),
        (lambda: PiecewisePolynomial([0.0, 1.0], np.zeros((2, 2, 1))), "one segment"),
        (lambda: PiecewisePolynomial([0.0, np.inf], np.zeros((1, 2, 1))), r"breaks\[1\]"),
        (
            lambda: retime(
                PiecewisePolynomial([0.0, 1.0, 2.0], [[[0.0], [1.0]], [[1.0], [1.0]]]), limits(1)
            ),
            "segment 1 of the path goes nowhere",
        ),
        (
            lambda: retime(
                PiecewisePolynomial([0.0, 1.0, 2.0], [[[0.0], [1.0]], [[2.0], [3.0]]]), limits(1)
            ),
            "jumps",
        ),
        (
            lambda: retime(PiecewisePolynomial([0.0, 1.0], [[[0.0], [1.0]]]), limits(2)),
            "1 rows, and there are limits of 2",
        ),
        (
            lambda: sample(
                retime(PiecewisePolynomial([0.0, 1.0], [[[0.0], [1.0]]]), limits(1, 1e-12)),
                limits(1, 1e-12),
            ),
            "more than 1e[+]09 s",
        ),
        (lambda: TrajectoryPoints([0, 0], np.zeros((2, 1))), "point 0 is at 0 ns"),
        (lambda: TrajectoryPoints([0], [[np.nan]]), r"positions\[0, 0\]"),
        (
            lambda: TrajectoryPoints([0], [[0.0]], None, [[0.0]]),
            "must have velocities",
        ),
    ],
)
def test_what_makes_no_sense_is_named(make, words):
    """With the field, and its value."""
    with pytest.raises(TrajectoryError, match=words):
        make()

"""Curves of further kinds: holds, smooth cubics, stacked, discrete, functions, turning, poses."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation, Slerp

from scene_graph_ros.geometry.errors import InvalidPoseError
from scene_graph_ros.trajectories import (
    BezierCurve,
    BsplineTrajectory,
    CompositeTrajectory,
    DiscreteTimeTrajectory,
    FunctionHandleTrajectory,
    PiecewisePolynomial,
    PiecewisePose,
    PiecewiseQuaternionSlerp,
    StackedTrajectory,
    Trajectory,
    TrajectoryError,
)

RNG = np.random.default_rng(8)
TIMES = np.array([0.5, 0.9, 2.0, 2.3, 4.0])
SAMPLES = RNG.normal(size=(5, 3))
ASKED = np.linspace(0.5, 4.0, 301)


def test_a_hold_keeps_each_sample_until_the_next():
    """The last sample is none of its values."""
    curve = PiecewisePolynomial.zero_order_hold(TIMES, SAMPLES)
    which = np.searchsorted(TIMES[1:-1], ASKED, side="right")
    np.testing.assert_array_equal(curve.value(ASKED), SAMPLES[:-1][which])
    assert not curve.derivative().value(ASKED).any()


@pytest.mark.parametrize("seed", range(4))
def test_monotone_cubics_are_those_of_scipy(seed):
    """Also with equal samples, and turns at the ends."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.1, 2.0, 7))
    q = np.round(rng.normal(size=(7, 4)), 1)
    asked = np.linspace(t[0], t[-1], 200)
    curve = PiecewisePolynomial.cubic_shape_preserving(t, q)
    np.testing.assert_allclose(curve.value(asked), PchipInterpolator(t, q)(asked), atol=1e-12)
    still = PiecewisePolynomial.cubic_shape_preserving(t, q, zero_end_point_derivatives=True)
    for at in (t[0], t[-1]):
        np.testing.assert_allclose(still.derivative().value(at), 0.0, atol=1e-12)
    low, high = np.minimum(q[:-1], q[1:]), np.maximum(q[:-1], q[1:])
    k = (np.searchsorted(t, asked, side="right") - 1).clip(0, 5)
    for each in (curve, still):
        values = each.value(asked)
        assert (values >= low[k] - 1e-12).all() and (values <= high[k] + 1e-12).all()


def jumps(curve, order):
    """Return by how much a derivative changes at inner breaks."""
    derived = curve.derivative(order)
    inner = curve.breaks[1:-1]
    return np.abs(derived.value(inner) - derived.value(inner - 1e-12)).max()


def test_smooth_cubics_have_no_jumps_of_acceleration():
    """Each kind passes the samples; their ends differ."""
    make = PiecewisePolynomial.cubic_with_continuous_second_derivatives
    closed = SAMPLES.copy()
    closed[-1] = closed[0]
    ends = np.array([1.0, -2.0, 0.5]), np.array([0.0, 3.0, 1.0])
    free, held = make(TIMES, SAMPLES), make(TIMES, SAMPLES, *ends)
    around = make(TIMES, closed, periodic_end=True)
    for curve, samples in ((free, SAMPLES), (held, SAMPLES), (around, closed)):
        np.testing.assert_allclose(curve.value(TIMES), samples, atol=1e-12)
        assert jumps(curve, 1) < 1e-8 and jumps(curve, 2) < 1e-8
    for at, wanted in zip((0.5, 4.0), ends, strict=True):
        np.testing.assert_allclose(held.derivative().value(at), wanted, atol=1e-12)
    for order in (1, 2):
        derived = around.derivative(order)
        np.testing.assert_allclose(derived.value(0.5), derived.value(4.0), atol=1e-9)
    third = free.derivative(3)
    for k in (1, -2):
        at = TIMES[k]
        np.testing.assert_allclose(third.value(at - 1e-6), third.value(at + 1e-6), atol=1e-7)


def test_one_polynomial_goes_through_all_samples():
    """x^4 is itself, to rounding; of twenty samples at Chebyshev's points, too."""
    t = np.array([-1.0, -0.2, 0.1, 1.0, 2.0])
    curve = PiecewisePolynomial.lagrange_interpolating_polynomial(t, (t**4)[:, None])
    asked = np.linspace(-1.0, 2.0, 50)
    np.testing.assert_allclose(curve.value(asked)[:, 0], asked**4, atol=1e-12)
    t = np.cos(np.pi * (np.arange(20)[::-1] + 0.5) / 20)
    curve = PiecewisePolynomial.lagrange_interpolating_polynomial(t, np.cos(3 * t)[:, None])
    asked = np.linspace(t[0], t[-1], 50)
    np.testing.assert_allclose(curve.value(asked)[:, 0], np.cos(3 * asked), atol=1e-9)
    with pytest.raises(TrajectoryError, match="20 at most"):
        PiecewisePolynomial.lagrange_interpolating_polynomial(np.arange(21), np.zeros((21, 1)))


def test_stacked_curves_are_one_below_the_other():
    """Values and derivatives, also of what is changed in time."""
    first = PiecewisePolynomial.first_order_hold(TIMES, SAMPLES)
    second = BezierCurve(0.5, 4.0, RNG.normal(size=(4, 2)))
    both = StackedTrajectory((first, second))
    assert isinstance(both, Trajectory)
    assert (both.rows, both.start_time, both.end_time) == (5, 0.5, 4.0)
    for curve, parts in (
        (both, (first, second)),
        (both.derivative(), (first.derivative(), second.derivative())),
        (both.reverse_time(), (first.reverse_time(), second.reverse_time())),
        (
            both.scale_time(2.0).shift_right(1.0),
            tuple(p.scale_time(2.0).shift_right(1.0) for p in (first, second)),
        ),
    ):
        wanted = np.concatenate([part.value(ASKED) for part in parts], axis=1)
        np.testing.assert_array_equal(curve.value(ASKED), wanted)
        assert curve.value(1.0).shape == (5,)
    with pytest.raises(TrajectoryError, match=r"parts\[1\] has the start_time 1.5"):
        StackedTrajectory((first, second.shift_right(1.0)))


def test_discrete_values_are_there_at_their_times_alone():
    """Between them there is nothing, but as a hold."""
    curve = DiscreteTimeTrajectory(TIMES, SAMPLES, 1e-9)
    assert isinstance(curve, Trajectory)
    np.testing.assert_array_equal(curve.value(TIMES[::-1]), SAMPLES[::-1])
    np.testing.assert_array_equal(curve.value(2.0 + 5e-10), SAMPLES[2])
    with pytest.raises(TrajectoryError, match=r"t = 2\.1 is no time of this curve"):
        curve.value([0.5, 2.1])
    np.testing.assert_array_equal(curve.to_zero_order_hold().value(2.1), SAMPLES[2])
    later = curve.reverse_time().shift_right(1.0)
    np.testing.assert_array_equal(later.value(later.times[0]), SAMPLES[-1])
    assert curve.derivative(0) is curve
    with pytest.raises(TrajectoryError, match="no derivative 1"):
        curve.derivative()
    with pytest.raises(TrajectoryError, match="times must grow"):
        DiscreteTimeTrajectory([0.0, 1e-10], np.zeros((2, 1)), 1e-9)


def test_a_function_is_a_curve():
    """Its derivatives are what another one says, also in another time."""
    curve = FunctionHandleTrajectory(
        lambda t: [np.sin(t), t],
        2,
        0.0,
        3.0,
        lambda t, k: [np.sin(t + 0.5 * np.pi * k), float(k == 1)],
    )
    assert isinstance(curve, Trajectory)
    t = np.linspace(0.0, 3.0, 7)
    np.testing.assert_array_equal(curve.value(t), np.stack([np.sin(t), t], axis=1))
    np.testing.assert_array_equal(curve.value(9.0), curve.value(3.0))
    np.testing.assert_allclose(curve.derivative(2).value(t)[:, 0], -np.sin(t), atol=1e-15)
    slow = curve.scale_time(2.0)
    np.testing.assert_allclose(slow.derivative().value(4.0), 0.5 * curve.derivative().value(2.0))
    back = curve.reverse_time()
    np.testing.assert_allclose(back.derivative().value(1.0), -curve.derivative().value(2.0))
    np.testing.assert_allclose(curve.shift_right(1.0).value(2.0), curve.value(1.0))
    for bad, says in (
        (lambda: FunctionHandleTrajectory(np.sin, 2).value(0.0), r"must have shape \(2,\)"),
        (lambda: FunctionHandleTrajectory(np.sin, 1).derivative(), "give func_derivative"),
        (lambda: FunctionHandleTrajectory(np.sin, 1).reverse_time(), "can't be reversed"),
        (lambda: FunctionHandleTrajectory(3, 1), "func must be a function"),
        (lambda: FunctionHandleTrajectory(np.sin, 1, 1.0, 0.0), "in this order"),
    ):
        with pytest.raises(TrajectoryError, match=says):
            bad()


def test_orientations_turn_as_scipys_do():
    """By slerp, whichever sign quaternions have; velocities are those of differences."""
    spins = Rotation.random(5, random_state=3)
    given = spins.as_quat() * np.array([1, -1, 1, 1, -1])[:, None]
    curve = PiecewiseQuaternionSlerp(TIMES, given)
    found = Rotation.from_quat(curve.value(ASKED))
    wanted = Slerp(TIMES, spins)(ASKED)
    assert (found * wanted.inv()).magnitude().max() < 1e-12
    assert (curve.value(ASKED)[:, 3] >= 0.0).all()
    for t in (0.7, 1.4, 3.3):
        ends = [Rotation.from_quat(curve.value(t + s)) for s in (1e-4, -1e-4)]
        turned = (ends[0] * ends[1].inv()).as_rotvec() / 2e-4
        np.testing.assert_allclose(curve.angular_velocity(t), turned, atol=1e-8)
    assert not curve.angular_acceleration(ASKED).any()
    back = curve.reverse_time()
    np.testing.assert_allclose(back.angular_velocity(3.8), -curve.angular_velocity(0.7))
    still = PiecewiseQuaternionSlerp([0.0, 1.0], [[0, 0, 0, 1], [0, 0, 0, -1]])
    np.testing.assert_array_equal(still.value(0.3), [0, 0, 0, 1])
    assert not still.angular_velocity(0.3).any()
    with pytest.raises(TrajectoryError, match="must have the length 1"):
        PiecewiseQuaternionSlerp([0.0, 1.0], [[0, 0, 0, 1], [0, 0, 0, 2]])


def test_poses_are_positions_and_orientations():
    """Linear, and with smooth velocities; both pass the poses that are given."""
    X = np.tile(np.eye(4), (5, 1, 1))
    X[:, :3, :3], X[:, :3, 3] = Rotation.random(5, random_state=4).as_matrix(), SAMPLES
    start = np.array([0.1, 0.2, 0.3])
    curves = (
        PiecewisePose.make_linear(TIMES, X),
        PiecewisePose.make_cubic_linear_with_end_linear_velocity(TIMES, X, start),
    )
    for curve in curves:
        np.testing.assert_allclose(curve.value(TIMES), X, atol=1e-12)
        h = 1e-5
        for t in (0.7, 1.5, 3.0):
            V = curve.get_velocity(t)
            ends = curve.get_pose([t + h, t - h])
            np.testing.assert_allclose(V[3:], (ends[0] - ends[1])[:3, 3] / (2 * h), atol=1e-8)
            turned = Rotation.from_matrix(ends[0, :3, :3] @ ends[1, :3, :3].T).as_rotvec()
            np.testing.assert_allclose(V[:3], turned / (2 * h), atol=1e-8)
            np.testing.assert_allclose(
                curve.get_acceleration(t),
                (curve.get_velocity(t + h) - curve.get_velocity(t - h)) / (2 * h),
                atol=1e-6,
            )
    np.testing.assert_allclose(curves[1].get_velocity(0.5)[3:], start, atol=1e-12)
    np.testing.assert_allclose(curves[1].get_velocity(4.0)[3:], 0.0, atol=1e-12)
    assert curves[0].is_approx(curves[0].reverse_time().reverse_time(), 1e-12)
    assert not curves[0].is_approx(curves[1], 1e-3)
    later = curves[0].scale_time(2.0).shift_right(-1.0)
    np.testing.assert_allclose(later.value(2.0), curves[0].value(1.5), atol=1e-12)
    with pytest.raises(TrajectoryError, match="poses must be one for each of 5 times"):
        PiecewisePose.make_linear(TIMES, X[:4])
    with pytest.raises(InvalidPoseError):
        PiecewisePose.make_linear(TIMES, 2.0 * X)
    with pytest.raises(TrajectoryError, match=r"orientation has the start_time 1\.0"):
        PiecewisePose(curves[0].position, curves[0].orientation.scale_time(2.0))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: PiecewisePolynomial.cubic_shape_preserving([0, 1], [[0], [1]]), "three or more"),
        (
            lambda: PiecewisePolynomial.cubic_with_continuous_second_derivatives(
                TIMES, SAMPLES, [0, 0, 0]
            ),
            "come together",
        ),
        (
            lambda: PiecewisePolynomial.cubic_with_continuous_second_derivatives(
                TIMES, SAMPLES, periodic_end=True
            ),
            "must end as they begin",
        ),
        (
            lambda: PiecewisePolynomial.cubic_with_continuous_second_derivatives(
                TIMES, SAMPLES, [0.0], [0.0]
            ),
            r"sample_dot_at_start must have shape \(3,\)",
        ),
        (
            lambda: PiecewisePolynomial.lagrange_interpolating_polynomial([1, 0], [[0], [1]]),
            r"times must grow: 1\.0 is before 0\.0",
        ),
    ],
)
def test_what_makes_no_curve_is_refused(make, says):
    """By name."""
    with pytest.raises(TrajectoryError, match=says):
        make()


def test_an_integral_goes_on_and_has_the_curve_as_its_derivative():
    """Of steps, lines and cubics; of t^2 from 0 to 3 it is 9, in any pieces."""
    steps = PiecewisePolynomial.zero_order_hold(TIMES, SAMPLES)
    for curve in (steps, steps.integral(), PiecewisePolynomial.first_order_hold(TIMES, SAMPLES)):
        whole = curve.integral([1.0, 2.0, 3.0])
        assert whole.degree == curve.degree + 1
        np.testing.assert_allclose(whole.value(TIMES[0]), [1.0, 2.0, 3.0], atol=1e-15)
        np.testing.assert_allclose(whole.derivative().value(ASKED), curve.value(ASKED), atol=1e-12)
        before, after = whole.control_points[:-1, -1], whole.control_points[1:, 0]
        np.testing.assert_allclose(before, after, atol=1e-13)
    square = PiecewisePolynomial([0.0, 1.0, 3.0], [[[0.0], [0.0], [1.0]], [[1.0], [3.0], [9.0]]])
    assert square.integral().value(3.0) == pytest.approx(9.0, rel=1e-15)
    with pytest.raises(TrajectoryError, match=r"value_at_start_time must be a number or"):
        steps.integral([1.0])


def test_a_slice_has_the_segments_at_their_times():
    """And none that are not there."""
    curve = PiecewisePolynomial.cubic_shape_preserving(TIMES, SAMPLES)
    part = curve.slice(1, 2)
    assert (part.start_time, part.end_time) == (0.9, 2.3)
    at = np.linspace(0.9, 2.299, 50)
    np.testing.assert_array_equal(part.value(at), curve.value(at))
    for first, count in ((0, 0), (4, 1), (2, 3)):
        with pytest.raises(TrajectoryError, match="must name one or more of 4 segments"):
            curve.slice(first, count)
    with pytest.raises(TrajectoryError, match="start_segment_index"):
        curve.slice(-1, 1)


@pytest.mark.parametrize("degree", [0, 1, 3, 5])
def test_knots_are_inserted_without_moving_the_curve(degree):
    """Between knots, on them, at the start, and as often as they may come."""
    curve = BsplineTrajectory.clamped_uniform(RNG.normal(size=(8, 2)), degree, 1.0, 3.0)
    at = np.linspace(1.0, 3.0, 400)
    inner = float(np.unique(curve.knots)[2])
    for more in ([1.7], [2.2, 1.3, *[2.2] * min(degree, 1)], [inner] * degree, 1.7, []):
        finer = curve.insert_knots(more)
        assert len(finer.control_points) == 8 + np.size(more)
        np.testing.assert_allclose(finer.value(at), curve.value(at), atol=1e-13)
    open_ends = BsplineTrajectory(np.arange(9.0 + degree), RNG.normal(size=(8, 2)))
    ends = [open_ends.start_time, open_ends.end_time]
    at = np.linspace(*ends, 300)
    finer = open_ends.insert_knots(ends if degree else [])  # where they are one too many
    np.testing.assert_allclose(finer.value(at), open_ends.value(at), atol=1e-12)
    with pytest.raises(TrajectoryError, match=f"at most degree \\+ 1 = {degree + 1} times, 3.0"):
        curve.insert_knots([3.0] * (degree + 1))
    for wrong in ([0.9], [3.1]):
        with pytest.raises(TrajectoryError, match=r"must be from 1\.0 to 3\.0"):
            curve.insert_knots(wrong)
    with pytest.raises(TrajectoryError, match="shape"):
        curve.insert_knots([[1.5]])


def test_derivatives_are_linear_in_control_points():
    """Of both kinds of curves, any order of derivative, at one time and at many."""
    spline = BsplineTrajectory.clamped_uniform(RNG.normal(size=(9, 3)), 4, 0.5, 4.0)
    bezier = BezierCurve(0.5, 4.0, RNG.normal(size=(6, 3)))
    for order in range(6):
        for curve in (spline, bezier):
            points = curve.as_linear_in_control_points(order) @ curve.control_points
            np.testing.assert_allclose(points, curve.derivative(order).control_points, atol=1e-9)
        weights = spline.evaluate_linear_in_control_points(ASKED, order)
        expected = spline.derivative(order).value(ASKED)
        np.testing.assert_allclose(weights @ spline.control_points, expected, atol=1e-9)
    at = spline.evaluate_linear_in_control_points(2.0)
    np.testing.assert_allclose(at @ spline.control_points, spline.value(2.0), atol=1e-13)
    assert at.sum() == pytest.approx(1.0)
    for curve in (spline, bezier):
        with pytest.raises(TrajectoryError, match="derivative_order"):
            curve.as_linear_in_control_points(-1)


HOLDS = [
    PiecewisePolynomial.zero_order_hold,
    PiecewisePolynomial.first_order_hold,
    PiecewisePolynomial.cubic_shape_preserving,
    PiecewisePolynomial.cubic_with_continuous_second_derivatives,
    PiecewisePolynomial.lagrange_interpolating_polynomial,
    lambda t, q: PiecewisePolynomial.cubic_hermite(t, q, q),
    lambda t, q: PiecewisePolynomial.quintic_hermite(t, q, q, q),
]


@pytest.mark.parametrize("make", HOLDS)
def test_times_that_do_not_grow_are_refused_by_all_that_interpolate(make):
    """Equal ones, falling ones, one without a list, lists of lists: before any is divided by."""
    for t, says in (
        ([0.0, 1.0, 1.0, 2.0], r"must grow: 1\.0 is before 1\.0"),
        ([0.0, 2.0, 1.0, 3.0], r"must grow: 2\.0 is before 1\.0"),
        ([[0.0, 1.0, 2.0]], r"must be two numbers or more, not \(1, 3\)"),
        (0.0, r"must be two numbers or more, not \(\)"),
        ([], r"must be two numbers or more, not \(0,\)"),
    ):
        with pytest.raises(TrajectoryError, match=f"(times|breaks) {says}"):
            make(t, np.ones((np.size(t), 2)))


def test_arguments_of_the_wrong_kind_are_named():
    """And a degree that is none, or lower than it can be, never is taken for the curve's own."""
    curve = PiecewisePolynomial.cubic_shape_preserving(TIMES, SAMPLES)
    bezier = BezierCurve(0.0, 1.0, SAMPLES)
    both = CompositeTrajectory((bezier, bezier.shift_right(1.0)))
    X = np.tile(np.eye(4), (5, 1, 1))
    pose = PiecewisePose.make_linear(TIMES, X)
    make = PiecewisePose.make_cubic_linear_with_end_linear_velocity
    for ask, says in (
        (lambda: curve.elevate_degree(np.inf), "degree must be a whole number from 3 on, not inf"),
        (lambda: curve.elevate_degree("4"), "degree must be a whole number from 3 on, not '4'"),
        (lambda: curve.elevate_degree(2), "degree must be a whole number from 3 on, not 2"),
        (lambda: bezier.elevate_degree(3), "degree must be a whole number from 4 on, not 3"),
        (lambda: curve.shift_right("1"), "offset must be a finite number, not '1'"),
        (lambda: curve.shift_right(np.nan), "offset must be a finite number, not nan"),
        (lambda: curve.concatenate_in_time(3), "what is concatenated must be .*, not 3"),
        (lambda: both.is_continuous("1"), "order must be a whole number from 0 on, not '1'"),
        (lambda: both.is_continuous(1, np.nan), "tolerance must be a finite number, not nan"),
        (lambda: pose.is_approx(curve, 1e-9), "other must be a PiecewisePose, not Piece"),
        (lambda: pose.is_approx(pose, "0"), "tolerance must be a finite number, not '0'"),
        (lambda: make(TIMES, X, [1.0]), r"start_vel must have shape \(3,\), not \(1,\)"),
        (lambda: make(TIMES, X, end_vel=None), "end_vel must be numbers"),
    ):
        with pytest.raises(TrajectoryError, match=says):
            ask()
    assert curve.elevate_degree(3).degree == 3


def test_curves_without_ends_are_stacked():
    """Infinite times are the same; a curve that begins when nothing does is none."""
    wave = FunctionHandleTrajectory(lambda t: [np.sin(t)], 1)
    late = FunctionHandleTrajectory(lambda t: [t, 2.0 * t], 2, 0.0)
    stacked = StackedTrajectory((wave, wave.scale_time(2.0)))
    assert (stacked.start_time, stacked.end_time) == (-np.inf, np.inf)
    np.testing.assert_allclose(stacked.value(3.0), np.sin([3.0, 1.5]), rtol=1e-15)
    with pytest.raises(TrajectoryError, match=r"parts\[1\] has the start_time 0.0, the first"):
        StackedTrajectory((wave, late))
    for ends in ((np.inf, np.inf), (-np.inf, -np.inf)):
        with pytest.raises(TrajectoryError, match="start_time and end_time must be numbers in"):
            FunctionHandleTrajectory(lambda t: [t], 1, *ends)

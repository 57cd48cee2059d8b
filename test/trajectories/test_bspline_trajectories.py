"""B-splines beside Cox and de Boor's recursion in fractions, and beside their Bézier curves."""

from fractions import Fraction

import numpy as np
import pytest

from scene_graph_ros.planning.trajectories import (
    BezierCurve,
    BsplineTrajectory,
    Trajectory,
    TrajectoryError,
)

EPSILON = np.finfo(np.float64).eps


def basis(knots, i, degree, t):
    """Return a basis function by its recursion, in fractions; t is before the end."""
    if degree == 0:
        return Fraction(int(knots[i] <= t < knots[i + 1]))
    total = Fraction(0)
    for left, right, sign in ((i, i + degree, 1), (i + degree + 1, i + 1, -1)):
        width = knots[right] - knots[left]
        if width:
            part = (t - knots[left]) / width
            total += part * basis(knots, i if sign > 0 else i + 1, degree - 1, t)
    return total


def exact(curve, t, row):
    """Return a row of the curve at a time before its end."""
    knots = [Fraction(float(k)) for k in curve.knots]
    return sum(
        basis(knots, i, curve.degree, Fraction(t)) * Fraction(float(p[row]))
        for i, p in enumerate(curve.control_points)
    )


def random_curve(seed, degree, count=7, is_clamped=True):
    """Return a curve of random control points, with uneven knots, one of them twice."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 2))
    if not is_clamped:
        return BsplineTrajectory(np.cumsum(rng.uniform(0.2, 1.0, count + degree + 1)), points)
    inner = np.sort(rng.uniform(0.5, 2.5, count - degree - 1))
    if degree > 1:
        inner[1] = inner[0]
    return BsplineTrajectory(
        np.concatenate([[0.25] * (degree + 1), inner, [3.0] * (degree + 1)]), points
    )


@pytest.mark.parametrize("is_clamped", [True, False])
@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4])
def test_values_are_those_of_the_exact_basis(degree, is_clamped):
    """At random times and at knots, to some ulps of the control points."""
    curve = random_curve(degree, degree, is_clamped=is_clamped)
    times = np.append(np.linspace(curve.start_time, curve.end_time, 31)[:-1], curve.knots)
    times = times[(curve.start_time <= times) & (times < curve.end_time)]
    for t, value in zip(times, curve.value(times), strict=True):
        np.testing.assert_array_equal(curve.value(t), value)
        for row in range(2):
            assert abs(Fraction(float(value[row])) - exact(curve, t, row)) <= 50 * EPSILON
    np.testing.assert_array_equal(curve.value(99.0), curve.value(curve.end_time))
    assert isinstance(curve, Trajectory)
    if is_clamped:
        np.testing.assert_array_equal(curve.value(0.25), curve.control_points[0])
        np.testing.assert_array_equal(curve.value(3.0), curve.control_points[-1])


@pytest.mark.parametrize("is_clamped", [True, False])
@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_derivatives_are_those_of_its_bezier_curves(degree, is_clamped):
    """Of all orders, between knots; and the curve is the same as that of its Bézier curves."""
    curve = random_curve(10 + degree, degree, is_clamped=is_clamped)
    pieces = curve.piecewise_polynomial()
    middles = 0.5 * (pieces.breaks[1:] + pieces.breaks[:-1])
    t = np.concatenate([middles, 0.9 * pieces.breaks[:-1] + 0.1 * pieces.breaks[1:]])
    for order in range(degree + 1):
        found, truth = curve.derivative(order).value(t), pieces.derivative(order).value(t)
        size = max(1.0, float(np.abs(truth).max()))
        np.testing.assert_allclose(found, truth, atol=1e-10 * size)
    assert not curve.derivative(degree + 1).value(t).any()
    low, high = curve.bounds()
    assert (pieces.control_points >= low - 1e-14).all()
    assert (pieces.control_points <= high + 1e-14).all()


def test_a_curve_may_jump_and_its_derivatives_do_not_notice():
    """A knot that comes degree + 1 times: two parabolas that know nothing of each other."""
    points = np.array([[0.0], [1.0], [4.0], [-3.0], [0.0], [9.0]])
    curve = BsplineTrajectory([0.0] * 3 + [1.0] * 3 + [3.0] * 3, points)
    left, right = BezierCurve(0.0, 1.0, points[:3]), BezierCurve(1.0, 3.0, points[3:])
    for order in range(4):
        for part, t in ((left, np.linspace(0.0, 0.99, 9)), (right, np.linspace(1.0, 3.0, 9))):
            found = curve.derivative(order).value(t)
            np.testing.assert_allclose(found, part.derivative(order).value(t), atol=1e-13)


def test_without_inner_knots_it_is_a_bezier_curve():
    """With the same control points."""
    points = np.random.default_rng(2).normal(size=(5, 3))
    curve = BsplineTrajectory.clamped_uniform(points, 4, 1.0, 3.0)
    bezier = BezierCurve(1.0, 3.0, points)
    t = np.linspace(0.5, 3.5, 40)
    np.testing.assert_allclose(curve.value(t), bezier.value(t), atol=1e-14)
    np.testing.assert_allclose(
        curve.derivative().control_points, bezier.derivative().control_points, atol=1e-14
    )


def test_curves_are_reversed_slowed_and_moved():
    """Each is compared with the first at the times that it should have."""
    curve = random_curve(5, 3)
    t = np.linspace(0.3, 2.9, 23)
    np.testing.assert_allclose(curve.reverse_time().value(3.25 - t), curve.value(t), atol=1e-14)
    np.testing.assert_allclose(curve.scale_time(2.0).value(2.0 * t), curve.value(t), atol=1e-14)
    np.testing.assert_allclose(curve.shift_right(4.0).value(t + 4.0), curve.value(t), atol=1e-13)


def test_what_makes_no_curve_is_refused_by_name():
    """The message has the argument and its value."""
    points = np.zeros((3, 1))
    for knots, words in [
        ([0.0, 1.0], r"knots must be 4 to 6, .* not \(2,\)"),
        ([0.0] * 3 + [1.0] * 4, r"knots must be 4 to 6, .* not \(7,\)"),
        ([0.0, 2.0, 1.0, 3.0], "knots must not fall: 2.0 is before 1.0"),
        ([0.0, 0.0, 0.0, 0.0, 1.0, 1.0], r"knots\[3\] = 0.0 is not after knots\[2\] = 0.0"),
        ([0.0, 1.0, 1.0, 2.0], "at most degree . 1 = 1 times, 1.0 comes more often"),
        ([0.0, np.nan, 1.0, 2.0], r"knots\[1\] must be finite, not nan"),
    ]:
        with pytest.raises(TrajectoryError, match=words):
            BsplineTrajectory(knots, points)
    with pytest.raises(TrajectoryError, match="control_points must have shape"):
        BsplineTrajectory([0.0, 1.0], [1.0])
    with pytest.raises(TrajectoryError, match="knots must be 4 to 6"):
        BsplineTrajectory.clamped_uniform(points, 3)

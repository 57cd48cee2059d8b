"""Sums and products of piecewise polynomials, and derivatives along paths of any order."""

import numpy as np
from numpy.polynomial import Polynomial
import pytest

from scene_graph_ros.planning.trajectories import (
    CompositeTrajectory,
    PathParameterizedTrajectory,
    PiecewisePolynomial,
    TrajectoryError,
    TrajectoryPoints,
)

BREAKS = np.array([-0.5, 0.25, 1.0, 3.0])
INSIDE = np.array([-0.4, 0.0, 0.25, 0.6, 1.0, 2.2, 2.9])


def random_curve(seed, degree, rows=2):
    """Return a curve of three segments that need not fit together."""
    points = np.random.default_rng(seed).normal(size=(3, degree + 1, rows))
    return PiecewisePolynomial(BREAKS, points)


@pytest.mark.parametrize(("m", "n"), [(0, 3), (2, 2), (4, 1), (5, 5)])
def test_sums_and_products_are_those_of_values(m, n):
    """At times in all segments and at breaks, and of degrees as they must be."""
    first, second, row = random_curve(m, m), random_curve(10 + n, n), random_curve(20, 2, 1)
    a, b, w = (each.value(INSIDE) for each in (first, second, row))
    for found, truth, degree in (
        (first + second, a + b, max(m, n)),
        (first - second, a - b, max(m, n)),
        (-first, -a, m),
        (first * second, a * b, m + n),
        (row * first, w * a, m + 2),
        (first * row, w * a, m + 2),
        (first + row, a + w, max(m, 2)),
        (2.5 * first, 2.5 * a, m),
    ):
        assert found.degree == degree
        np.testing.assert_allclose(found.value(INSIDE), truth, atol=1e-13)


def test_the_product_rule_holds():
    """(a b)' = a' b + a b': the same control points to rounding."""
    a, b = random_curve(1, 3), random_curve(2, 4)
    rule = a.derivative() * b + a * b.derivative()
    np.testing.assert_allclose(
        (a * b).derivative().control_points, rule.control_points, atol=1e-12
    )


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda c: c + c.shift_right(1.0), "added that have the same breaks"),
        (lambda c: c * c.scale_time(2.0), "multiplied that have the same breaks"),
        (lambda c: c - random_curve(0, 1, 3), "2 and 3 rows can't be subtracted"),
        (lambda c: c + 1.0, "added must be a PiecewisePolynomial, not 1.0"),
        (lambda c: c * float("nan"), "a factor must be a finite number, not nan"),
        (lambda c: c * "twice", "a factor must be a finite number, not 'twice'"),
    ],
)
def test_what_can_not_be_combined_is_refused(act, words):
    """The message says why."""
    with pytest.raises(TrajectoryError, match=words):
        act(random_curve(0, 2))


def along(q, s, start, end):
    """Return the trajectory q(s(t)) of numpy's polynomials, and itself as one of numpy's."""

    def curve(p, low, high):
        # A polynomial's Bernstein coefficients on [low, high], by interpolation.
        degree = p.degree()
        x = np.linspace(0.0, 1.0, degree + 1)
        basis = PiecewisePolynomial([0.0, 1.0], np.eye(degree + 1)[np.newaxis]).value(x)
        points = np.linalg.solve(basis, p(low + x * (high - low)))
        return PiecewisePolynomial([low, high], points[np.newaxis, :, np.newaxis])

    low, high = s(start), s(end)
    return PathParameterizedTrajectory(curve(q, low, high), curve(s, start, end)), q(s)


def test_derivatives_along_a_path_are_those_of_the_composed_polynomial():
    """A quartic along a cubic is of degree 12: all its derivatives, by numpy's own."""
    q, s = Polynomial([0.5, -1.0, 0.3, 0.2, -0.1]), Polynomial([0.0, 1.0, 0.4, 0.1])
    motion, truth = along(q, s, 0.5, 1.5)
    t = np.linspace(0.5, 1.5, 11)[:-1]
    for order in range(8):
        expected = truth.deriv(order)(t) if order else truth(t)
        found = motion.eval_derivative(t, order)
        size = 1.0 + abs(expected).max()
        np.testing.assert_allclose(found[:, 0], expected, atol=1e-9 * size)
        np.testing.assert_array_equal(motion.derivative(order).value(t), found)
    np.testing.assert_array_equal(
        motion.derivative(2).derivative().value(0.7), motion.eval_derivative(0.7, 3)
    )
    with pytest.raises(TrajectoryError, match="order must be a whole number from 0 on, not -1"):
        motion.derivative(-1)


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_motions_along_paths_and_their_derivatives_are_reversed_slowed_and_moved(order):
    """Each has the values of the first at the times that it should have, and goes on alike."""
    q, s = Polynomial([0.5, -1.0, 0.3]), Polynomial([0.0, 1.0, 0.4])
    curve = along(q, s, 0.5, 1.5)[0].derivative(order)
    t = np.linspace(0.55, 1.45, 7)
    np.testing.assert_allclose(curve.reverse_time().value(2.0 - t), curve.value(t), atol=1e-12)
    np.testing.assert_allclose(curve.scale_time(3.0).value(3.0 * t), curve.value(t), atol=1e-12)
    np.testing.assert_allclose(curve.shift_right(7.0).value(t + 7.0), curve.value(t), atol=1e-12)
    slope = curve.derivative().value(t)
    for other, factor, at in (
        (curve.reverse_time(), -1.0, 2.0 - t),
        (curve.scale_time(3.0), 1.0 / 3.0, 3.0 * t),
    ):
        np.testing.assert_allclose(other.derivative().value(at), factor * slope, atol=1e-11)


def test_a_motion_along_a_path_is_joined_to_others():
    """Composites take it like all curves; from 4 t^3 on a line with that slope goes on."""
    path = PiecewisePolynomial([0.0, 1.0], [[[0.0], [0.0], [1.0]]])
    squares = PiecewisePolynomial([0.0, 1.0], [[[0.0], [0.0], [1.0]]])
    line = PiecewisePolynomial.first_order_hold([1.0, 2.0], [[1.0], [5.0]])
    both = CompositeTrajectory((PathParameterizedTrajectory(path, squares), line))
    np.testing.assert_allclose(both.derivative().value([0.5, 1.5])[:, 0], [0.5, 4.0], atol=1e-13)
    assert both.is_continuous(1)
    assert not both.is_continuous(2)
    np.testing.assert_allclose(both.jumps(2), [[-12.0]], atol=1e-12)


# Points for messages and controllers.


@pytest.mark.parametrize("derivatives", [0, 1, 2])
def test_curves_through_points_come_back(derivatives):
    """Lines, cubics and quintics, of two rows each, from their breaks."""
    nanoseconds = np.array([500_000_001, 1_000_000_000, 2_250_000_000])
    rows = np.random.default_rng(3).normal(size=(3, 3, 2))
    curve = TrajectoryPoints(nanoseconds, *rows[: derivatives + 1]).trajectory()
    points = TrajectoryPoints.of_curve(curve, nanoseconds[:-1], derivatives)
    found = TrajectoryPoints.of_curve(curve, nanoseconds, derivatives)
    assert (found.velocities is None) == (derivatives == 0)
    assert (found.accelerations is None) == (derivatives < 2)
    t = np.linspace(0.500000001, 1.0, 20)
    np.testing.assert_allclose(points.trajectory().value(t), curve.value(t), atol=1e-12)
    np.testing.assert_allclose(found.positions, rows[0], atol=1e-12)


def test_points_of_a_motion_along_a_path_have_its_derivatives():
    """Of q = t^4, through Python's own numbers."""
    path = PiecewisePolynomial([0.0, 1.0], [[[0.0], [0.0], [1.0]]])
    motion = PathParameterizedTrajectory(path, path)
    points = TrajectoryPoints.of_curve(motion, [0, 500_000_000, 900_000_000])
    np.testing.assert_allclose(points.positions[1:, 0], [0.5**4, 0.9**4], atol=1e-15)
    np.testing.assert_allclose(points.velocities[1:, 0], [4 * 0.5**3, 4 * 0.9**3], atol=1e-14)
    np.testing.assert_allclose(points.accelerations[1:, 0], [3.0, 12 * 0.81], atol=1e-13)


@pytest.mark.parametrize(
    ("nanoseconds", "derivatives", "words"),
    [
        ([0, 10**10], 2, r"lead to 10\.0 s, but the curve is from -0\.5 to 3\.0 s"),
        ([0.5, 1.0], 2, "must be whole numbers"),
        (5, 2, r"must be whole numbers \(m,\)"),
        ([0, 1], 3, "derivatives must be 0, 1 or 2, not 3"),
        ([1, 0], 2, "times must grow"),
    ],
)
def test_points_that_a_curve_does_not_have_are_refused(nanoseconds, derivatives, words):
    """With the value."""
    with pytest.raises(TrajectoryError, match=words):
        TrajectoryPoints.of_curve(random_curve(1, 3), nanoseconds, derivatives)

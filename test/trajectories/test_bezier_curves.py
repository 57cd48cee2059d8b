"""Bézier curves and what is joined of them, beside exact polynomials in fractions."""

from fractions import Fraction
import itertools
import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.planning.trajectories import (
    BezierCurve,
    BsplineTrajectory,
    CompositeTrajectory,
    PiecewisePolynomial,
    Trajectory,
    TrajectoryError,
)

EPSILON = np.finfo(np.float64).eps


def exact_value(curve, t, row):
    """Return a curve's row at a time by the sum of Bernstein's polynomials, in fractions."""
    start, end = Fraction(curve.start_time), Fraction(curve.end_time)
    s = (Fraction(t) - start) / (end - start)
    n = curve.order
    return sum(
        math.comb(n, i) * s**i * (1 - s) ** (n - i) * Fraction(float(p[row]))
        for i, p in enumerate(curve.control_points)
    )


def exact_derivative(curve, t, row, order):
    """Return the same of a derivative: differences of control points, in fractions."""
    width = Fraction(curve.end_time) - Fraction(curve.start_time)
    points = [Fraction(float(p[row])) for p in curve.control_points]
    for _ in range(order):
        n = len(points) - 1
        points = [n * (b - a) / width for a, b in itertools.pairwise(points)] or [Fraction(0)]
    s = (Fraction(t) - Fraction(curve.start_time)) / width
    n = len(points) - 1
    return sum(math.comb(n, i) * s**i * (1 - s) ** (n - i) * p for i, p in enumerate(points))


def random_curve(seed, order=3, rows=2, start=0.3, end=2.1):
    """Return a curve with random control points."""
    points = np.random.default_rng(seed).normal(size=(order + 1, rows))
    return BezierCurve(start, end, points)


@pytest.mark.parametrize("order", [0, 1, 2, 3, 7])
def test_values_and_derivatives_are_those_of_the_exact_polynomial(order):
    """To some ulps of the largest control point, at the ends exactly."""
    curve = random_curve(order, order)
    times = np.linspace(curve.start_time, curve.end_time, 23)
    for derived in range(order + 2):
        found = curve.derivative(derived)
        size = max(1.0, float(np.abs(found.control_points).max()))
        values = found.value(times)
        assert values.shape == (23, 2)
        for t, at in zip(times, values, strict=True):
            np.testing.assert_array_equal(found.value(t), at)
            for row in range(2):
                truth = exact_derivative(curve, t, row, derived)
                assert abs(Fraction(float(at[row])) - truth) <= 40 * EPSILON * size
    np.testing.assert_array_equal(curve.value(curve.start_time), curve.control_points[0])
    np.testing.assert_array_equal(curve.value(curve.end_time), curve.control_points[-1])
    np.testing.assert_array_equal(curve.value([-9.0, 9.0]), curve.control_points[[0, -1]])


@given(
    st.integers(0, 5),
    st.integers(0, 5),
    st.integers(0, 1000),
    st.floats(0.01, 0.99),
)
@settings(max_examples=60, deadline=None)
def test_products_sums_raised_and_split_curves_are_the_exact_ones(m, n, seed, part):
    """At a random time, beside fractions: products to rounding of their control points."""
    first, second = random_curve(seed, m), random_curve(seed + 1, n)
    t = first.start_time + part * first.duration
    product, total, difference = first * second, first + second, first - second
    assert (product.order, total.order) == (m + n, max(m, n))
    raised = first.elevate_degree(m + 3)
    assert raised.order == m + 3
    left, right = first.split(t)
    for row in range(2):
        a, b = exact_value(first, t, row), exact_value(second, t, row)
        for curve, truth in (
            (product, a * b),
            (total, a + b),
            (difference, a - b),
            (raised, a),
            (-first, -a),
            (2.5 * first, Fraction(2.5) * a),
            (first + 1.25, a + Fraction(1.25)),
        ):
            assert abs(Fraction(float(curve.value(t)[row])) - truth) < 2e-14
    at = 0.5 * (first.start_time + t)
    np.testing.assert_allclose(left.value(at), first.value(at), atol=2e-14)
    np.testing.assert_array_equal(left.final_value, right.initial_value)
    # Parts are in the hull of fewer points: bounds become no wider.
    low, high = first.bounds()
    for each in (left, right):
        assert (each.bounds()[0] >= low - 1e-15).all()
        assert (each.bounds()[1] <= high + 1e-15).all()


def test_a_row_multiplies_all_and_the_product_rule_holds():
    """(w r)' = w' r + w r' as polynomials: the same control points to rounding."""
    w, r = random_curve(1, 2, rows=1), random_curve(2, 3, rows=3)
    derived = (w * r).derivative()
    rule = w.derivative() * r + w * r.derivative()
    assert derived.order == rule.order == 4
    np.testing.assert_allclose(derived.control_points, rule.control_points, atol=1e-13)


def test_curves_are_reversed_slowed_and_moved():
    """Each is compared with the first at the times that it should have."""
    curve = random_curve(5)
    t = np.linspace(0.4, 2.0, 11)
    np.testing.assert_allclose(curve.reverse_time().value(2.4 - t), curve.value(t), atol=1e-14)
    np.testing.assert_allclose(curve.scale_time(3.0).value(3.0 * t), curve.value(t), atol=1e-14)
    np.testing.assert_allclose(curve.shift_right(7.0).value(t + 7.0), curve.value(t), atol=1e-13)
    slow = curve.scale_time(2.0).derivative().control_points
    np.testing.assert_allclose(slow, 0.5 * curve.derivative().control_points, atol=1e-14)


def test_curves_that_follow_one_another_are_one_curve():
    """Parts of one curve have no jumps; a moved part jumps by what it was moved."""
    whole = random_curve(3, 4)
    left, right = whole.split(1.0)
    both = CompositeTrajectory((left, right))
    t = np.linspace(0.0, 2.5, 40)
    np.testing.assert_allclose(both.value(t), whole.value(t), atol=2e-14)
    np.testing.assert_array_equal(both.value(1.0), right.initial_value)
    assert both.value(0.7).shape == (2,)
    assert both.breaks.tolist() == [0.3, 1.0, 2.1]
    assert both.is_continuous(4)
    for order in range(5):
        np.testing.assert_allclose(
            both.derivative(order).value(t), whole.derivative(order).value(t), atol=1e-11
        )
    moved = CompositeTrajectory((left, right + np.array([1e-8, -0.5])))
    np.testing.assert_allclose(moved.jumps(), [[1e-8, -0.5]], atol=1e-15)
    assert not moved.is_continuous()
    assert moved.is_continuous(tolerance=0.5 + 1e-12)
    np.testing.assert_allclose(moved.jumps(1), 0.0, atol=1e-13)
    np.testing.assert_allclose(
        both.reverse_time().value(2.4 - t[8:30]), whole.value(t[8:30]), atol=2e-14
    )
    assert both.reverse_time().start_time == pytest.approx(0.3, abs=1e-15)
    later = both.scale_time(2.0).shift_right(1.0)
    np.testing.assert_allclose(later.value(2.0 * t + 1.0), whole.value(t), atol=2e-14)


def test_composites_become_piecewise_polynomials_of_one_degree():
    """Of segments of orders 0 to 4 and of other kinds, without changing a value."""
    rng = np.random.default_rng(8)
    curves = [BezierCurve(k, k + 1.0, rng.normal(size=(k + 1, 3))) for k in range(5)]
    hold = PiecewisePolynomial.first_order_hold([5.0, 5.5, 7.0], rng.normal(size=(3, 3)))
    spline = BsplineTrajectory.clamped_uniform(rng.normal(size=(6, 3)), 3, 7.0, 8.0)
    chain = CompositeTrajectory(tuple(curves)).concatenate_in_time(hold)
    chain = chain.concatenate_in_time(spline)
    assert chain.num_segments == 7
    found = chain.piecewise_polynomial()
    assert (found.degree, found.num_segments) == (4, 10)
    t = np.linspace(0.0, 8.0, 99)
    np.testing.assert_allclose(found.value(t), chain.value(t), atol=1e-14)
    for each in (curves[0], hold, spline, chain, found):
        assert isinstance(each, Trajectory)


def test_what_makes_no_curve_is_refused_by_name():
    """The message has the argument and its value."""
    points = np.zeros((3, 2))
    for arguments, words in [
        ((0.0, 0.0, points), "end_time must be after start_time: 0.0 is not after 0.0"),
        ((np.nan, 1.0, points), "start_time must be a finite number, not nan"),
        ((0.0, np.inf, points), "end_time must be a finite number, not inf"),
        ((0.0, 1.0, np.zeros(3)), r"control_points must have shape .* not \(3,\)"),
        ((0.0, 1.0, np.zeros((0, 3))), r"control_points must have shape .* not \(0, 3\)"),
        ((0.0, 1.0, [[0.0], [np.nan]]), r"control_points\[1, 0\] must be finite, not nan"),
    ]:
        with pytest.raises(TrajectoryError, match=words):
            BezierCurve(*arguments)
    curve = random_curve(0)
    for call, words in [
        (lambda: curve.value([[0.0]]), r"t must be a number or have shape \(m,\)"),
        (lambda: curve.value(np.nan), r"t\[\] must be finite, not nan"),
        (lambda: curve.derivative(-1), "order must be a whole number from 0 on, not -1"),
        (lambda: curve.split(5.0), "t must be between 0.3 and 2.1, not 5.0"),
        (lambda: curve.scale_time(0.0), "factor must be positive and finite, not 0.0"),
        (lambda: curve.shift_right(np.nan), "offset must be a finite number, not nan"),
        (lambda: curve * np.nan, "a factor must be a curve or a number, not nan"),
        (
            lambda: curve + np.array([1.0, 2.0, 3.0]),
            r"must be a number or have shape \(2,\), not \(3,\)",
        ),
        (lambda: curve * random_curve(0, end=3.0), "over the same times"),
        (lambda: curve + random_curve(0, rows=3), "curves of 2 and 3 rows can't be added"),
        (lambda: CompositeTrajectory(()), "segments must be one curve or more"),
        (lambda: CompositeTrajectory((curve, 3.0)), r"segments\[1\] must be a curve, not 3.0"),
        (
            lambda: CompositeTrajectory((curve, curve)),
            r"segments\[1\] begins at 0.3, but the one before ends at 2.1",
        ),
        (
            lambda: CompositeTrajectory((curve, random_curve(0, rows=3, start=2.1, end=3.0))),
            r"segments\[1\] has 3 rows, the one before 2",
        ),
    ]:
        with pytest.raises(TrajectoryError, match=words):
            call()

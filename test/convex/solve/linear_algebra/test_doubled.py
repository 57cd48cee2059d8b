"""What is left of rows: within the stated bound of the truth in fractions."""

from fractions import Fraction

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np

from scene_graph_ros.convex.solve.linear_algebra.doubled import (
    bounded_residuals,
    exact_residual,
    residual_error,
)


@settings(deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_residuals_are_within_their_bounds(seed):
    """Where nearly all cancels: the point is moved onto the row, so that rounding is left."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, 40)), 4
    A = rng.normal(size=(m, n)) * 10.0 ** rng.uniform(-12, 12, size=(m, n))
    x = rng.normal(size=n) * 10.0 ** rng.uniform(-12, 12, size=n)
    truths = [
        sum((Fraction(a) * Fraction(v) for a, v in zip(row, x, strict=True)), Fraction(0))
        for row in A.tolist()
    ]
    b = np.array([float(truth) for truth in truths])
    b[0] = np.nextafter(b[0], np.inf)
    rests, bounds = np.empty(m), np.empty(m)
    bounded_residuals(np.ascontiguousarray(A.T), b, x, rests, bounds)
    for i in range(m):
        truth = Fraction(b[i]) - truths[i]
        one = exact_residual(A[i], x, b[i])
        assert abs(Fraction(one) - truth) <= Fraction(residual_error(A[i], x, b[i], one))
        assert abs(Fraction(rests[i]) - truth) <= Fraction(bounds[i])
        # The bound is worth something: far below that of a plain sum.
        size = np.abs(A[i] * x).sum() + abs(b[i])
        assert bounds[i] <= 1e-15 * abs(rests[i]) + 1e-31 * (n + 5) ** 2 * size


def test_what_was_not_rounded_has_no_error():
    """Small whole numbers, as most rows that people write."""
    A, x, b = np.array([[3.0, -2.0], [1.0, 0.5]]), np.array([4.0, 8.0]), np.array([-4.0, 9.0])
    rests, bounds = np.empty(2), np.empty(2)
    bounded_residuals(np.ascontiguousarray(A.T), b, x, rests, bounds)
    assert rests.tolist() == [0.0, 1.0]
    assert bounds.tolist() == [0.0, 0.0]

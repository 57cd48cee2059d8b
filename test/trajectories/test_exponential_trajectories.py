"""Curves of exponentials and polynomials: values, derivatives, and others made of them."""

import numpy as np
import pytest
from scipy.linalg import expm

from scene_graph_ros.planning.trajectories import (
    ExponentialPlusPiecewisePolynomial,
    PiecewisePolynomial,
    Trajectory,
    TrajectoryError,
)

RNG = np.random.default_rng(4)
BREAKS = np.array([0.5, 1.2, 2.0])
POLYNOMIAL = PiecewisePolynomial(BREAKS, RNG.normal(size=(2, 3, 2)))
K, ALPHA = RNG.normal(size=(2, 4)), RNG.normal(size=(4, 2))
# One mode fades, one grows, two turn for ever.
A = np.linalg.inv(K4 := RNG.normal(size=(4, 4))) @ (
    np.array([[-2.0, 0, 0, 0], [0, 3.0, 0, 0], [0, 0, 0, 5.0], [0, 0, -5.0, 0]]) @ K4
)


def curve():
    """Return a curve by its matrices."""
    return ExponentialPlusPiecewisePolynomial.of_matrices(K, A, ALPHA, POLYNOMIAL)


@pytest.mark.parametrize("t", [0.5, 0.9, 1.2, 1.7, 2.0])
def test_it_is_what_its_matrices_say(t):
    """The value is scipy's matrix exponential and the polynomial."""
    j = int(t >= 1.2)
    wanted = K @ expm((t - BREAKS[j]) * A) @ ALPHA[:, j] + POLYNOMIAL.value(t)
    np.testing.assert_allclose(curve().value(t), wanted, atol=1e-12)
    np.testing.assert_allclose(curve().value([t, 0.7])[0], wanted, atol=1e-12)


def test_derivatives_are_those_of_matrices():
    """The second derivative has A twice."""
    t = 1.6
    wanted = K @ A @ A @ expm((t - 1.2) * A) @ ALPHA[:, 1] + POLYNOMIAL.derivative(2).value(t)
    np.testing.assert_allclose(curve().derivative(2).value(t), wanted, atol=1e-10)
    assert isinstance(curve(), Trajectory)


def test_others_made_of_it():
    """Reversed, slower and later curves have the same values at other times."""
    q, t = curve(), np.linspace(0.5, 1.99, 9)
    np.testing.assert_allclose(q.reverse_time().value(2.5 - t), q.value(t), atol=1e-12)
    np.testing.assert_allclose(q.scale_time(3.0).value(3.0 * t), q.value(t), atol=1e-12)
    np.testing.assert_allclose(q.shift_right(-1.0).value(t - 1.0), q.value(t), atol=1e-12)
    assert (q.value(-7.0) == q.value(0.5)).all()
    assert (q.value(7.0) == q.value(2.0)).all()


def test_what_makes_no_sense_is_refused():
    """Shapes that do not fit, and a matrix without eigenvectors."""
    with pytest.raises(TrajectoryError, match=r"alpha must have shape \(4, 2\)"):
        ExponentialPlusPiecewisePolynomial.of_matrices(K, A, ALPHA[:, :1], POLYNOMIAL)
    defective = np.eye(4, k=1)
    with pytest.raises(TrajectoryError, match="basis of eigenvectors"):
        ExponentialPlusPiecewisePolynomial.of_matrices(K, defective, ALPHA, POLYNOMIAL)
    with pytest.raises(TrajectoryError, match=r"rates\[0\] must be finite"):
        ExponentialPlusPiecewisePolynomial([np.inf], np.zeros((2, 1, 2)), POLYNOMIAL)

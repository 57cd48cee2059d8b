"""Sequential least squares: near optima of curved programs, and what did not converge."""

import numpy as np
import pytest

from scene_graph_ros.convex.solve.nonlinear import minimize_nonlinear


def distance_from(p):
    """Return the square of the distance from a point, with its gradient."""
    return lambda x: (float((x - p) @ (x - p)), 2.0 * (x - p))


def row(a, b):
    """Return a . x - b with its gradient."""
    a = np.asarray(a, float)
    return lambda x: (np.array([a @ x - b]), a[np.newaxis])


@pytest.mark.parametrize("p", [(3.0, 4.0), (-0.1, 0.2), (1e3, -1e3)])
def test_the_nearest_point_of_a_circle(p):
    """An equation that is curved: closed form."""
    p = np.array(p)

    def circle(x):
        return np.array([x @ x - 1.0]), 2.0 * x[np.newaxis]

    x, is_optimal = minimize_nonlinear(distance_from(p), np.array([0.6, 0.8]), [circle], [])
    assert is_optimal
    assert np.allclose(x, p / np.linalg.norm(p), atol=1e-5)


def test_the_nearest_point_of_a_corner():
    """Both rows are met; one that follows from them changes nothing."""
    rows = [row([-1.0, 0.0], -1.0), row([0.0, -1.0], -1.0), row([-1.0, -1.0], -2.0)]
    x, is_optimal = minimize_nonlinear(distance_from(np.array([3.0, 2.0])), np.zeros(2), [], rows)
    assert is_optimal
    assert np.allclose(x, [1.0, 1.0], atol=1e-6)


def test_what_contradicts_itself_does_not_converge():
    """Two planes that are parallel."""
    equations = [row([1.0, 0.0], 0.0), row([1.0, 0.0], 1.0)]
    _, is_optimal = minimize_nonlinear(distance_from(np.ones(2)), np.zeros(2), equations, [])
    assert not is_optimal

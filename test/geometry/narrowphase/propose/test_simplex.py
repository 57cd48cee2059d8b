"""The point of a simplex closest to the origin."""

import numpy as np
import pytest
from scipy.optimize import nnls

from scene_graph_ros.geometry.narrowphase.pair import Workspace
from scene_graph_ros.geometry.narrowphase.propose.simplex import closest_on_simplex, CONTAINS


def solve(points):
    """Return (count, closest point, weights, rows kept) for up to four points."""
    S = np.zeros((4, 9))
    S[: len(points), :3] = points
    S[: len(points), 3] = np.arange(len(points))
    lam = np.zeros(4)
    count, v = closest_on_simplex(Workspace(S, np.zeros((4, 2), np.int64), lam), len(points))
    return count, np.array(v), lam[:count], S[:count, 3].astype(int)


def reference(points):
    """Return the closest point of a simplex by non-negative least squares."""
    heavy = 1e4
    A = np.vstack([np.transpose(points), heavy * np.ones(len(points))])
    weights, _ = nnls(A, np.array([0.0, 0.0, 0.0, heavy]))
    return weights @ points / weights.sum()


def test_random_simplices_agree_with_least_squares():
    """Closest points of 2000 random simplices, near, around and far from the origin."""
    rng = np.random.default_rng(0)
    for _ in range(2000):
        points = rng.normal(size=(rng.integers(1, 5), 3)) + rng.normal(size=3) * rng.integers(3)
        count, v, weights, rows = solve(points)
        assert np.allclose(v, reference(points), atol=1e-6)
        if count < CONTAINS or len(points) < 4:
            assert np.allclose(weights @ points[rows], v, atol=1e-12)
            assert weights.sum() == pytest.approx(1.0, abs=1e-12)
            assert (weights > 0.0).all()


def test_small_simplex_far_away_keeps_its_direction():
    """A triangle of 1e-5 at distance 1 gives the normal distance to rounding."""
    corners = 1e-5 * np.array([[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]])
    corners[:, 2] = 1.0
    _, v, _, _ = solve(corners)
    assert np.allclose(v, [0.0, 0.0, 1.0], atol=1e-15)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_repeated_points_count_once(count):
    """A simplex of equal points is that point."""
    kept, v, weights, _ = solve(np.tile([0.1, 0.2, 0.3], (count, 1)))
    assert np.allclose(v, [0.1, 0.2, 0.3], atol=1e-16)
    assert kept >= 1
    assert weights.sum() == pytest.approx(1.0, abs=1e-15)


def test_collinear_triangle_and_flat_tetrahedron_have_a_closest_point():
    """Simplices without area or volume fall back to their edges and faces."""
    line = np.array([[-1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [3.0, 1.0, 0.0]])
    _, v, _, _ = solve(line)
    assert np.allclose(v, [0.0, 1.0, 0.0], atol=1e-15)
    flat = np.array([[-1.0, -1.0, 0.5], [1.0, -1.0, 0.5], [1.0, 1.0, 0.5], [-1.0, 1.0, 0.5]])
    count, v, _, _ = solve(flat)
    assert count < CONTAINS
    assert np.allclose(v, [0.0, 0.0, 0.5], atol=1e-15)


def test_tetrahedron_around_the_origin_contains_it():
    """The count tells that the origin is inside; outside, a face comes back."""
    corners = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    assert solve(corners)[0] == CONTAINS
    assert solve(corners + np.array([0.0, 0.0, 3.0]))[0] < CONTAINS

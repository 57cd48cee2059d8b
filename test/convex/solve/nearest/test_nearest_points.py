"""Nearest points of polyhedra, of hulls, and by supports: by the conditions of optimality.

The nearest point x to p is in the set, and no point y of the set has ``(p - x) . (y - x) > 0``.
"""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.convex.solve.nearest.nearest_by_support import nearest_by_support
from scene_graph_ros.convex.solve.nearest.nearest_in_hull import nearest_in_hull
from scene_graph_ros.convex.solve.nearest.projection import project_points

seeds = st.integers(0, 2**32 - 1)
sizes = st.sampled_from([2.0**-20, 1.0, 2.0**20])


def polyhedron(seed, size):
    """Return rows of any lengths about a point, many met there; parallel and doubled ones.

    All products are exact, so that the point surely is in the set, also where it is the only one.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    m, equalities = int(rng.integers(1, 20)), int(rng.integers(0, n))
    A = np.round(rng.normal(size=(equalities + m, n)) * 4.0) / 4.0
    A[~A.any(axis=1), 0] = 1.0
    inner = np.round(rng.normal(size=n) * 1024.0) / 1024.0
    slack = np.where(rng.random(len(A)) < 0.4, 0.0, np.round(rng.random(len(A)) * 64.0) / 32.0)
    slack[:equalities] = 0.0
    if m > 3:
        A[-1], slack[-1] = A[equalities], slack[equalities]
        A[-2] = -A[equalities]
    b = (A @ inner + slack) * size
    factors = 2.0 ** rng.integers(-20, 20, size=len(A))
    inner = inner * size
    points = inner + rng.normal(size=(5, n)) * size * 10.0 ** rng.uniform(-3, 3, size=(5, 1))
    return A * factors[:, None], b * factors, equalities, points


@settings(deadline=None, derandomize=True)
@given(seeds, sizes)
def test_projections_on_polyhedra(seed, size):
    """Inside; what leads out is a sum of rows that are met, none of them backwards."""
    A, b, equalities, points = polyhedron(seed, size)
    nearest, y, failed = project_points(A, b, equalities, points)
    assert failed == -1
    lengths = np.linalg.norm(A, axis=1)
    for p, x, weights in zip(points, nearest, y, strict=True):
        room = 1e-11 * (size + np.abs(p).max() + np.abs(x).max())
        gaps = (b - A @ x) / lengths
        assert gaps.min() >= -room
        assert np.abs(gaps[:equalities]).max(initial=0.0) <= room
        assert (weights[equalities:] >= 0.0).all()
        assert np.abs(x + weights @ A - p).max() <= 1e-9 * (size + np.abs(p - x).max())
        assert np.abs(gaps[weights != 0.0]).max(initial=0.0) <= room


@settings(deadline=None, derandomize=True)
@given(seeds, sizes)
def test_nearest_points_of_hulls(seed, size):
    """Weights of corners; no corner is further along. Far from the origin, flat and repeated."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, 6)), int(rng.integers(1, 25))
    spans = rng.normal(size=(int(rng.integers(1, n + 1)), n))
    V = rng.normal(size=(m, len(spans))) @ spans
    V = np.concatenate([V, V[: int(rng.integers(0, m + 1))]])
    offset = rng.normal(size=n) * rng.choice([0.0, 1e3])
    V, points = (V + offset) * size, (rng.normal(size=(5, n)) * 2.0 + offset) * size
    points[0] = V[0]
    nearest, weights, failed = nearest_in_hull(V, points)
    assert failed == -1
    assert (weights >= 0.0).all()
    assert np.allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    spread = np.ptp(V, axis=0).max() + np.abs(points - V[0]).max()
    rounding = 1e-15 * np.abs(V).max()
    assert np.abs(weights @ V - nearest).max() <= 1e-13 * spread + 10.0 * rounding
    for p, x in zip(points, nearest, strict=True):
        beyond = float(((V - x) @ (p - x)).max())
        assert beyond <= (1e-12 * spread + 10.0 * rounding) * (np.linalg.norm(p - x) + spread)
    assert np.linalg.norm(nearest[0] - points[0]) <= 1e-13 * spread + 10.0 * rounding


@pytest.mark.parametrize("radii", [(1.0, 1.0), (1.0, 1.0, 1.0, 1.0), (3.0, 0.5, 1e-3)])
def test_by_supports_a_ball_and_ellipsoids(radii):
    """The bound holds, and is reached: closed forms of balls, multipliers of ellipsoids."""
    radii = np.array(radii)

    def reach(direction):
        point = radii**2 * direction / np.linalg.norm(radii * direction)
        return float(direction @ point), point, 0.0

    p = np.linspace(2.0, 5.0, len(radii))
    distance, x, gap = nearest_by_support(reach, p)
    assert np.linalg.norm(x / radii) <= 1.0 + 1e-9
    assert distance == pytest.approx(np.linalg.norm(p - x))
    value, _, _ = reach(p - x)
    least = ((p - x) @ p - value) / np.linalg.norm(p - x)  # a plane between them: a lower bound
    assert distance - gap <= least + 1e-9
    assert gap <= 1e-6 * distance
    if (radii == 1.0).all():
        assert distance == pytest.approx(np.linalg.norm(p) - 1.0, rel=1e-6)

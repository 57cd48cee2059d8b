"""The simplex method in floats: optima, rays and bases by certificates that are checked here.

A corner is an optimum where multipliers of the basis's rows, none below 0, make the goal and those
rows are met; a ray shows that there is none where it leaves no row and goes up.
"""

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.convex.solve.floats.active_set import (
    climb,
    columns_of,
    enter_equalities,
    OPTIMAL,
    UNBOUNDED,
)

seeds = st.integers(0, 2**32 - 1)
sizes = st.sampled_from([1e-8, 1.0, 1e8])


def program(seed, size):
    """Return unit rows that a point fulfils, many of them met there, a goal, and the point."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 8))
    m, equalities = int(rng.integers(0, 30)), int(rng.integers(0, n))
    A = rng.normal(size=(equalities + m, n))
    if seed % 2:
        A = np.round(A)
        A[~A.any(axis=1), 0] = 1.0
    if m > 4:
        A[-2], A[-1] = A[equalities], A[equalities + 1] + 1e-6 * rng.normal(size=n)
    A /= np.linalg.norm(A, axis=1, keepdims=True)
    x = rng.normal(size=n) * size
    slack = np.where(rng.random(len(A)) < 0.4, 0.0, rng.exponential(size=len(A))) * size
    slack[:equalities] = 0.0
    return A, A @ x + slack, equalities, rng.normal(size=n), x


def walked(A, b, equalities, c, x):
    """Return the status, the point, the basis, multipliers and the ray."""
    x, n = x.copy(), len(x)
    basis, inverse = np.full(n, -1, np.int64), np.eye(n)
    columns = columns_of(A)
    enter_equalities(columns, b, equalities, x, basis, inverse)
    y, ray = np.zeros(n), np.zeros(n)
    steps = 50 * (len(A) + n)
    status = climb(columns, b, equalities, len(b), c, x, basis, inverse, y, ray, steps)
    return status, x, basis, y, ray


@settings(deadline=None, derandomize=True)
@given(seeds, sizes)
def test_what_is_bounded_has_an_optimum(seed, size):
    """With a box about it; the multipliers' bound is the value at the point."""
    A, b, equalities, c, x = program(seed, size)
    n = len(c)
    A = np.concatenate([A, np.eye(n), -np.eye(n)])
    b = np.concatenate([b, x + 3.0 * size, 3.0 * size - x])
    status, found, basis, y, _ = walked(A, b, equalities, c, x)
    assert status == OPTIMAL
    reach = np.abs(found).max() + size
    assert (A @ found - b).max() <= 1e-9 * reach
    assert np.abs((A @ found - b)[:equalities]).max(initial=0.0) <= 1e-9 * reach
    assert len(set(basis[basis >= 0])) == (basis >= 0).sum()
    chosen = basis >= 0
    assert not np.abs(y[~chosen]).max(initial=0.0) > 1e-9
    assert y[chosen & (basis >= equalities)].min(initial=0.0) >= -1e-9
    assert np.allclose(y[chosen] @ A[basis[chosen]], c, atol=1e-8 * (1.0 + np.abs(y).max()))
    bound = float(y[chosen] @ b[basis[chosen]])
    assert c @ found == pytest.approx(bound, abs=1e-8 * reach * (1.0 + np.abs(y).sum()))


@settings(deadline=None, derandomize=True)
@given(seeds, sizes)
def test_what_goes_on_for_ever_has_a_ray(seed, size):
    """All rows are turned away from a direction along which the goal goes up."""
    A, _, equalities, c, x = program(seed, size)
    way = np.random.default_rng(seed + 1).normal(size=len(c))
    way /= np.linalg.norm(way)
    c = c + (1.0 - c @ way) * way
    along = A @ way
    A = A - np.where(np.arange(len(A)) < equalities, along, np.maximum(along, 0.0))[:, None] * way
    lengths = np.linalg.norm(A, axis=1)
    A = A[lengths > 0.1] / lengths[lengths > 0.1, None]
    equalities = int((lengths[:equalities] > 0.1).sum())
    b = A @ x
    status, _, _, _, ray = walked(A, b, equalities, c, x)
    assert status == UNBOUNDED
    assert np.linalg.norm(ray) == pytest.approx(1.0)
    assert c @ ray > 0.0
    assert (A @ ray).max(initial=0.0) <= 1e-9
    assert np.abs((A @ ray)[:equalities]).max(initial=0.0) <= 1e-9


def test_equations_that_follow_or_contradict_stay_outside_of_the_basis():
    """Twice the first, and one that no point of the first two fulfils."""
    A = np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    b = np.array([1.0, 2.0, -1.0, 5.0])
    x, basis, inverse = np.zeros(3), np.full(3, -1, np.int64), np.eye(3)
    enter_equalities(columns_of(A), b, 4, x, basis, inverse)
    assert np.allclose(x, [1.0, -1.0, 0.0])
    assert sum(basis >= 0) == 2
    assert 3 not in basis
    rows = np.where((basis >= 0)[:, None], A[basis], np.eye(3))
    assert np.allclose(rows @ inverse, np.eye(3)) or np.allclose(inverse @ rows, np.eye(3))

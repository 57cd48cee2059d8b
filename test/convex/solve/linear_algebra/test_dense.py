"""Small linear systems: known answers, and what has none."""

import numpy as np
import pytest

from scene_graph_ros.convex.solve.linear_algebra.dense import (
    factor,
    solve_factored,
    solve_general,
    solve_lower,
)


def test_a_factor_gives_the_matrix_back():
    """Of three rows, by hand: U' U; what is below the diagonal is not looked at."""
    U = np.array([[2.0, 6.0, -8.0], [0.0, 1.0, 5.0], [0.0, 0.0, 3.0]])
    G = U.T @ U
    G[np.tril_indices(3, -1)] = np.nan
    assert factor(G)
    np.testing.assert_array_equal(np.triu(G), U)
    T = np.array([[2.0, 0.0], [7.0, 1.0], [0.0, 3.0]])
    half, whole = T.copy(), T.copy()
    solve_lower(G, half)
    np.testing.assert_allclose(U.T @ half, T, rtol=0.0, atol=1e-14)
    solve_factored(G, whole)
    np.testing.assert_allclose(U.T @ (U @ whole), T, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize(
    "G", [np.zeros((1, 1)), np.diag([1.0, -1.0]), np.ones((2, 2)), np.full((1, 1), np.nan)]
)
def test_what_is_not_positive_definite_has_no_factor(G):
    """Zero, a negative eigenvalue, one of zero, and no number."""
    assert not factor(G)


def test_elimination_changes_rows_where_it_has_to():
    """A zero and a tiny number where a pivot would be; a singular matrix says so."""
    M, x = np.array([[0.0, 2.0, 1.0], [1e-20, 1.0, 1.0], [3.0, 0.0, 4.0]]), np.array([1.0, -2, 3])
    b = M @ x
    assert solve_general(M.copy(), b)
    np.testing.assert_allclose(b, x, rtol=1e-14)
    assert not solve_general(np.array([[1.0, 2.0], [2.0, 4.0]]), np.ones(2))

"""Systems with a band, systems with a border, and sparse matrices by columns."""

import numpy as np
import pytest
from scipy import linalg, sparse

from scene_graph_ros.convex.solve.linear_algebra.banded_systems import factor_band, solve_band
from scene_graph_ros.convex.solve.linear_algebra.bordered_systems import (
    add_border,
    eliminate,
    substitute_backward,
    substitute_forward,
)
from scene_graph_ros.convex.solve.linear_algebra.sparse_kernels import compress_columns, products


@pytest.mark.parametrize("seed", range(8))
def test_a_band_of_variables_and_equations(seed):
    """Quasi-definite: minus the identity where equations are, in any order among the variables."""
    rng = np.random.default_rng(seed)
    n, width = int(rng.integers(1, 40)), int(rng.integers(1, 9))
    signs = np.where(rng.random(n) < 0.7, 1.0, -1.0)
    M = np.zeros((n, n))
    for i in range(n):
        for j in range(max(0, i - width + 1), i):
            # Couplings of equals are small, so that each part stays definite.
            M[i, j] = M[j, i] = rng.normal() * (1.0 if signs[i] != signs[j] else 0.4 / width)
        M[i, i] = signs[i] * (1.0 + rng.random())
    band = np.zeros((n, width))
    for k in range(width):
        band[k:, k] = np.diagonal(M, -k) if k < n else 0.0
    L, b = np.zeros((n, width)), rng.normal(size=n + 2)
    factor_band(band, signs, L)
    x = b.copy()
    solve_band(L, x)
    assert np.allclose(M @ x[:n], b[:n], atol=1e-10 * np.abs(x).max())
    assert x[n:].tolist() == b[n:].tolist()  # what is behind is left alone


@pytest.mark.parametrize(("k", "f"), [(1, 1), (3, 2), (7, 4), (13, 5)])
def test_a_bordered_system(k, f):
    """Eliminating k variables leaves the Schur complement of the border."""
    rng = np.random.default_rng(k)
    root = rng.normal(size=(k, k + 3))
    A, B = root @ root.T, rng.normal(size=(k, f))
    at = 5
    systems = np.full(at + k * (k + f) + 3, np.nan)
    systems[at : at + k * (k + f)] = np.concatenate([np.triu(A), B], axis=1).ravel()
    assert eliminate(k, k + f, at, systems)
    out = np.zeros(f * f)
    add_border(k, f, at, systems, out)
    assert np.allclose(np.triu(out.reshape(f, f)), np.triu(B.T @ linalg.solve(A, B)), rtol=1e-9)
    b = rng.normal(size=k)
    x = np.concatenate([[7.0], b])
    substitute_forward(k, k + f, at, systems, 1, x)
    substitute_backward(k, k + f, at, systems, 1, x)
    assert np.allclose(A @ x[1:], b, atol=1e-9)
    assert x[0] == 7.0


def test_what_is_not_definite_is_told():
    """A direction without resistance, and one with less than none."""
    for least in (0.0, -1.0):
        systems = np.array([1.0, 1.0, 0.0, 1.0 + least])
        assert not eliminate(2, 2, 0, systems)


@pytest.mark.parametrize("seed", range(5))
def test_entries_by_columns_are_those_of_scipy(seed):
    """In order, those of one place added up, also of no rows and empty columns."""
    rng = np.random.default_rng(seed)
    m, n, count = int(rng.integers(1, 9)), int(rng.integers(1, 9)), int(rng.integers(0, 60))
    rows, columns = rng.integers(0, m, size=count), rng.integers(0, n, size=count)
    values = rng.normal(size=count)
    sums, places, begin = compress_columns(rows, columns, values, m, n)
    truth = sparse.coo_matrix((values, (rows, columns)), shape=(m, n)).tocsc()
    truth.sort_indices()
    assert begin.tolist() == truth.indptr.tolist()
    assert places.tolist() == truth.indices.tolist()
    assert np.allclose(sums, truth.data, rtol=1e-14, atol=1e-15)
    x, z = rng.normal(size=n), rng.normal(size=m)
    along, across = products(sums, places, begin, x, z)
    assert np.allclose(along, truth @ x)
    assert np.allclose(across, truth.T @ z)

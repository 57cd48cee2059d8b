"""Rows of linear equations and inequalities, and their scaling."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
import functools
import math

import numpy as np

from scene_graph_ros.convex.solve.exact.rational_simplex import whole_rows
from scene_graph_ros.convex.solve.linear_algebra.doubled import exact_residual
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.spatial.elementary import binary_logarithm
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Rows", "is_inside"]


@dataclass(frozen=True, eq=False)
class Rows:
    """A polyhedron ``A x <= b`` of which the first ``num_equalities`` rows are equations.

    ``A`` is ``(m, n)`` and ``b`` ``(m,)``, both finite.
    """

    A: np.ndarray
    b: np.ndarray
    num_equalities: int = 0

    @functools.cached_property
    def exponents(self) -> tuple[np.ndarray, np.ndarray]:
        """Powers of two ``(m,)`` and ``(n,)`` that bring rows and variables to a size.

        Row i times ``2^exponents[0][i]`` in variables ``x / 2^exponents[1]`` has a length between
        1/2 and 1, and where columns are of different size, as few orders of magnitude between its
        entries as two passes of geometric means bring about (Fulkerson and Wolfe 1962).
        """
        rows = np.zeros(len(self.A))
        columns = np.zeros(self.A.shape[1])
        _find_exponents(np.ascontiguousarray(self.A), rows, columns)
        return rows.astype(np.int64), columns.astype(np.int64)

    @functools.cached_property
    def scaled(self) -> tuple[np.ndarray, np.ndarray]:
        """The rows and right sides in the scaled variables: exactly the same polyhedron."""
        rows, columns = self.exponents
        return np.ldexp(self.A, rows[:, None] + columns), np.ldexp(self.b, rows)

    def some(self, which: np.ndarray) -> Rows:
        """Return the inequalities of these indices, scaled as they are among all."""
        result = Rows(self.A[which], self.b[which])
        rows, columns = self.exponents
        result.__dict__["exponents"] = rows[which], columns
        return result


_SPREAD = 8.0
"""Binary orders of magnitude between columns, from which on they are scaled."""


@kernel
def _center_rows(sizes, rows, columns):
    """Fill ``rows`` with minus the mean of the largest and smallest of finite sizes in each.

    ``columns`` are added to the sizes; 0 where none is finite.
    """
    m, n = sizes.shape
    for i in range(m):
        low, high = np.inf, -np.inf
        for k in range(n):
            if sizes[i, k] > -np.inf:
                low = min(low, sizes[i, k] + columns[k])
                high = max(high, sizes[i, k] + columns[k])
        rows[i] = -0.5 * (low + high) if high > -np.inf else 0.0


@kernel
def _find_exponents(A, rows, columns):
    """Fill the exponents of ``Rows.exponents``, whole numbers, over zeros."""
    m, n = A.shape
    sizes = np.empty((m, n))
    for i in range(m):
        for k in range(n):
            sizes[i, k] = binary_logarithm(abs(A[i, k])) if A[i, k] != 0.0 else -np.inf
    sides = np.ascontiguousarray(sizes.T)
    _center_rows(sizes, rows, columns)
    _center_rows(sides, columns, rows)
    if n > 0 and columns.max() - columns.min() > _SPREAD:
        columns[:] = 0.0
        for _ in range(2):
            _center_rows(sizes, rows, columns)
            _center_rows(sides, columns, rows)
        for k in range(n):
            columns[k] = np.rint(columns[k])
    else:
        columns[:] = 0.0
    for i in range(m):
        # By the largest entry, as squares of others may be beyond all numbers.
        largest, square = -np.inf, 0.0
        for k in range(n):
            largest = max(largest, sizes[i, k] + columns[k])
        rows[i] = 0.0
        if largest > -np.inf:
            # Powers of two are exact: the length is at most 1, and above 1/2, whatever rounds.
            unit = np.ceil(largest)
            for k in range(n):
                square += math.ldexp(A[i, k], int(columns[k] - unit)) ** 2
            fraction, exponent = math.frexp(square)
            rows[i] = -unit - ((exponent + (fraction > 0.5)) // 2)


@kernel
def _signs(A, b, num_equalities, x):
    """Return the first row that a point breaks, -1 for none, -2 - i if row i can't be told."""
    m, n = A.shape
    unsure = -1
    for i in range(m):
        size = abs(b[i])
        for k in range(n):
            size += abs(A[i, k] * x[k])
        slack = exact_residual(A[i], x, b[i])
        # The error of doubled precision (Ogita, Rump and Oishi 2005, proposition 5.5).
        error = 2.0 * EPSILON * abs(slack) + 2.0 * (n + 1) ** 2 * EPSILON**2 * size
        if size == 0.0:
            continue
        if slack < -error or (i < num_equalities and slack > error):
            return i
        if unsure == -1 and (i < num_equalities or slack < error):
            unsure = -2 - i
    return unsure


def is_inside(rows: Rows, x: np.ndarray) -> bool:
    """Tell whether a point ``(n,)`` of floats fulfils all rows, exactly."""
    first = _signs(rows.A, rows.b, rows.num_equalities, x)
    if first >= -1:
        return bool(first == -1)
    start = min(-2 - first, rows.num_equalities)
    whole, sides, _ = whole_rows(rows.A[start:], rows.b[start:])
    exact = np.array([Fraction(v) for v in x.tolist()], dtype=object)
    rest = sides - whole @ exact if len(x) else sides
    split = rows.num_equalities - start
    return all(v == 0 for v in rest[:split]) and all(v >= 0 for v in rest[split:])

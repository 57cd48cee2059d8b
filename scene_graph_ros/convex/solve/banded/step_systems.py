"""The linear system of a step of an interior-point method whose rows reach over a band.

Of the unknowns those that one group of rows has for itself are eliminated first.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.solve.linear_algebra.banded_systems import solve_band
from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel

__all__ = [
    "BandedProgram",
    "Going",
    "add_weighted",
    "fill_system",
    "new_going",
    "rows_at",
    "solve_system",
]


class BandedProgram(NamedTuple):
    """Minimize ``cost . x`` where ``values[r] . x[first[r]:...] + constant[r]`` are in cones.

    Places are first those along the band, ``(n,)``, of variables and of multipliers of equations,
    each near what it is of; then those of variables that one group of rows has for itself: row r
    has ``own_values[r]`` of the variable at the place ``own[r]``, or -1. ``signs`` are -1 of
    multipliers and 1 of variables. Rows ``(r,)`` are first equations, whose multipliers' places
    are ``at``, then ``num`` that are at least 0, then those of second-order cones of ``sizes``;
    the rows of a cone or a group begin at one place and are as long. ``lengths (r,)`` are how
    many values rows have. At places of multipliers values and costs are 0. ``groups (k, 2)`` are
    the first row, and how many there are, of the groups: single rows, or the rows of a cone.
    """

    cost: np.ndarray
    signs: np.ndarray
    first: np.ndarray
    lengths: np.ndarray
    values: np.ndarray
    constant: np.ndarray
    own: np.ndarray
    own_values: np.ndarray
    at: np.ndarray
    num: int
    sizes: np.ndarray
    groups: np.ndarray


class Going(NamedTuple):
    """Where the search is, and rooms: of places ``(n,)``, of the cones' rows, of all rows.

    ``M``, ``L`` are the system's band and its factors; ``columns`` are those of a group's rows,
    ``own`` that of its own variable, ``shares`` and ``squares`` its elimination.
    """

    x: np.ndarray
    best_x: np.ndarray
    dx: np.ndarray
    more: np.ndarray
    rx: np.ndarray
    rhs: np.ndarray
    s: np.ndarray
    z: np.ndarray
    best_z: np.ndarray
    ds: np.ndarray
    dz: np.ndarray
    rs: np.ndarray
    a: np.ndarray
    b: np.ndarray
    d: np.ndarray
    w: np.ndarray
    lam: np.ndarray
    eta: np.ndarray
    rows: np.ndarray
    M: np.ndarray
    L: np.ndarray
    columns: np.ndarray
    shares: np.ndarray
    own: np.ndarray
    squares: np.ndarray


@lean_kernel
def rows_at(p, x, out):
    """Set ``out (r,)`` to the rows' values without constants."""
    for r in range(len(out)):
        first, total = p.first[r], 0.0
        for k in range(p.lengths[r]):
            total += p.values[r, k] * x[first + k]
        if p.own[r] >= 0:
            total += p.own_values[r] * x[p.own[r]]
        out[r] = total


@lean_kernel
def add_weighted(p, z, out):
    """Add ``z[r]`` times the rows of cones to ``out (n,)``; z has no equations."""
    m = len(p.at)
    for r in range(m, len(p.first)):
        first, weight = p.first[r], z[r - m]
        for k in range(p.lengths[r]):
            out[first + k] += weight * p.values[r, k]
        if p.own[r] >= 0:
            out[p.own[r]] += weight * p.own_values[r]


@lean_kernel
def fill_system(p, g):
    """Set the band to ``rows' W^-2 rows`` of the cones, with the equations beside it.

    Without the groups' own variables, which are eliminated.
    """
    M, m = g.M, len(p.at)
    for i in range(M.shape[0]):
        for j in range(M.shape[1]):
            M[i, j] = 0.0
    for e in range(m):
        first, at = p.first[e], p.at[e]
        for k in range(p.lengths[e]):
            i, value = first + k, p.values[e, k]
            if value != 0.0:
                M[max(i, at), abs(i - at)] = value
    for r in range(m, m + p.num):
        if p.own[r] < 0:
            _add_single(p, g, r)
    for k in range(len(p.groups)):
        if p.groups[k, 0] < m + p.num:
            _scale_singles(p, g, p.groups[k, 0], p.groups[k, 1])
            _eliminate(p, g, k)
    row = m + p.num
    for c in range(len(p.sizes)):
        _scale_cone(p, g, row, p.sizes[c], g.eta[c])
        if p.own[row] >= 0:
            _eliminate(p, g, p.own[row] - M.shape[0])
        else:
            _add_products(p.first[row], p.lengths[row], p.sizes[c], g)
        row += p.sizes[c]


@lean_kernel
def _add_single(p, g, r):
    """Add the product of a row without a group to the band."""
    w, first = g.w[r - len(p.at)], p.first[r]
    factor = 1.0 / (w * w)
    for a in range(p.lengths[r]):
        value = factor * p.values[r, a]
        if value != 0.0:
            for b in range(a + 1):
                g.M[first + a, a - b] += value * p.values[r, b]


@lean_kernel
def _scale_singles(p, g, row, size):
    """Set the columns of W^-1 rows of a group of single rows."""
    for i in range(size):
        factor = 1.0 / g.w[row + i - len(p.at)]
        g.own[i] = factor * p.own_values[row + i]
        for a in range(p.lengths[row]):
            g.columns[i, a] = factor * p.values[row + i, a]


@lean_kernel
def _scale_cone(p, g, row, size, eta):
    """Set the columns of W^-1 rows of a cone: their products lose less than those of W^-2."""
    at, length, factor = row - len(p.at), p.lengths[row], 1.0 / eta
    head = g.w[at]
    behind = 1.0 / (1.0 + head)
    for a in range(length):
        along, top = 0.0, p.values[row, a]
        for i in range(1, size):
            along += g.w[at + i] * p.values[row + i, a]
        share = along * behind - top
        g.columns[0, a] = (head * top - along) * factor
        for i in range(1, size):
            g.columns[i, a] = (p.values[row + i, a] + share * g.w[at + i]) * factor
    along, top = 0.0, p.own_values[row]
    for i in range(1, size):
        along += g.w[at + i] * p.own_values[row + i]
    share = along * behind - top
    g.own[0] = (head * top - along) * factor
    for i in range(1, size):
        g.own[i] = (p.own_values[row + i] + share * g.w[at + i]) * factor


@lean_kernel
def _eliminate(p, g, k):
    """Add the products of a group's rows without their own variable.

    The remainder of the columns beside it may be far less than they are: so it is computed as
    orthogonalization does, not as a difference of products.
    """
    row, size, square = p.groups[k, 0], p.groups[k, 1], 0.0
    for i in range(size):
        square += g.own[i] * g.own[i]
    g.squares[k] = square
    inverse = 1.0 / square
    for a in range(p.lengths[row]):
        total = 0.0
        for _ in range(2):
            along = 0.0
            for i in range(size):
                along += g.own[i] * g.columns[i, a]
            along *= inverse
            total += along
            for i in range(size):
                g.columns[i, a] -= along * g.own[i]
        g.shares[k, a] = total
    _add_products(p.first[row], p.lengths[row], size, g)


@lean_kernel
def _add_products(first, length, size, g):
    """Add the products of columns to the band."""
    for a in range(length):
        for b in range(a + 1):
            total = 0.0
            for i in range(size):
                total += g.columns[i, a] * g.columns[i, b]
            g.M[first + a, a - b] += total


@lean_kernel
def solve_system(p, g, x):
    """Set x to the solution of the system for ``rhs``, which is overwritten."""
    n = g.M.shape[0]
    for k in range(len(p.groups)):
        row = p.groups[k, 0]
        for a in range(p.lengths[row]):
            g.rhs[p.first[row] + a] -= g.shares[k, a] * g.rhs[n + k]
    for i in range(n):
        x[i] = g.rhs[i]
    solve_band(g.L, x)
    for k in range(len(p.groups)):
        row = p.groups[k, 0]
        total = g.rhs[n + k] / g.squares[k]
        for a in range(p.lengths[row]):
            total -= g.shares[k, a] * x[p.first[row] + a]
        x[n + k] = total


@kernel
def new_going(p):
    """Return rooms for a program."""
    n, m, own = len(p.cost), len(p.at), len(p.groups)
    count, width, most = len(p.first) - m, 1, 1
    for r in range(len(p.first)):
        width = max(width, p.lengths[r])
        if r < m:
            before = p.at[r] - p.first[r]
            width = max(width, abs(before) + 1, abs(before - p.lengths[r] + 1) + 1)
    for size in p.sizes:
        most = max(most, size)
    for k in range(own):
        most = max(most, p.groups[k, 1])
    places = np.zeros((6, n))
    rows = np.zeros((11, count))
    return Going(
        places[0], places[1], places[2], places[3], places[4], places[5],
        rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7], rows[8],
        rows[9], rows[10],
        np.zeros(len(p.sizes)), np.zeros(m + count),
        np.zeros((n - own, width)), np.zeros((n - own, width)), np.zeros((most, width)),
        np.zeros((own, width)), np.zeros(most), np.zeros(own),
    )  # fmt: skip

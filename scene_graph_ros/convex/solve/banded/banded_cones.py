"""Small programs over orthants and second-order cones whose rows take few variables in a row.

A primal-dual interior-point method with Nesterov and Todd's scaling and Mehrotra's corrector
(Andersen, Dahl and Vandenberghe, "Interior-point methods for large-scale cone programming", 2011).
Rows reach over a band of the variables, as those of a path do, so that a step takes time in
proportion to their number. Answers are floats that prove nothing.
"""

from __future__ import annotations

import numpy as np

from scene_graph_ros.convex.solve.banded.cone_scalings import (
    add_identity,
    divide,
    least_eigenvalue,
    longest_step,
    multiply,
    scale_at,
    scaled,
    unscaled,
)
from scene_graph_ros.convex.solve.banded.step_systems import (
    add_weighted,
    BandedProgram,
    fill_system,
    Going,
    new_going,
    rows_at,
    solve_system,
)
from scene_graph_ros.convex.solve.linear_algebra.banded_systems import factor_band
from scene_graph_ros.geometry.compiled.entry_points import entry_point
from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel, merged_kernel

__all__ = ["IMPROVE", "minimize_banded"]

_MOST_ITERATIONS = 60

_STALLED = 6
"""Iterations in a row that did not halve what is off, after which the best point has to do."""

_NEAR = 10.0
"""Times the tolerance: so near to it the first such iteration is the last."""

_BACK = 0.99
"""Of the way to the cones' boundary."""

_POLISHED = 2
"""How often a step is polished at most."""

_BALANCED = 1e-12
"""What a step may be off stationarity by: a hundredth of what is asked for at best."""

_WELL_INSIDE = 1e-6
"""The least that first points are away from the cones' boundary."""


@lean_kernel
def _residuals(p, g):
    """Set the residuals: of stationarity and equations ``rx (n,)``, of the cones' rows ``rs``.

    Return the largest one, or the gap, relative; infinite where one is no number.
    """
    m, n, x = len(p.at), len(g.x), g.x
    rows_at(p, x, g.rows)
    primal, most, size, dual = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        g.rx[i] = -p.cost[i]
        primal += p.cost[i] * x[i]
        most = max(most, abs(p.cost[i]))
    add_weighted(p, g.z, g.rx)
    for e in range(m):
        y, first = x[p.at[e]], p.first[e]
        for k in range(p.lengths[e]):
            g.rx[first + k] += y * p.values[e, k]
    for e in range(m):
        g.rx[p.at[e]] = g.rows[e] + p.constant[e]
        dual -= x[p.at[e]] * p.constant[e]
    off, slope = 0.0, 0.0
    for r in range(len(p.first)):
        size = max(size, abs(p.constant[r]))
    for i in range(len(g.s)):
        g.rs[i] = g.rows[m + i] + p.constant[m + i] - g.s[i]
        dual -= g.z[i] * p.constant[m + i]
        off = max(off, abs(g.rs[i]))
    for i in range(n):
        if p.signs[i] > 0.0:
            slope = max(slope, abs(g.rx[i]))
        else:
            off = max(off, abs(g.rx[i]))
    found = max(slope / (1.0 + most), off / (1.0 + size))
    found = max(found, abs(primal - dual) / (1.0 + abs(primal)))
    # Differences that are not 0 are those of what is no number.
    return found if primal - primal + dual - dual == 0.0 and found == found else np.inf


@merged_kernel
def _direction(p, g, share):
    """Set a step for ``lam o (W dz + W^-1 ds) = d`` and residuals times ``share``."""
    m, num, sizes = len(p.at), p.num, p.sizes
    divide(num, sizes, g.lam, g.d, g.a)
    unscaled(num, sizes, g.w, g.eta, g.rs, g.b)
    for i in range(len(g.a)):
        g.a[i] -= share * g.b[i]
    unscaled(num, sizes, g.w, g.eta, g.a, g.b)
    # b is W^-2 (W (lam \\ d) - share rs).
    for i in range(len(g.rhs)):
        g.rhs[i] = share * g.rx[i] if p.signs[i] > 0.0 else -share * g.rx[i]
    add_weighted(p, g.b, g.rhs)
    solve_system(p, g, g.dx)
    rows_at(p, g.dx, g.rows)
    for i in range(len(g.ds)):
        g.ds[i] = g.rows[m + i] + share * g.rs[i]
        g.a[i] = g.rows[m + i]
    unscaled(num, sizes, g.w, g.eta, g.a, g.dz)
    unscaled(num, sizes, g.w, g.eta, g.dz, g.a)
    for i in range(len(g.dz)):
        g.dz[i] = g.b[i] - g.a[i]
    for e in range(m):
        g.dx[p.at[e]] = -g.dx[p.at[e]]
    for _ in range(_POLISHED):
        if _polish(p, g, share) <= _BALANCED:
            break


@lean_kernel
def _polish(p, g, share):
    """Take the rounding error of stationarity out of a step; return its size.

    W^-2 is large where multipliers are, and so is its rounding.
    """
    m, off = len(p.at), 0.0
    for i in range(len(g.rhs)):
        g.rhs[i] = share * g.rx[i]
    add_weighted(p, g.dz, g.rhs)
    for e in range(m):
        y, first = g.dx[p.at[e]], p.first[e]
        for k in range(p.lengths[e]):
            g.rhs[first + k] += y * p.values[e, k]
    for i in range(len(g.rhs)):
        if p.signs[i] < 0.0:
            g.rhs[i] = 0.0
        off = max(off, abs(g.rhs[i]))
    if off <= _BALANCED:
        return off
    solve_system(p, g, g.more)
    rows_at(p, g.more, g.rows)
    for i in range(len(g.ds)):
        g.a[i] = g.rows[m + i]
        g.ds[i] += g.a[i]
    unscaled(p.num, p.sizes, g.w, g.eta, g.a, g.b)
    unscaled(p.num, p.sizes, g.w, g.eta, g.b, g.a)
    for i in range(len(g.dz)):
        g.dz[i] -= g.a[i]
    for i in range(len(g.dx)):
        g.dx[i] += p.signs[i] * g.more[i]
    return off


@lean_kernel
def _start(p, g):
    """Set the least squares of rows, and of multipliers, moved into the cones."""
    m, count, row = len(p.at), len(g.s), p.num
    for i in range(p.num):
        g.w[i] = 1.0
    for c in range(len(p.sizes)):
        g.w[row], g.eta[c] = 1.0, 1.0
        row += p.sizes[c]
    fill_system(p, g)
    factor_band(g.M, p.signs, g.L)
    for i in range(count):
        g.a[i] = -p.constant[m + i]
    add_weighted(p, g.a, g.rhs)
    for e in range(m):
        g.rhs[p.at[e]] = -p.constant[e]
    for turn in range(2):
        solve_system(p, g, g.dx)
        rows_at(p, g.dx, g.rows)
        x = g.z if turn else g.s
        for i in range(count):
            x[i] = g.rows[m + i] if turn else g.rows[m + i] + p.constant[m + i]
        least = least_eigenvalue(p.num, p.sizes, x)
        if least < _WELL_INSIDE:
            add_identity(p.num, p.sizes, x, 1.0 - least)
        for i in range(len(g.x)):
            # Multipliers of equations come with those of cones.
            if (p.signs[i] > 0.0) == (turn == 0):
                g.x[i] = g.dx[i]
            g.rhs[i] = p.cost[i]


@lean_kernel
def _step(p, g):
    """Move on: towards the optimum as far as that goes, and to the middle by what it does not."""
    num, sizes, count = p.num, p.sizes, len(g.s)
    scale_at(num, sizes, g.s, g.z, g.w, g.eta, g.lam)
    fill_system(p, g)
    factor_band(g.M, p.signs, g.L)
    mu = 0.0
    for i in range(count):
        mu += g.s[i] * g.z[i]
    mu /= num + len(sizes)
    multiply(num, sizes, g.lam, g.lam, g.d)
    for i in range(count):
        g.d[i] = -g.d[i]
    share, along_s, along_z = 1.0, 0.0, 0.0
    for turn in range(2):
        _direction(p, g, share)
        along_s = longest_step(num, sizes, g.s, g.ds)
        along_z = longest_step(num, sizes, g.z, g.dz)
        if turn:
            break
        center = (1.0 - min(1.0, along_s, along_z)) ** 3
        unscaled(num, sizes, g.w, g.eta, g.ds, g.a)
        scaled(num, sizes, g.w, g.eta, g.dz, g.b)
        multiply(num, sizes, g.a, g.b, g.ds)
        for i in range(count):
            g.d[i] -= g.ds[i]
        add_identity(num, sizes, g.d, center * mu)
        share = 1.0 - center
    along_s, along_z = min(1.0, _BACK * along_s), min(1.0, _BACK * along_z)
    for i in range(len(g.x)):
        g.x[i] += (along_s if p.signs[i] > 0.0 else along_z) * g.dx[i]
    for i in range(count):
        g.s[i] += along_s * g.ds[i]
        g.z[i] += along_z * g.dz[i]


def _improve(p, g, tolerance):
    """Go on until the tolerance is kept, or nothing gets better; return the least residual."""
    _start(p, g)
    best, stalled = np.inf, 0
    for _ in range(_MOST_ITERATIONS):
        residual = _residuals(p, g)
        stalled = 0 if residual < 0.5 * best else stalled + 1
        if residual < best:
            best = residual
            for i in range(len(g.x)):
                g.best_x[i] = g.x[i]
            for i in range(len(g.z)):
                g.best_z[i] = g.z[i]
        most = _STALLED if best > _NEAR * tolerance else 0
        if best <= tolerance or stalled > most or not residual < np.inf or not len(g.s):
            break
        _step(p, g)
    return best


def _example():
    numbers, whole, band = np.zeros(1), np.zeros(1, np.int64), np.zeros((1, 1))
    table = np.zeros((1, 2), np.int64)
    rows = numbers, numbers, whole, whole, band, numbers, whole, numbers
    program = BandedProgram(*rows, whole, 0, whole, table)
    return program, Going._make([numbers] * 19 + [band] * 4 + [numbers] * 2), 0.0


IMPROVE = entry_point(_improve, _example())
"""`minimize_banded` is given its address."""

_call_improve = IMPROVE.call


@kernel
def minimize_banded(p, tolerance, improve):
    """Return points x ``(n,)`` with multipliers of equations, those z of cones, and a residual.

    Multipliers are such that ``cost . x - z . rows - y . equations`` has its least value at x. The
    residual is the largest of those of equations, cones, stationarity and the gap; where it
    is above ``tolerance`` the search found nothing better. ``improve`` is the address of
    `IMPROVE`.
    """
    g = new_going(p)
    residual = _call_improve(improve, (p, g, tolerance))
    return g.best_x, g.best_z, residual

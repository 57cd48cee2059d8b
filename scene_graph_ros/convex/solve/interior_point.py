"""Local optima of linear costs, norms and squares under linear rows and products of two of them.

By a primal-dual interior-point method with a predictor and a corrector (Mehrotra, "On the
implementation of a primal-dual interior point method", SIAM Journal on Optimization 2(4), 1992)
and the Hessian of the Lagrangian, made positive definite. Linear equations are eliminated. Norms
are smoothed, less from step to step, and have duals of their own (Andersen, Christiansen, Conn and
Overton, "An efficient primal-dual interior-point method for minimizing a sum of Euclidean norms",
SIAM Journal on Scientific Computing 22(1), 2000).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.solve.products import curvature_of, joined, Products, values_of

__all__ = [
    "FAR",
    "KEPT",
    "NEAR",
    "Costs",
    "InteriorPoint",
    "LinearRows",
    "Rows",
    "Search",
    "independent",
]

Rows = tuple[np.ndarray, np.ndarray]
"""``M (k, n)`` and ``m (k,)`` of rows ``M @ y + m``."""

_SLOPE, _KEPT, _PRODUCT = 1e-8, 1e-9, 1e-9
"""Where an iteration ends: the largest slope of the Lagrangian, in units of cost, the largest
violation of rows of length 1, and the largest product of a row and its multiplier."""

_BROKEN = 1e-11
"""By how much inequalities may be broken at such an end: velocities are off by a multiple of it,
as durations may be much shorter than their bounds are apart."""

_SLACK = 1e-2
"""The least first slack."""

_SHORT = 2e-2
"""Of a Newton step: one that is cut to less is short."""

_LOST = 1e3
"""A slope, in units of cost, from which no search came back."""

_LEAST, _TO_EDGE = 1e-13, 0.99
"""Of slacks, which rounding would take to 0; and of the step to where a slack or a multiplier is
0: how long one is at most."""

_ROUGHEST, _NEARLY_SHARP, _SHARP, _SHARPER, _SLIGHT = 1e-2, 3e-5, 1e-6, 0.1, 0.1
"""Norms are ``sqrt(|w|^2 + s^2)``, s being these parts of their sizes, first, near the end and
last; each step is sharper by a factor while the slope is less than a part of the largest norm's
weight."""

_DEPENDENT = 1e-11
"""Of the longest row: what is left of a row less others, where it depends on them."""

_FLAT = 1e-10
"""Of a row's length: what is left of one that equations decide."""

_LEAST_CURVATURE = 1e-11
"""In units of cost: what is added to each Hessian. More would shorten steps along which the cost
hardly curves, as with durations that nothing but a product bounds."""

_END, _GAIN, _PERIOD, _FULL = 1e-8, 0.5, 8, 5
"""With products of this mean the last part of a search begins. Newton steps may go in circles
around a point where a norm vanishes: after so many full ones in a row that take less than a part
off the slope, all up to the period are halved."""

_FIRST_SHIFT, _SHIFTS, _BLOCK = 1e-4, 20, 36
"""What is added to a Hessian that is not positive definite, more each time, and how often; and the
rows of a block of a product."""


class Search(NamedTuple):
    """The first products of rows and multipliers, and when a search is given up."""

    barrier: float
    iterations: int = 40
    short_steps: int = 2
    """The most steps that slacks cut short. Where slacks vanish before constraints are kept,
    multipliers grow without bounds, and steps become ever shorter."""


NEAR, FAR, KEPT = Search(1e-3), Search(1e-1), Search(1e-2, 80, 80)
"""Near a start, far from it, and from one that keeps the inequalities."""


class Costs(NamedTuple):
    """``linear @ y``, and weights of norms and of squares of rows; each norm has a size."""

    linear: np.ndarray
    norms: Sequence[tuple[np.ndarray, np.ndarray, float, float]]
    squares: Sequence[tuple[np.ndarray, np.ndarray, float]]


class _Norms:
    """The norms of rows that are not constant, filled up to the same number of rows each."""

    def __init__(self, costs: Costs, y: np.ndarray, Z: np.ndarray) -> None:
        some = [(M @ Z, M @ y + m, w, size) for M, m, w, size in costs.norms]
        some = [each for each in some if np.abs(each[0]).max(initial=0.0) > _FLAT]
        most = max((len(m) for _, m, _, _ in some), default=1)
        self.M, self.m = np.zeros((len(some), most, Z.shape[1])), np.zeros((len(some), most))
        for k, (M, m, _, _) in enumerate(some):
            self.M[k, : len(m)], self.m[k, : len(m)] = M, m
        self.weights, self.sizes = (np.array([each[k] for each in some]) for k in (2, 3))
        self.heaviest = self.weights.max(initial=0.0)
        self._flat = self.M.reshape(len(some) * most, Z.shape[1])
        self._duals = np.zeros_like(self.m)
        self.rough = _ROUGHEST if some else _SHARP

    def look(self, z: np.ndarray) -> np.ndarray:
        """Return the slope ``(n,)`` at a point."""
        self._w = self.M @ z + self.m
        self._r = np.sqrt((self._w**2).sum(axis=1) + (self.rough * self.sizes) ** 2)
        slopes = self._w * (self.weights / self._r)[:, None]
        found: np.ndarray = slopes.ravel() @ self._flat
        return found

    def curvature(self) -> np.ndarray:
        """Return the second derivative ``(n, n)``, by the duals, at the point looked at."""
        mixed = self._duals[:, :, None] * self._w[:, None, :]
        both = (mixed + mixed.transpose(0, 2, 1)) / (2.0 * self._r)[:, None, None]
        inner = (self.weights / self._r)[:, None, None] * (np.eye(self.m.shape[1]) - both)
        found: np.ndarray = self._flat.T @ (inner @ self.M).reshape(self._flat.shape)
        return found

    def step(self, dz: np.ndarray, length: float) -> None:
        """Have the duals follow a step, none longer than 1."""
        along, u = self.M @ dz, self._duals
        shorter = (self._w * along).sum(axis=1) / self._r
        aim = (self._w + along - u * shorter[:, None]) / self._r[:, None]
        moved = u + length * (aim - u)
        self._duals = moved / np.maximum(np.sqrt((moved**2).sum(axis=1)), 1.0)[:, None]


class LinearRows:
    """Equations, and rows that are at least 0, of all points y + Z @ z that keep the former."""

    def __init__(self, equations: Rows, rows: Rows) -> None:
        from scipy.linalg import qr

        (E, e), (self._A, self._b) = equations, rows
        kept = independent(E)
        self._E, self._e, rank = E[kept], e[kept], len(kept)
        Q, R = qr(self._E.T)
        self._along, self._R, self.Z = Q[:, :rank], R[:rank], Q[:, rank:]
        self.longest = np.linalg.norm(self._A, axis=1)
        self.A = self._A @ self.Z
        self.sizes = np.linalg.norm(self.A, axis=1)

    def nearest(self, start: np.ndarray) -> np.ndarray:
        """Return the nearest point ``(n,)`` that keeps the equations."""
        from scipy.linalg import solve_triangular

        lacking = solve_triangular(self._R, -(self._E @ start + self._e), trans="T")
        found: np.ndarray = start + self._along @ lacking
        return found

    def values(self, y: np.ndarray) -> np.ndarray:
        """Return the values ``(k,)`` of the rows at a point."""
        found: np.ndarray = self._A @ y + self._b
        return found


class InteriorPoint:
    """The program of z, for y + Z @ z keeping the equations; rows are of length 1."""

    def __init__(
        self,
        start: np.ndarray,
        linear: LinearRows,
        products: tuple[Products, Products],
        costs: Costs,
    ) -> None:
        """``products`` are 0, the first of them, and at least 0, the second."""
        self._y, self._Z = linear.nearest(start), linear.Z
        y, Z = self._y, self._Z
        A, b, longest, sizes = linear.A, linear.values(y), linear.longest, linear.sizes
        moves = sizes > _FLAT * longest
        self._is_possible = bool((b[~moves] >= -_KEPT * longest[~moves]).all())
        self._A, self._b = A[moves] / sizes[moves, None], b[moves] / sizes[moves]
        self._equal, self._least = (joined(some, y, Z) for some in products)
        self._linear, self._norms = costs.linear @ Z, _Norms(costs, y, Z)
        self._squares = np.zeros((Z.shape[1], Z.shape[1]))
        self._linear = self._linear.copy()
        for M, m, weight in costs.squares:
            self._linear += 2.0 * weight * (M @ y + m) @ (M @ Z)
            self._squares += 2.0 * weight * (M @ Z).T @ (M @ Z)

    def _kept(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the values ``(k,)`` of all inequalities, and their slopes ``(k, n)``."""
        values, slopes = values_of(self._least, z)
        return (
            np.concatenate([self._A @ z + self._b, values]),
            np.concatenate([self._A, slopes]),
        )

    def solve(
        self, search: Search, is_over: Callable[[], bool] | None = None
    ) -> tuple[np.ndarray, bool]:
        """Return a point ``(n,)``, and whether its conditions of optimality hold.

        The search begins at the start, and ends where ``is_over``.
        """
        if not self._Z.shape[1]:
            nothing = np.zeros(0)
            kept = values_of(self._least, nothing)[0], -np.abs(values_of(self._equal, nothing)[0])
            return self._y, self._is_possible and bool((np.concatenate(kept) >= -_KEPT).all())
        if not self._is_possible:
            return self._y, False
        state, short = _State(self, search.barrier), 0
        for _ in range(search.iterations):
            if state.is_optimal():
                return self._y + self._Z @ state.z, True
            if (is_over is not None and is_over()) or not state.step():
                break
            short += state.is_short
            if short > search.short_steps:
                break
        return self._y, False


class _State:
    """A point, slacks and multipliers, and what they come to."""

    def __init__(self, of: InteriorPoint, barrier: float) -> None:
        self._of, self.z = of, np.zeros(of._Z.shape[1])
        self._c, self._J = of._kept(self.z)
        self._slack = np.maximum(self._c, _SLACK)
        self._multipliers = barrier / self._slack
        self._of_equal = np.zeros(sum(len(some[0].l) for some in of._equal))
        self._shift, self._idle, self._least_slope, self.is_short = 0.0, 0, np.inf, False
        self._look()

    def _slope(self) -> np.ndarray:
        of = self._of
        found: np.ndarray = of._linear + of._squares @ self.z + of._norms.look(self.z)
        return found - self._multipliers @ self._J - self._of_equal @ self._JE

    def _look(self) -> None:
        """See how far conditions are from being kept, and make norms sharper where that helps."""
        norms = self._of._norms
        self._h, self._JE = values_of(self._of._equal, self.z)
        self._rd = self._slope()
        if norms.rough > _SHARP and np.abs(self._rd).max() <= _SLIGHT * norms.heaviest:
            norms.rough = max(_SHARPER * norms.rough, _SHARP)
            self._rd = self._slope()

    def is_optimal(self) -> bool:
        """Tell whether the conditions of optimality hold."""
        return (
            self._of._norms.rough <= _SHARP
            and np.abs(self._rd).max(initial=0.0) <= _SLOPE
            and np.abs(self._c - self._slack).max(initial=0.0) <= _KEPT
            and self._c.min(initial=0.0) >= -_BROKEN
            and np.abs(self._h).max(initial=0.0) <= 0.1 * _KEPT
            and (self._slack * self._multipliers).max(initial=0.0) <= _PRODUCT
        )

    def step(self) -> bool:
        """Go on to the next point; False where no step is found."""
        solve = self._factored()
        if solve is None:
            return False
        s, lam = self._slack, self._multipliers
        count = max(len(s), 1)
        mean = float(s @ lam) / count
        # As if there were no barrier, which tells how strong the next one is to be.
        _, ds, dl, _ = solve(np.zeros(len(s)))
        ahead = _longest(s, ds), _longest(lam, dl)
        left = float((s + ahead[0] * ds) @ (lam + ahead[1] * dl)) / count
        centred = min(max((left / mean) ** 3 if mean else 0.0, 1e-3), 1.0)
        barrier = max(centred * mean, 0.1 * _PRODUCT)
        bent = barrier - ahead[0] * ahead[1] * ds * dl
        dz, ds, dl, dn = solve(np.clip(bent, 0.1 * barrier, 10.0 * barrier))
        along, dual = _longest(s, ds), _longest(lam, dl)
        self.is_short = along < _SHORT
        if self._goes_in_circles(mean):
            along, dual = 0.5 * along, 0.5 * dual
        self._of._norms.step(dz, min(along, dual))
        self.z = self.z + along * dz
        self._multipliers, self._of_equal = lam + dual * dl, self._of_equal + dual * dn
        self._c, self._J = self._of._kept(self.z)
        # More slack takes nothing from the next step.
        self._slack = np.maximum(np.maximum(s + along * ds, self._c), _LEAST)
        self._look()
        return bool(np.abs(self._rd).max(initial=0.0) <= _LOST)

    def _goes_in_circles(self, mean: float) -> bool:
        """Tell whether a step is to be halved; ``mean`` is that of all products."""
        if mean > _END or self._of._norms.rough > _NEARLY_SHARP:
            return False
        slope = float(np.abs(self._rd).max(initial=0.0))
        self._idle = 0 if slope < _GAIN * self._least_slope else self._idle + 1
        self._least_slope = min(self._least_slope, slope)
        return self._idle % _PERIOD >= _FULL

    def _factored(self) -> Callable[[np.ndarray], tuple[np.ndarray, ...]] | None:
        """Return a function of products of slacks and multipliers: the step to them."""
        from scipy.linalg.lapack import dpotrs

        of, z, s, lam, J, JE = (
            self._of, self.z, self._slack, self._multipliers, self._J, self._JE
        )  # fmt: skip
        D, lacking = lam / s, self._c - s
        pressed = J * np.sqrt(D)[:, None]
        convex = of._squares + of._norms.curvature() + _squared(pressed)
        typical = float(np.trace(convex)) / len(z)
        heavy = max(1.0, typical)
        if len(JE):
            convex += heavy * (JE.T @ JE)
        convex[np.diag_indices(len(z))] += _LEAST_CURVATURE
        bent = -curvature_of(of._least, z, lam[len(of._b) :])
        bent -= curvature_of(of._equal, z, self._of_equal)
        factor = self._positive(convex, bent)
        if factor is None:
            return None
        Y = np.array([dpotrs(factor, row)[0] for row in JE]).T if len(JE) else JE.T
        inner = JE @ Y
        inner[np.diag_indices(len(inner))] += 1e-14 * np.trace(inner) / max(len(inner), 1)
        of_equal = _factor(inner) if len(JE) else inner
        if of_equal is None:
            return None

        def step(products: np.ndarray) -> tuple[np.ndarray, ...]:
            pulled = products / s - lam - D * lacking
            dz = pulled @ J - self._rd - heavy * (self._h @ JE)
            dz, dn = dpotrs(factor, dz)[0], np.zeros(0)
            if len(JE):
                dn = dpotrs(of_equal, -self._h - JE @ dz)[0]
                dz = dz + Y @ dn
            ds = J @ dz + lacking
            return dz, ds, products / s - lam - D * ds, dn

        return step

    def _positive(self, convex: np.ndarray, bent: np.ndarray) -> np.ndarray | None:
        """Return the factor of a Hessian, made positive definite; None where that fails."""
        factor, shift = _factor(convex + bent), 0.0
        if factor is None and not len(self._h):
            # Without what curves downwards a step is that to where rows are tangent.
            factor = _factor(convex)
        for _ in range(_SHIFTS if factor is None else 0):
            shift = 8.0 * shift if shift else max(_FIRST_SHIFT, self._shift / 3.0)
            factor = _factor(convex + bent + shift * np.eye(len(convex)))
            if factor is not None:
                break
        self._shift = shift
        return factor


def _squared(M: np.ndarray) -> np.ndarray:
    """Return ``M.T @ M`` ``(n, n)``, by blocks for which BLAS wakes no other threads.

    On a busy machine it waits for them a hundred times as long as the product takes.
    """
    found: np.ndarray = M[:_BLOCK].T @ M[:_BLOCK]
    for first in range(_BLOCK, len(M), _BLOCK):
        block = M[first : first + _BLOCK]
        found += block.T @ block
    return found


def _factor(K: np.ndarray) -> np.ndarray | None:
    """Return the Cholesky factor of a matrix; None where it is not positive definite."""
    from scipy.linalg.lapack import dpotrf

    factor, failed = dpotrf(K)
    return None if failed else factor


def independent(M: np.ndarray) -> np.ndarray:
    """Return the numbers of rows ``(r,)`` of ``(k, n)`` that none of the others depend on.

    By a QR decomposition with pivots. Where right sides contradict each other, points keep the
    rows that are returned and break the others: who asks looks at these, too.
    """
    from scipy.linalg import qr

    if not M.any():
        return np.zeros(0, dtype=np.intp)
    triangle, order = qr(M.T, mode="r", pivoting=True)
    diagonal = np.abs(np.diagonal(triangle))
    rank = int(np.count_nonzero(diagonal > _DEPENDENT * diagonal[0]))
    return np.sort(order[:rank])


def _longest(x: np.ndarray, step: np.ndarray) -> float:
    """Return the largest fraction of a step, at most 1, that leaves all entries above 0."""
    fall = float((-step / x).max(initial=0.0))
    return 1.0 if fall <= _TO_EDGE else _TO_EDGE / fall

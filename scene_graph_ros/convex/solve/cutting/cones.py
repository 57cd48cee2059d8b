"""Questions to a cone in a lift: planes beside it, points in it, how far a way leads in it.

A ball ``|w| <= t`` is behind each plane ``u . w <= t`` with ``|u| <= 1``, a semidefinite matrix M
behind each ``u' M u >= 0``. The products in the latter are exact in floats, as u has half of their
digits: what these leave out changes a plane by its square.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from scene_graph_ros.convex.solve.cones.lift import Ball, Semidefinite
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "cut_row",
    "excess",
    "first_cuts",
    "holds",
    "is_cut",
    "is_semidefinite",
    "new_cuts",
    "radius",
    "rows_are_short",
    "share_of_way",
    "shortened",
]

Cone = Ball | Semidefinite

_HALF_DIGITS = 26
"""Of a float's 53: the product of two such numbers is exact."""

_NO_PART = 2.0**-40
"""Entries of unit vectors below it are left out, so that their products don't underflow."""

_SINGULAR = 1e-14
"""Relative to the largest eigenvalue: one that is rounding."""


def radius(cone: Cone, x: np.ndarray) -> float:
    """Return the radius of a ball at a point; a matrix's has the radius 1."""
    return float(x[cone.scale]) if isinstance(cone, Ball) and cone.scale >= 0 else 1.0


def excess(cone: Cone, x: np.ndarray) -> float:
    """Return the excess of a point outside: of a matrix's eigenvalues, relative to the largest."""
    if isinstance(cone, Ball):
        return float(np.linalg.norm(x[cone.columns])) - radius(cone, x)
    values = np.linalg.eigvalsh(x[cone.columns])
    largest = float(np.abs(values).max(initial=0.0))
    return -float(values[0]) / largest if largest > 0.0 else 0.0


def shortened(u: np.ndarray) -> np.ndarray:
    """Return a vector of about unit length in half of a float's digits."""
    unit = u / np.linalg.norm(u)
    mantissas, exponents = np.frexp(np.where(np.abs(unit) < _NO_PART, 0.0, unit))
    return np.ldexp(np.rint(np.ldexp(mantissas, _HALF_DIGITS)), exponents - _HALF_DIGITS)


def _in_ball(w: np.ndarray) -> np.ndarray:
    """Return a vector of at most unit length, as exactly as floats can say."""
    u = w / np.abs(w).max()
    u /= np.linalg.norm(u)
    return u * (1.0 - 4.0 * len(u) * EPSILON)


def first_cuts(cone: Cone) -> list[np.ndarray]:
    """Return the box around a ball; planes by which all entries of a matrix are bounded."""
    size = len(cone.columns)
    units = list(np.eye(size))
    if isinstance(cone, Ball):
        return [sign * e for sign in (1.0, -1.0) for e in units]
    pairs = [(i, j) for j in range(size) for i in range(j)]
    return units + [units[i] + sign * units[j] for i, j in pairs for sign in (1.0, -1.0)]


def new_cuts(cone: Cone, x: np.ndarray, least: float = 0.0) -> list[np.ndarray]:
    """Return planes that cut off a point which is outside by more than ``least`` radii."""
    if isinstance(cone, Ball):
        is_out = excess(cone, x) > least * abs(radius(cone, x)) and x[cone.columns].any()
        return [_in_ball(x[cone.columns])] if is_out else []
    values, axes = np.linalg.eigh(x[cone.columns])
    largest = float(np.abs(values).max(initial=0.0))
    if largest == 0.0:
        return []
    return [
        shortened(v) for value, v in zip(values, axes.T, strict=True) if -value > least * largest
    ]


def cut_row(cone: Cone, u: np.ndarray, num_variables: int) -> tuple[np.ndarray, float]:
    """Return a plane as a row ``(num_variables,)`` and its right side."""
    row = np.zeros(num_variables)
    if isinstance(cone, Semidefinite):
        i, j = np.triu_indices(len(u))
        row[cone.columns[i, j]] = -np.where(i == j, 1.0, 2.0) * u[i] * u[j]
        return row, 0.0
    row[cone.columns] = u
    if cone.scale < 0:
        return row, 1.0
    row[cone.scale] = -1.0
    return row, 0.0


def is_cut(cone: Cone, u: np.ndarray) -> bool:
    """Tell whether a plane has the whole cone behind it, exactly as `cut_row` has it."""
    if isinstance(cone, Ball):
        return sum(Fraction(v) ** 2 for v in u.tolist()) <= 1
    return rows_are_short(u)


def rows_are_short(u: np.ndarray) -> bool:
    """Tell whether the products of a vector's entries are exact in floats."""
    entries = u.tolist()
    return all(Fraction(v) * Fraction(w) == Fraction(v * w) for v in entries for w in entries)


def holds(cone: Cone, x: Sequence[Fraction]) -> bool:
    """Tell whether a point of fractions is in a cone."""
    if isinstance(cone, Semidefinite):
        return is_semidefinite([[x[k] for k in row] for row in cone.columns.tolist()])
    reach = Fraction(1) if cone.scale < 0 else x[cone.scale]
    return reach >= 0 and sum(x[k] ** 2 for k in cone.columns) <= reach**2


def is_semidefinite(matrix: Sequence[Sequence[Fraction]]) -> bool:
    """Tell whether a symmetric matrix of fractions has no negative eigenvalue, by elimination."""
    rows = [list(row) for row in matrix]
    for k in range(len(rows)):
        pivot = rows[k][k]
        if pivot < 0 or (pivot == 0 and any(rows[k][k + 1 :])):
            return False
        for i in range(k + 1, len(rows)):
            if rows[i][k]:
                factor = rows[i][k] / pivot
                for j in range(k + 1, len(rows)):
                    rows[i][j] -= factor * rows[k][j]
    return True


def share_of_way(cone: Cone, inner: np.ndarray, outer: np.ndarray) -> float:
    """Return the share of the way to an outer point at which a cone ends, 1 where it doesn't."""
    if isinstance(cone, Semidefinite):
        return _share_in_matrix(inner[cone.columns], (outer - inner)[cone.columns])
    w, dw = inner[cone.columns], (outer - inner)[cone.columns]
    r = 1.0 if cone.scale < 0 else inner[cone.scale]
    dr = 0.0 if cone.scale < 0 else (outer - inner)[cone.scale]
    # |w + s dw|^2 = (r + s dr)^2, whose constant term is negative.
    a, b, c = dw @ dw - dr * dr, dw @ w - dr * r, w @ w - r * r
    if a <= 0.0 and b <= 0.0:
        return 1.0
    root = b * b - a * c
    if root < 0.0:
        return 1.0
    root = np.sqrt(root)
    if b == root == 0.0:
        return 0.0  # from the tip of a cone it leads out at once
    at = -c / (b + root) if b >= 0.0 else (root - b) / a
    return min(1.0, float(at)) if at >= 0.0 else 1.0


def _share_in_matrix(inner: np.ndarray, way: np.ndarray) -> float:
    """Return the largest s up to 1 for which ``inner + s way`` is semidefinite."""
    values, axes = np.linalg.eigh(inner)
    kept = values > _SINGULAR * max(float(values[-1]), 0.0)
    away = axes[:, ~kept].T @ way @ axes[:, ~kept]
    if away.size and np.linalg.eigvalsh(away)[0] < 0.0:
        return 0.0
    scaled = axes[:, kept] / np.sqrt(values[kept])
    least = float(np.linalg.eigvalsh(scaled.T @ way @ scaled)[0]) if kept.any() else 0.0
    return min(1.0, -1.0 / least) if least < 0.0 else 1.0

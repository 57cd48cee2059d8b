"""The largest affine image of a polyhedron inside another, of symmetric semidefinite maps."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.questions.conic_program import ConicProgram, ConicSolution
from scene_graph_ros.convex.questions.ellipsoids import inscribed
from scene_graph_ros.convex.questions.extents import bounds_of
from scene_graph_ros.convex.solve.exact.feasibility import find_deepest
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["largest_image"]

_OFF = 1e-6
"""Of sets of a size of 1: by how much more a solution's constraints may be broken, and its log det
be below the bound of its multipliers, it is none."""

_ROUGH = 0.1
"""What the logarithms of the volumes of ellipsoids may be off by, where these are a guess."""

_FLAT = 1e-9
"""Relative to the largest: an eigenvalue of the map below it makes the image flat."""


def largest_image(inner: Any, outer: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return T ``(n, n)``, t ``(n,)`` with the most ``log det T`` and ``T X + t`` in Y.

    T is symmetric and semidefinite. Where the solver fails, it is asked again in coordinates in
    which T is about 1. X reaches along ``T c`` no further than ``b . y`` for weights
    ``y >= 0`` of its rows with ``A' y = T c``, one vector for each row c of Y (Sadraddini and
    Tedrake, "Linear encodings for polytope containment problems", 2019, lemma 1). Then the image
    is drawn together about a point of Y until it is inside without tolerance.
    """
    label = "HPolyhedron.maximum_volume_inscribed_affine_transformation"
    for name, each in (("the set", inner), ("circumbody", outer)):
        if each.is_empty() or not each.is_bounded():
            raise ConvexSetError(f"{label}: {name} must be bounded and have a point")
        bounds = bounds_of(each)
        size = 0.0 if bounds is None else float(np.linalg.norm(bounds[1] - bounds[0]))
        if not find_deepest(each.lifted.rows).radius > _FLAT * size:
            raise ConvexSetError(
                f"{label}: {name} is flat; work in the coordinates of its AffineSubspace"
            )
    if not inner.ambient_dimension:
        return np.zeros((0, 0)), np.zeros(0)
    (X, from_X, scale_X), (Y, from_Y, scale_Y) = _about_own_middle(inner), _about_own_middle(outer)
    try:
        W = np.eye(len(from_X))
        T, t = _largest(X, Y, label)
    except SolverError:
        W = _guess(inscribed(inner, _ROUGH).B / scale_X, inscribed(outer, _ROUGH).B / scale_Y)
        T, t = _largest(_mapped(X, W), _mapped(Y, np.linalg.inv(W)), label)
    values = np.linalg.eigvalsh(T)
    if not values[0] > _FLAT * values[-1]:
        raise ConvexSetError(
            f"{label}: the image is flat, with eigenvalues {values.tolist()}; work in the"
            " coordinates of the circumbody's AffineSubspace"
        )
    T = W @ T @ W * (scale_Y / scale_X)
    t = from_Y + scale_Y * (W @ t) - T @ from_X
    return _drawn_inside(inner, outer, T, t)


def _about_own_middle(of: Any) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray, float]:
    """Return unit rows about the middle of a set's box, as large as 1, the middle and the size."""
    bounds = bounds_of(of)
    assert bounds is not None, "only what is bounded and not empty comes here"
    middle, size = 0.5 * (bounds[0] + bounds[1]), 0.5 * float((bounds[1] - bounds[0]).max())
    size = size or 1.0
    lengths = np.linalg.norm(of.A, axis=1)
    named = lengths > 0.0
    A = of.A[named] / lengths[named, None]
    return (A, (of.b[named] / lengths[named] - A @ middle) / size), middle, size


def _largest(X: Any, Y: Any, label: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the map of one set's rows into another's. Raises SolverError."""
    solution, T, t, mean = _solve(X, Y)
    if not solution.is_feasible:
        raise SolverError(f"{label}: no image was found; the sets may be flat")
    # As log det is n times the logarithm of the mean.
    below = len(t) * solution.gap / max(float(solution.values[mean]), 1e-300)
    if not max(solution.violation, below) <= _OFF:
        raise SolverError(
            f"{label}: the largest image was not found: constraints are broken by"
            f" {solution.violation:.1e}, and log det may be {below:.1e} below the most;"
            f" {_OFF:g} are accepted"
        )
    return solution.value(T), solution.value(t)


def _guess(B_X: np.ndarray, B_Y: np.ndarray) -> np.ndarray:
    """Return the symmetric root W of the map from one ellipsoid to another, ``B u`` of |u| <= 1.

    The map is symmetric and positive, as the one that is sought (Olkin and Pukelsheim, "The
    distance between two random vectors with given dispersion matrices", 1982). From W X to the
    inverse of W times Y it is about 1, however thin these are: ``T = W T' W``.
    """
    root = _root(B_X @ B_X.T)
    back = np.linalg.inv(root)
    return _root(back @ _root(root @ B_Y @ B_Y.T @ root) @ back)


def _root(of: np.ndarray) -> np.ndarray:
    values, axes = np.linalg.eigh(0.5 * (of + of.T))
    return (axes * np.sqrt(np.maximum(values, EPSILON**2 * values[-1]))) @ axes.T


def _mapped(rows: Any, W: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit rows of ``W x`` for all x with ``A x <= b``."""
    A, b = rows
    A = A @ np.linalg.inv(W)
    lengths = np.linalg.norm(A, axis=1)
    return A / lengths[:, None], b / lengths


def _solve(X: Any, Y: Any) -> tuple[ConicSolution, np.ndarray, np.ndarray, int]:
    """Solve the program, with ``[[T, Z], [Z', diag Z]]`` semidefinite and Z lower triangular.

    Then det T is at least the product of Z's diagonal, whose geometric mean is the variable that
    is made large; by logarithms, which are exponential cones, the solver often loses its way.
    """
    (A, b), (C, d) = X, Y
    m, n = A.shape
    program = ConicProgram()
    T, t = program.add_symmetric_matrix(n), program.add_variables(n)
    whole = program.add_symmetric_matrix(2 * n)
    program.add_semidefinite_matrix(whole)
    corner = whole[:n, :n]
    upper = np.triu_indices(n)
    same = np.concatenate([np.eye(len(upper[0])), -np.eye(len(upper[0]))], axis=1)
    program.add_linear_equations(
        same, np.zeros(len(same)), np.concatenate([corner[upper], T[upper]])
    )
    Z, last = whole[:n, n:], whole[n:, n:]
    zeros = np.concatenate([Z[np.triu_indices(n, 1)], last[np.triu_indices(n, 1)]])
    program.add_linear_equations(np.eye(len(zeros)), np.zeros(len(zeros)), zeros)
    for k in range(n):
        program.add_linear_equations([[1.0, -1.0]], [0.0], [last[k, k], Z[k, k]])
    mean = _geometric_mean(program, [int(Z[k, k]) for k in range(n)])
    for c, side in zip(C, d, strict=True):
        weights = program.add_variables(m)
        program.add_linear_inequalities(-np.eye(m), np.zeros(m), weights)
        for k in range(n):
            program.add_linear_equations(
                np.append(A[:, k], -c)[None], [0.0], np.append(weights, T[k])
            )
        program.add_linear_inequalities(np.append(b, c)[None], [side], np.append(weights, t))
    program.add_linear_cost([-1.0], [mean])
    return program.solve(), T, t, mean


def _geometric_mean(program: ConicProgram, values: list[int]) -> int:
    """Return a variable that is no larger than the geometric mean of some, which are at least 0.

    By means of two, as many as a power of two with the mean itself (Alizadeh and Goldfarb,
    "Second-order cone programming", 2003, section 2.3).
    """
    if len(values) == 1:
        return values[0]
    mean = int(program.add_variables(1)[0])
    level = values + [mean] * ((1 << (len(values) - 1).bit_length()) - len(values))
    # |(2 w, u - v)| <= u + v is w^2 <= u v.
    rows = np.array([[0.0, 1.0, 1.0], [2.0, 0.0, 0.0], [0.0, 1.0, -1.0]])
    while len(level) > 1:
        above = []
        for u, v in zip(level[::2], level[1::2], strict=True):
            if u == v:
                above.append(u)
                continue
            w = mean if len(level) == 2 else int(program.add_variables(1)[0])
            program.add_second_order_cone(rows, np.zeros(3), [w, u, v])
            above.append(w)
        level = above
    return mean


def _drawn_inside(
    inner: Any, outer: Any, T: np.ndarray, t: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Draw an image together about the deepest point of a polyhedron until it is inside."""
    center = outer.chebyshev_center()
    reached = [inner.support(T @ row) for row in outer.A]
    reach = outer.A @ t + [each.value + each.gap for each in reached]
    size = np.abs(outer.A) @ (np.abs(t) + np.abs(center)) + np.abs(outer.b) + np.abs(reach)
    rounding = 16.0 * (len(t) + 2) * EPSILON * size
    slack, over = outer.b - outer.A @ center, reach + rounding - outer.b
    is_over = over > 0.0
    share = float((over[is_over] / (slack + over)[is_over]).max(initial=0.0))
    return (1.0 - share) * T, center + (1.0 - share) * (t - center)

"""The largest affine image of a polyhedron inside another, of symmetric semidefinite maps."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.geometry.optimization.errors import ConvexSetError, SolverError
from scene_graph_ros.geometry.optimization.sets.conic_program import ConicProgram, ConicSolution
from scene_graph_ros.geometry.optimization.sets.extents import bounds_of
from scene_graph_ros.geometry.optimization.solve.feasibility import find_deepest
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["largest_image"]

_OFF = 1e-6
"""Of sets of a size of 1: by how much more a solution's constraints may be broken, and its log det
be below the bound of its multipliers, it is none."""

_FLAT = 1e-9
"""Relative to the largest: an eigenvalue of the map below it makes the image flat."""


def largest_image(inner: Any, outer: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return T ``(n, n)``, t ``(n,)`` with the most ``log det T`` and ``T X + t`` in Y.

    T is symmetric and semidefinite. X reaches along ``T c`` no further than ``b . y`` for weights
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
    (X, from_X, scale_X), (Y, from_Y, scale_Y) = _about_own_middle(inner), _about_own_middle(outer)
    solution, T_index, t_index = _solve(X, Y)
    if not solution.is_feasible:
        raise SolverError(f"{label}: no image was found; the sets may be flat")
    if not max(solution.violation, solution.gap) <= _OFF:
        raise SolverError(
            f"{label}: the largest image was not found: constraints are broken by"
            f" {solution.violation:.1e}, and log det may be {solution.gap:.1e} below the most;"
            f" {_OFF:g} are accepted"
        )
    T, t = solution.value(T_index), solution.value(t_index)
    values = np.linalg.eigvalsh(T)
    if not values[0] > _FLAT * values[-1]:
        raise ConvexSetError(
            f"{label}: the image is flat, with eigenvalues {values.tolist()}; work in the"
            " coordinates of the circumbody's AffineSubspace"
        )
    T = T * (scale_Y / scale_X)
    t = from_Y + scale_Y * t - T @ from_X
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


def _solve(X: Any, Y: Any) -> tuple[ConicSolution, np.ndarray, np.ndarray]:
    """Solve the program, with ``[[T, Z], [Z', diag Z]]`` semidefinite and Z lower triangular."""
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
    logs = program.add_variables(n)
    for k in range(n):
        program.add_linear_equations([[1.0, -1.0]], [0.0], [last[k, k], Z[k, k]])
        row, unit = np.eye(3)[:, [0, 2]], np.array([0.0, 1.0, 0.0])
        program.add_exponential_cone(row, unit, [logs[k], Z[k, k]])
    for c, side in zip(C, d, strict=True):
        weights = program.add_variables(m)
        program.add_linear_inequalities(-np.eye(m), np.zeros(m), weights)
        for k in range(n):
            program.add_linear_equations(
                np.append(A[:, k], -c)[None], [0.0], np.append(weights, T[k])
            )
        program.add_linear_inequalities(np.append(b, c)[None], [side], np.append(weights, t))
    program.add_linear_cost(-np.ones(n), logs)
    return program.solve(), T, t


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
    share = float(np.max(over / (slack + over), where=over > 0.0, initial=0.0))
    return (1.0 - share) * T, center + (1.0 - share) * (t - center)

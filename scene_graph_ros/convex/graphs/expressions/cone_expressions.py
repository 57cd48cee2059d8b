"""Constraints of vertices' points by cones, and the costs that lead to such cones."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.expressions.expressions import (
    Affine,
    Atom,
    checked_vector,
    Constraint,
    Cost,
    stacked,
)
from scene_graph_ros.convex.questions.conic_program import as_symmetric, triangle_of
from scene_graph_ros.convex.solve.cones.cone_program import Cone
from scene_graph_ros.geometry.quoting import quoted

__all__ = [
    "exp",
    "exponential_cone",
    "positive_semidefinite",
    "quad_over_lin",
    "rotated_second_order_cone",
    "second_order_cone",
]


def second_order_cone(vector: Affine) -> Constraint:
    """Return the constraint that the first entry is no shorter than all the others together."""
    rows = _of_size(vector, "second_order_cone", 1)
    return Constraint(rows, False, Cone.SECOND_ORDER)


def rotated_second_order_cone(vector: Affine) -> Constraint:
    """Return the constraint that ``w[0] w[1] >= |w[2:]|^2`` with both factors at least 0."""
    w = _of_size(vector, "rotated_second_order_cone", 2)
    rows = stacked([w[0] + w[1], w[0] - w[1], 2.0 * w[2:]])
    return Constraint(rows, False, Cone.SECOND_ORDER)


def exponential_cone(vector: Affine) -> Constraint:
    """Return the constraint that ``(u, v, w)`` have ``v exp(u / v) <= w`` and ``v >= 0``.

    For v = 0 that is ``u <= 0 <= w``; the entries are those of `ConicProgram`'s.
    """
    w = _of_size(vector, "exponential_cone", 3, 3)
    return Constraint(w, False, Cone.EXPONENTIAL)


def positive_semidefinite(F: Any, vector: Affine) -> Constraint:
    """Return the constraint that ``F[0] + x[0] F[1] + x[1] F[2] + ...`` has no eigenvalue below 0.

    ``F (k + 1, N, N)`` are symmetric matrices, x an expression of k entries. Raises
    ConvexSetError for other matrices.
    """
    x = checked_vector(vector, "positive_semidefinite")
    matrices = as_symmetric(F, "positive_semidefinite: F", len(x) + 1)
    rows = np.array([triangle_of(each) for each in matrices])
    return Constraint(rows[1:].T @ x + rows[0], False, Cone.SEMIDEFINITE)


def quad_over_lin(vector: Affine, divisor: Affine) -> Cost:
    """Return ``|vector|^2 / divisor``: infinite where the divisor, a number, is not above 0.

    Where both are 0 it is 0. It is convex: so is the energy of a step in a time.
    """
    w, s = (checked_vector(each, "quad_over_lin") for each in (vector, divisor))
    if len(s) != 1:
        raise ConvexSetError(f"quad_over_lin: divisor must be a number, not {len(s)} entries")
    return Cost((Atom("quotient", stacked([s, w])),), _NO_REST)


def exp(vector: Affine) -> Cost:
    """Return the sum of the exponentials of all entries."""
    w = checked_vector(vector, "exp")
    return Cost(tuple(Atom("exponential", w[k : k + 1]) for k in range(len(w))), _NO_REST)


_NO_REST = Affine({}, np.zeros(1), True)


def _of_size(vector: Any, name: str, least: int, most: int | None = None) -> Affine:
    checked = checked_vector(vector, name)
    if len(checked) < least or (most is not None and len(checked) > most):
        wanted = f"{least} entries" if most == least else f"at least {least} entries"
        raise ConvexSetError(f"{name} takes {wanted}, not {len(checked)}, of {quoted(vector)}")
    return checked

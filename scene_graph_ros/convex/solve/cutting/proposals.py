"""Proposals of the solver of cone programs for a lift: a point, and planes that bound it.

Nothing of it is taken for an answer: points and planes are where exact methods begin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.solve.cones.blocks import (
    blocks_of,
    for_the_solver,
    upper_triangle,
)
from scene_graph_ros.convex.solve.cones.cone_program import Cone, ConeProgram
from scene_graph_ros.convex.solve.cones.equilibration import equilibrated, widened
from scene_graph_ros.convex.solve.cones.lift import Lift, Semidefinite

__all__ = ["Proposal", "propose"]

_LEAST_WEIGHT = 1e-12
"""Relative to the largest: eigenvectors of multipliers with less are rounding."""

_DEEPEST = 1.0
"""By how much a program of size 1 is narrowed at most where no goal is given."""


@dataclass(frozen=True)
class Proposal:
    """A point ``x (k,)`` of a lift's variables; planes of matrices: a cone's number, a vector."""

    x: np.ndarray
    planes: list[tuple[int, np.ndarray]]


def propose(lift: Lift, c: np.ndarray | None, about: np.ndarray | None = None) -> Proposal | None:
    """Return the point of largest ``c . x``, without c that furthest from rows and cones.

    The solver's origin is the point ``about (k,)``, so that far points keep their digits.
    None where the solver fails, also for goals without a largest value.
    """
    size = lift.num_variables
    origin = np.zeros(size) if about is None else about
    blocks = [
        (cone, k, matrix, side + matrix @ origin[k])
        for cone, k, matrix, side in blocks_of(lift, np.arange(size))
    ]
    program = ConeProgram(size)
    for cone, columns, matrix, side in map(for_the_solver, blocks):
        program.add_rows(cone, [(columns, matrix)], side)
    if c is not None:
        program.add_cost(np.arange(size), -c)
    scaled = equilibrated(program)
    asked = scaled.program if c is not None else widened(scaled.program, _DEEPEST)
    try:
        found = asked.solve("a convex set of matrices", is_rough=True)
    except SolverError:
        return None
    if not found.is_feasible:
        return None
    of_matrices = [a.rows for a in program.added if a.rows.cone is Cone.SEMIDEFINITE]
    numbers = [k for k, cone in enumerate(lift.cones) if isinstance(cone, Semidefinite)]
    planes = []
    for number, each in zip(numbers, of_matrices, strict=True):
        multipliers = _matrix(found.dual(each))
        weights, axes = np.linalg.eigh(multipliers)
        kept = weights > _LEAST_WEIGHT * max(float(weights[-1]), 0.0)
        planes += [(number, axis) for axis in axes.T[kept]]
    return Proposal(origin + scaled.sizes * found.x[:size], planes)


def _matrix(dual: np.ndarray) -> np.ndarray:
    """Return a symmetric matrix of its upper triangle with the root of 2 beside the diagonal."""
    order = int(np.sqrt(2 * len(dual)))
    i, j = upper_triangle(order)
    matrix = np.zeros((order, order))
    matrix[i, j] = matrix[j, i] = dual / np.where(i == j, 1.0, np.sqrt(2.0))
    return matrix

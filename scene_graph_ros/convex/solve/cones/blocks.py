"""Blocks of rows in cones: the parts of lifts for the solver of cone programs."""

from __future__ import annotations

import math

import numpy as np

from scene_graph_ros.convex.solve.cones.lift import Lift
from scene_graph_ros.convex.solve.cones.standard_form import Cone

__all__ = ["Block", "blocks_of", "for_the_solver", "upper_triangle"]

Block = tuple[Cone, np.ndarray, np.ndarray, np.ndarray]
"""A cone, columns ``(k,)``, a matrix ``(m, k)`` and a constant ``(m,)``.

Rows of semidefinite matrices are their upper triangle, column after column."""


def upper_triangle(order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows and columns of a matrix's upper triangle, column after column."""
    j, i = np.tril_indices(order)
    return i, j


def for_the_solver(block: Block) -> Block:
    """Return a block with off-diagonal entries of matrices times the root of 2."""
    cone, columns, matrix, constant = block
    if cone is not Cone.SEMIDEFINITE:
        return block
    i, j = upper_triangle(math.isqrt(2 * len(constant)))
    factors = np.where(i == j, 1.0, math.sqrt(2.0))
    return cone, columns, matrix * factors[:, None], constant * factors


def blocks_of(lift: Lift, z: np.ndarray, scale: int | None = None) -> list[Block]:
    """Return all rows and cones of a lift in variables ``z``, or of a multiple of it.

    The ``scale`` is a variable which is at least 0, by which all constants are multiplied.
    """
    found: list[Block] = []
    for cone, matrix, side in ((Cone.ZERO, lift.E, -lift.f), (Cone.NONNEGATIVE, -lift.A, lift.b)):
        if not len(side):
            continue
        if scale is None:
            found.append((cone, z, matrix, side))
        else:
            both = np.column_stack([matrix, side])
            found.append((cone, np.append(z, scale), both, np.zeros(len(side))))
    if scale is not None:
        found.append((Cone.NONNEGATIVE, np.array([scale]), np.ones((1, 1)), np.zeros(1)))
    for ball in lift.balls:
        size = len(ball.columns)
        matrix, constant = np.zeros((size + 1, size + 1)), np.zeros(size + 1)
        matrix[1:, :size] = np.eye(size)
        reach = int(z[ball.scale]) if ball.scale >= 0 else scale
        columns = z[ball.columns]
        if reach is None:
            constant[0], matrix = 1.0, matrix[:, :size]
        else:
            matrix[0, size], columns = 1.0, np.append(columns, reach)
        found.append((Cone.SECOND_ORDER, columns, matrix, constant))
    for block in lift.matrices:
        upper = z[block.columns[upper_triangle(len(block.columns))]]
        found.append((Cone.SEMIDEFINITE, upper, np.eye(len(upper)), np.zeros(len(upper))))
    return found

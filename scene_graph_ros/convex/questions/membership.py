"""Points of sets, and of their nonnegative multiples, as constraints of a program over cones.

A set is its lift's part of some more variables; a multiple t of it the part where all
constants of the lift are multiplied by t. At t = 0 these are the ways in which the set goes on for
ever (Rockafellar, Convex Analysis, 1970, theorem 8.2).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import as_matrix, as_vector
from scene_graph_ros.convex.questions.conic_program import ConicConstraint, ConicProgram
from scene_graph_ros.convex.solve.cones.blocks import blocks_of
from scene_graph_ros.convex.solve.cones.lift import Lift
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float

__all__ = ["Membership", "add_point_in_nonnegative_scaling", "add_point_in_set"]


@one_line()
class Membership(NamedTuple):
    """The additions to a program: further variables ``(e,)``, of any meaning, and constraints."""

    new_variables: np.ndarray
    new_constraints: list[ConicConstraint]


def add_point_in_set(asked: Any, program: ConicProgram, x: Any) -> Membership:
    """Ask that variables ``x (n,)`` are a point of a set."""
    label = f"{type(asked).__name__}.add_point_in_set_constraints"
    _check(asked, program, label)
    point = program.as_variables(x, f"{label}: x", asked.ambient_dimension)
    return _add_lift(asked.lifted, program, point, None)


def add_point_in_nonnegative_scaling(
    asked: Any, program: ConicProgram, form: tuple[Any, ...]
) -> list[ConicConstraint]:
    """Ask that ``x`` is in ``t`` times a set, or ``A x + b`` in ``c . t + d`` times it."""
    label = f"{type(asked).__name__}.add_point_in_nonnegative_scaling_constraints"
    _check(asked, program, label)
    n = asked.ambient_dimension
    if len(form) == 2:
        point = program.as_variables(form[0], f"{label}: x", n)
        scale = program.as_variables(form[1], f"{label}: t", 1)
        return _add_lift(asked.lifted, program, point, int(scale[0])).new_constraints
    if len(form) != 6:
        raise ConvexSetError(
            f"{label}: takes (program, x, t) or (program, A, b, c, d, x, t), not {len(form) + 1}"
            " arguments"
        )
    A, b, c, d, x, t = form
    numbers = program.as_variables(x, f"{label}: x")
    scales = program.as_variables(t, f"{label}: t")
    matrix = as_matrix(A, f"{label}: A", len(numbers))
    side = as_vector(b, f"{label}: b", n)
    if len(matrix) != n:
        raise ConvexSetError(f"{label}: A must have the shape ({n}, k), not {matrix.shape}")
    rates, offset = as_vector(c, f"{label}: c", len(scales)), as_float(d)
    if offset is None or not np.isfinite(offset):
        raise ConvexSetError(f"{label}: d must be a finite number, not {quoted(d)}")
    point, scale = program.add_variables(n), program.add_variables(1)
    links = [
        program.add_linear_equations(
            np.concatenate([matrix, -np.eye(n)], axis=1), -side, np.append(numbers, point)
        ),
        program.add_linear_equations(
            np.append(rates, -1.0)[None], [-offset], np.append(scales, scale)
        ),
    ]
    return links + _add_lift(asked.lifted, program, point, int(scale[0])).new_constraints


def _check(asked: Any, program: Any, label: str) -> None:
    if not isinstance(program, ConicProgram):
        raise ConvexSetError(f"{label}: program must be a ConicProgram, not {quoted(program)}")
    if asked.ambient_dimension == 0:
        raise ConvexSetError(f"{label}: the set has no dimensions, and no points to constrain")


def _add_lift(
    lift: Lift, program: ConicProgram, point: np.ndarray, scale: int | None
) -> Membership:
    """Ask for all rows and cones of a lift, of a multiple of it where there is a scale."""
    more = program.add_variables(lift.num_variables - len(point))
    z = np.concatenate([point, more])
    added = [
        program.add_constraint(cone, matrix, constant, columns)
        for cone, columns, matrix, constant in blocks_of(lift, z, scale)
    ]
    return Membership(more, added)

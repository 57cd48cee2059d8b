"""Expressions that stand for those of each vertex or edge of a subgraph."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
import itertools
from typing import Any

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.expressions.expressions import (
    Affine,
    as_cost,
    Atom,
    Constraint,
    Cost,
)
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.gcs.segment_variables import SegmentVariables

__all__ = ["Placeholders", "new_placeholder", "placed_constraint", "placed_cost"]

_numbers = itertools.count(-1, -1)

Placeholders = Mapping[int, int]
"""The numbers of vertices that are meant, by what stands for them."""


def new_placeholder() -> int:
    """Return a number to stand for a vertex, whose numbers are 0 and above; no other is the same.

    So expressions of one subgraph are told from those of another.
    """
    return next(_numbers)


def control_points(variables: SegmentVariables, key: int) -> tuple[Affine, ...]:
    """Return all control points ``(n,)`` as expressions."""
    return tuple(variables.path(key, i) for i in range(variables.order + 1))


def duration(variables: SegmentVariables, key: int, label: str) -> Affine:
    """Return the duration. Raises ConvexSetError where segments take no time."""
    if not variables.has_duration:
        raise ConvexSetError(f"{label}: regions of order 0 without h_min and h_max take no time")
    return variables.time(key)


def _placed(of: Affine, meant: Placeholders, label: str) -> Affine:
    unknown = [key for key in of.terms if key not in meant]
    if unknown:
        whose = f"vertex {unknown[0]}" if unknown[0] >= 0 else "another subgraph or its edges"
        raise ConvexSetError(
            f"{label}: the expression must be of this subgraph's own control points and durations;"
            f" it has those of {whose}"
        )
    return Affine({meant[key]: m for key, m in of.terms.items()}, of.constant, of.is_number)


def placed_cost(cost: Any, meant: Placeholders, label: str) -> Cost:
    """Return a cost of the vertices that are meant. Raises ConvexSetError for others."""
    checked = as_cost(cost, label)
    atoms = tuple(Atom(each.kind, _placed(each.of, meant, label)) for each in checked.atoms)
    return Cost(atoms, _placed(checked.rest, meant, label))


def placed_constraint(constraint: Any, meant: Placeholders, label: str) -> Constraint:
    """Return a constraint of the vertices that are meant. Raises ConvexSetError for others."""
    if not isinstance(constraint, Constraint):
        raise ConvexSetError(
            f"{label} must be made by ==, <= or >= of expressions, not {quoted(constraint)}"
        )
    return replace(constraint, rows=_placed(constraint.rows, meant, label))

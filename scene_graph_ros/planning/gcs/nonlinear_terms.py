"""Bounds of derivatives of q(t): no convex sets of control points and durations.

Derivatives are ``r^(N)(s) / h^N``. Along a path they are kept as functions of its points; the
relaxation has convex surrogates, in which durations are taken to be 1 (von Wrangel and Tedrake,
"Using graphs of convex sets to guide nonconvex trajectory optimization", 2024).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from scene_graph_ros.convex.graphs.expressions.expressions import Affine, Constraint
from scene_graph_ros.convex.graphs.expressions.functions import PointProduct, WrittenConstraint
from scene_graph_ros.convex.graphs.expressions.transcription import (
    ALL_TRANSCRIPTIONS,
    Transcription,
)
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.planning.gcs.segment_variables import SegmentVariables

__all__ = ["Place", "bound_derivative", "continue_derivative", "continue_path_derivative"]

_ROOM = 1e-6
"""Relative: by so much bounds are narrower for the solver, whose points are off by rounding."""

Place = tuple[SegmentVariables, Sequence[int], int]
"""A segment, which control points of a derivative, and the number of the vertex."""


def _map(variables: SegmentVariables, index: int, order: int) -> np.ndarray:
    """Return the matrix ``(n, size)`` from coordinates to a control point of a derivative of r."""
    matrix: np.ndarray = variables.path(0, index, order).terms[0]
    return matrix


def continue_path_derivative(
    edge: Edge,
    first: SegmentVariables,
    second: SegmentVariables,
    order: int,
    used: Iterable[Transcription] | Transcription = ALL_TRANSCRIPTIONS,
) -> Constraint:
    """Have a derivative of r(s) go on from one segment to the next; return the constraint."""
    end = first.path(edge.u.id, first.order - order, order)
    constraint: Constraint = end == second.path(edge.v.id, 0, order)
    edge.add_constraint(constraint, used)
    return constraint


def continue_derivative(
    edge: Edge, first: SegmentVariables, second: SegmentVariables, order: int
) -> WrittenConstraint:
    """Have a derivative of q(t) go on from one segment to the next; return the restriction's."""
    end, start = _map(first, first.order - order, order), _map(second, 0, order)
    continue_path_derivative(edge, first, second, order, Transcription.RELAXATION)

    def off(xu: Any, xv: Any) -> Any:
        # Times powers of both durations, by their mean: they may be as short as they like.
        hu, hv = xu[-1], xv[-1]
        both = 0.5 * (hu + hv)
        return (end @ xu) * (hv / both) ** order - (start @ xv) * (hu / both) ** order

    zero = np.zeros(first.num_positions)
    products = PointProduct(end, zero, 0, 1, order), PointProduct(-start, zero, 1, 0, order)
    constraint = WrittenConstraint(off, products, is_equal=True)
    edge.add_constraint(constraint, Transcription.RESTRICTION)
    return constraint


def bound_derivative(
    to: Vertex | Edge, place: Place, low: np.ndarray, high: np.ndarray, order: int
) -> None:
    """Have ``low <= q^(order) <= high`` ``(n,)`` at control points, of a vertex or an edge."""
    variables, indices, key = place
    room = _ROOM * np.where(np.isfinite(high - low), high - low, 0.0)
    is_first = isinstance(to, Vertex) or key == to.u.id
    rates = [_map(variables, index, order) for index in indices]

    def bound(sides: Sequence[tuple[np.ndarray, float]], is_asked: np.ndarray) -> None:
        """Ask that derivatives are at most, or, of one side, that they are what it says."""
        is_equal = len(sides) == 1
        asked = [(side, sign, is_asked & np.isfinite(side)) for side, sign in sides]
        rows = np.concatenate([sign * rate[at] for rate in rates for _, sign, at in asked])
        most = np.concatenate([sign * side[at] for _ in rates for side, sign, at in asked])
        if not len(most):
            return
        of_path, of_time = Affine({key: rows}, np.zeros(len(most))), variables.time(key)
        if is_equal and not most.any():
            to.add_constraint(of_path == 0.0)  # However long it takes.
            return
        linear = most[:, None] @ of_time
        surrogate = of_path == linear if is_equal else of_path <= linear
        to.add_constraint(surrogate, Transcription.RELAXATION)

        def kept(*points: Any) -> Any:
            x = points[0] if is_first else points[1]
            return most * x[-1] ** order - rows @ x

        at, zero = (0 if is_first else 1), np.zeros(len(most))
        products = (
            PointProduct(np.zeros_like(rows), most, at, at, order),
            PointProduct(-rows, zero, at, at, 0),
        )
        constraint = WrittenConstraint(kept, products, is_equal=is_equal)
        to.add_constraint(constraint, Transcription.RESTRICTION)

    # Between two bounds that are one there is no room: what is to be that is an equation.
    is_one, is_zero = low == high, (low == 0.0) & (high == 0.0)
    bound([(high - room, 1.0), (low + room, -1.0)], ~is_one)
    bound([(high, 1.0)], is_one & ~is_zero)
    bound([(high, 1.0)], is_zero)

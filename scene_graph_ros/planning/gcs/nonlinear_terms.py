"""Bounds of derivatives of q(t): no convex sets of control points and durations.

Derivatives are ``r^(N)(s) / h^N``. Along a path they are kept as functions of its points; the
relaxation has convex surrogates, in which durations are taken to be 1 (von Wrangel and Tedrake,
"Using graphs of convex sets to guide nonconvex trajectory optimization", 2024).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from scene_graph_ros.convex.graphs.expressions.expressions import Constraint
from scene_graph_ros.convex.graphs.expressions.functions import WrittenConstraint
from scene_graph_ros.convex.graphs.expressions.transcription import (
    ALL_TRANSCRIPTIONS,
    Transcription,
)
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.planning.gcs.segment_variables import SegmentVariables

__all__ = ["Place", "bound_derivative", "continue_derivative", "continue_path_derivative"]

_ROOM = 1e-6
"""Relative: by so much bounds are narrower for the solver, whose points are off by rounding."""

Place = tuple[SegmentVariables, int, int]
"""A segment, which control point of a derivative, and the number of the vertex."""


def _of(variables: SegmentVariables, index: int, order: int, x: Any) -> Any:
    """Return a control point ``(n,)`` of a derivative of r, of coordinates or expressions."""
    return variables.path(0, index, order).terms[0] @ x


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
    last = first.order - order
    continue_path_derivative(edge, first, second, order, Transcription.RELAXATION)

    def off(xu: Any, xv: Any) -> Any:
        # Times powers of both durations, by their mean: they may be as short as they like.
        hu, hv = xu[-1], xv[-1]
        both = 0.5 * (hu + hv)
        before, after = _of(first, last, order, xu), _of(second, 0, order, xv)
        return before * (hv / both) ** order - after * (hu / both) ** order

    zero = np.zeros(first.num_positions)
    constraint = WrittenConstraint(off, zero, zero)
    edge.add_constraint(constraint, Transcription.RESTRICTION)
    return constraint


def bound_derivative(
    to: Vertex | Edge, place: Place, low: np.ndarray, high: np.ndarray, order: int
) -> None:
    """Have ``low <= q^(order) <= high`` ``(n,)`` at a control point, of a vertex or an edge."""
    variables, index, key = place
    rate, h = variables.path(key, index, order), variables.time(key)
    room = _ROOM * np.where(np.isfinite(high - low), high - low, 0.0)
    for bound, sign in ((high - room, 1.0), (low + room, -1.0)):
        rows = np.flatnonzero(np.isfinite(bound))
        if not len(rows):
            continue
        limit = (sign * bound[rows])[:, None]
        to.add_constraint(sign * rate[rows] <= limit @ h, Transcription.RELAXATION)

        def kept(
            *points: Any,
            rows: list[int] = rows.tolist(),  # noqa: B008  of this pass
            sign: float = sign,
            limit: np.ndarray = limit,
        ) -> Any:
            x = points[0] if isinstance(to, Vertex) or key == to.u.id else points[1]
            rate = _of(variables, index, order, x)[rows]
            return limit[:, 0] * x[-1] ** order - sign * rate

        least = np.zeros(len(rows))
        constraint = WrittenConstraint(kept, least, np.full(len(rows), np.inf))
        to.add_constraint(constraint, Transcription.RESTRICTION)

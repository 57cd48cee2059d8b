"""The rows of a polyhedron's sources: a geometry, a program, or another set."""

from __future__ import annotations

from typing import Any

from scene_graph_ros.convex.questions.conic_program import (
    ConicProgram,
    rows_of_program,
)
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.from_shapes import (
    half_spaces_of,
    is_query,
    placed_shape,
)
from scene_graph_ros.geometry.model.ids import FrameId

__all__ = ["rows_of"]


def rows_of(A: Any, b: Any, reference_frame: FrameId | None) -> tuple[Any, Any]:
    """Return ``A (m, n)`` and ``b (m,)`` of an object in their place, or the arguments.

    Raises ConvexSetError for a geometry, a program or a set without such rows.
    """
    if is_query(A):
        return half_spaces_of(*placed_shape(A, b, reference_frame), "HPolyhedron")
    if isinstance(A, ConicProgram):
        return rows_of_program(A, "HPolyhedron")
    rows = A._half_spaces() if isinstance(A, ConvexSet) else None
    return (A, b) if rows is None else rows

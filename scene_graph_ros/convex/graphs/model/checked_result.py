"""The check of an argument of vertices and edges: a result of a graph."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["checked_result"]


def checked_result(result: Any, question: str) -> Any:
    """Return a result of a graph, which has flows. Raises ConvexSetError for another object."""
    if not isinstance(getattr(result, "flows", None), Mapping):
        raise ConvexSetError(
            f"{question}: result must be what a graph's solve_... returned, not {quoted(result)}"
        )
    return result

"""Searches of graphs that end in time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.model.options import GraphOfConvexSetsOptions
from scene_graph_ros.planning.parallel.deadline import Deadline

__all__ = ["in_time"]


def in_time(
    options: GraphOfConvexSetsOptions | None,
    timeout: float | None,
    watch: Callable[[], object] | None,
) -> GraphOfConvexSetsOptions | None:
    """Return options of a search that ends in time; without a time limit those that are given.

    Raises ConvexSetError for a time limit or a watch function that makes no sense.
    """
    deadline = Deadline.of(timeout, watch, ConvexSetError)
    if not deadline.is_set:
        return options
    given = options or GraphOfConvexSetsOptions()
    own = given.termination_func
    return replace(
        given, termination_func=lambda: deadline.is_over() or (own is not None and own())
    )

"""The path along which nearly all of a relaxation's flow goes."""

from __future__ import annotations

from collections.abc import Mapping

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex

__all__ = ["path_along_flows"]


def path_along_flows(
    source: Vertex, target: Vertex, flows: Mapping[int, float], tolerance: float
) -> list[Edge]:
    """Return the edges along which all but ``tolerance`` of the flow goes.

    ``flows`` are by edges' numbers. Raises ConvexSetError where there is no such path.
    """
    path: list[Edge] = []
    at, seen = source, {source.id}
    while at is not target:
        ahead = [e for e in at.outgoing_edges if e.v.id not in seen]
        best = max(ahead, key=lambda e: flows.get(e.id, 0.0), default=None)
        if best is None or flows.get(best.id, 0.0) < 1.0 - tolerance:
            raise ConvexSetError(
                f"GraphOfConvexSets.get_solution_path: the result has no path from"
                f" {source.name!r} to {target.name!r} to a tolerance of {tolerance!r}"
            )
        path.append(best)
        at = best.v
        seen.add(at.id)
    return path

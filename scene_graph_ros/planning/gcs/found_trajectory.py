"""From the points of a path to a trajectory, measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scene_graph_ros.convex.graphs.model.edge import Edge
from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult
from scene_graph_ros.planning.gcs.joined_edges import Bounds, JoinedEdges
from scene_graph_ros.planning.gcs.result import (
    GcsTrajectoryResult,
    measured,
    Step,
    trajectory_of,
)
from scene_graph_ros.planning.gcs.subgraph import Subgraph
from scene_graph_ros.trajectories.composite_trajectory import CompositeTrajectory

__all__ = ["found_trajectory"]


def found_trajectory(
    found: GraphOfConvexSetsResult,
    subgraphs: Sequence[Subgraph],
    joined: Sequence[JoinedEdges],
    edges: Sequence[Edge],
) -> tuple[CompositeTrajectory | None, GcsTrajectoryResult]:
    """Return a path's trajectory, or the reason for none; ``edges`` are those between regions.

    Raises SolverError where the points break what they are to keep.
    """
    if not found.is_success:
        return None, GcsTrajectoryResult(False, found.cost, found.lower_bound, found.reason, found)
    homes = {vertex.id: (each, vertex) for each in subgraphs for vertex in each.vertices}
    leaving = {edge.u.id: edge for edge in edges}
    steps = []
    for number, x in zip(found.vertices, found.points, strict=True):
        if number in homes:  # others are a source or a target of several regions
            subgraph, vertex = homes[number]
            steps.append(
                Step(vertex, subgraph, x, *_onward(joined, leaving.get(number), subgraph))
            )
    trajectory = trajectory_of(steps)
    return trajectory, measured(steps, found, trajectory)


def _onward(
    joined: Sequence[JoinedEdges], edge: Edge | None, subgraph: Subgraph
) -> tuple[np.ndarray, int, tuple[int, ...], tuple[Bounds, ...]]:
    """Return the offset of an edge, its continuous orders of r(s) and q(t), and bounds."""
    for each in joined:
        offset = None if edge is None else each.offset_of(edge)
        if offset is not None:
            goes_on = each.continuity_order, tuple(each.continuous_derivatives)
            return offset, *goes_on, each.meeting_bounds
    return np.zeros(subgraph.variables.num_positions), 0, (), ()

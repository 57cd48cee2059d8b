"""Which regions of subgraphs meet, with what their vertices know of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.convex.sets.intersection import Intersection
from scene_graph_ros.convex.sets.pairwise_intersections import (
    compute_pairwise_intersections,
    own_box,
    translated,
)
from scene_graph_ros.planning.gcs.subgraph import Subgraph

__all__ = ["Pairs", "meeting_between", "meeting_inside"]

Pairs = tuple[list[tuple[int, int]], list[np.ndarray]]
"""The numbers of two regions each, and the offset ``(n,)`` by which the first is moved."""


def meeting_inside(subgraph: Subgraph, joints: Sequence[int]) -> Pairs:
    """Return the regions of a subgraph that meet, in both orders. Raises ConvexSetError."""
    return compute_pairwise_intersections(
        subgraph.regions, None, joints, bboxes_A=_boxes(subgraph)
    )


def meeting_between(
    first: Subgraph, second: Subgraph, joints: Sequence[int], subspace: ConvexSet | None
) -> Pairs:
    """Return the regions of two subgraphs that meet, in a subspace if there is one."""
    edges, offsets = compute_pairwise_intersections(
        first.regions,
        second.regions,
        joints,
        bboxes_A=_boxes(first),
        bboxes_B=_boxes(second),
    )
    if subspace is None:
        return edges, offsets
    kept = []
    for (i, j), offset in zip(edges, offsets, strict=True):
        moved = translated(first.regions[i], offset)
        if not Intersection([moved, second.regions[j], subspace]).is_empty():
            kept.append(((i, j), offset))
    return [pair for pair, _ in kept], [offset for _, offset in kept]


def _boxes(subgraph: Subgraph) -> list[Hyperrectangle]:
    """Return boxes around regions, which their vertices know."""
    n = subgraph.variables.num_positions
    boxes = []
    for vertex, region in zip(subgraph.vertices, subgraph.regions, strict=True):
        box = own_box(region)
        if box is None:
            center, half = vertex.placed.center[:n], vertex.placed.half[:n]
            box = center - half, center + half
        boxes.append(Hyperrectangle(*box))
    return boxes

"""How far paths reach in unbounded sets: boxes that hold all points of paths up to a cost.

An edge of such a path costs no more than the path, as no other part costs less than nothing. The
part of its two points that this and the constraints leave lies in a polyhedron: rows are taken as
they are, and curved functions by planes beneath them. Supports of the polyhedra bound each vertex
by the edges before it, on all edges that lead there, and by those behind it (bounds tightening, as
in Gleixner, Berthold, Müller and Weltge, "Three enhancements for optimization-based bound
tightening", 2017). Where vertices are on circles, the cost itself is spread: no coordinate changes
by more than a multiple of the path's cost and the edges' remainders.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
from typing import Any

import numpy as np

from scene_graph_ros.convex.graphs.expressions.expressions import Constraint, Cost
from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.search.edge_planes import EdgePlanes
from scene_graph_ros.convex.sets.convex_set import ConvexSet

__all__ = ["Box", "boxes_of_sets", "extents_of_paths", "own_extent"]

Box = tuple[np.ndarray, np.ndarray]
"""Least and greatest coordinates ``(n,)``, which may be infinite."""

_ROUNDING = 1e-9
"""Relative: by how much bounds are widened, far more than floats are off by."""

_MOST_SWEEPS = 50
"""Boxes get through so many edges in a row at most; what is then endless stays so."""


def boxes_of_sets(vertices: Sequence[Vertex]) -> dict[int, Box]:
    """Return the boxes of sets by the numbers of their vertices."""
    boxes = {}
    for vertex in vertices:
        if vertex.is_bounded:
            placed = vertex.placed
            boxes[vertex.id] = placed.center - placed.half, placed.center + placed.half
            continue
        boxes[vertex.id] = _widened(own_extent(vertex.set))
    return boxes


def own_extent(of: ConvexSet) -> Box:
    """Return the box of a set, with infinite bounds where it goes on for ever."""
    reached = [of.support(d) for e in np.eye(of.ambient_dimension) for d in (-e, e)]
    far = np.array([each.value + each.gap for each in reached])
    return -far[::2], far[1::2]


def _widened(box: Box) -> Box:
    """Return a box with room for its bounds' rounding."""
    low, high = box
    finite = np.concatenate([low[np.isfinite(low)], high[np.isfinite(high)]])
    room = _ROUNDING * float(np.abs(finite).max(initial=0.0))
    return low - room, high + room


@dataclass(frozen=True, eq=False)
class _Way:
    """Edges to a vertex from those before it, or from it to those behind, and which end it is."""

    edges: Sequence[EdgePlanes]
    end: int


def extents_of_paths(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    ends: tuple[Vertex, Vertex],
    used: frozenset[Transcription],
    limit: float,
) -> dict[int, Box]:
    """Return boxes that hold all points of paths between two vertices that cost up to a limit.

    By the numbers of vertices; some bounds may be infinite. Costs and constraints are those that
    count in all of ``used``. Without a limit, which is infinite, constraints alone bound.

    Raises ConvexSetError, which names the edge, where a linear cost has no least value.
    """
    source, _ = ends
    boxes = boxes_of_sets(vertices)
    planes = [_planes(edge, source, used, limit) for edge in edges]
    for each in planes:
        each.check_cost(boxes)
    into: dict[int, list[EdgePlanes]] = defaultdict(list)
    out: dict[int, list[EdgePlanes]] = defaultdict(list)
    for edge, each in zip(edges, planes, strict=True):
        into[edge.v.id].append(each)
        out[edge.u.id].append(each)
    _sweep(vertices, ends, boxes, into, out)
    if _are_endless(boxes) and limit < math.inf:
        _spread_cost(ends, boxes, planes, limit)
        _sweep(vertices, ends, boxes, into, out)
    return {number: _widened(box) for number, box in boxes.items()}


def _are_endless(boxes: dict[int, Box]) -> bool:
    return not all(np.isfinite(side).all() for box in boxes.values() for side in box)


def _planes(
    edge: Edge, source: Vertex, used: frozenset[Transcription], limit: float
) -> EdgePlanes:
    parts = [edge, edge.v, edge.u] if edge.u is source else [edge, edge.v]

    def shared(of: Callable[[Transcription], list[Any]]) -> list[Any]:
        first, *others = (of(each) for each in used)
        return [c for c in first if all(any(c is d for d in other) for other in others)]

    costs = [c for part in parts for c in shared(part.get_costs) if isinstance(c, Cost)]
    asking = dict.fromkeys([*parts, edge.u])
    asked = [
        c for part in asking for c in shared(part.get_constraints) if isinstance(c, Constraint)
    ]
    return EdgePlanes(edge, costs, asked, limit)


def _sweep(
    vertices: Sequence[Vertex],
    ends: tuple[Vertex, Vertex],
    boxes: dict[int, Box],
    into: dict[int, list[EdgePlanes]],
    out: dict[int, list[EdgePlanes]],
) -> None:
    """Narrow endless boxes by those before and behind them, until nothing changes."""
    source, target = ends
    for sweep in range(_MOST_SWEEPS):
        changed = False
        for vertex in vertices if sweep % 2 == 0 else reversed(vertices):
            low, high = boxes[vertex.id]
            if np.isfinite(low).all() and np.isfinite(high).all():
                continue
            ways = [] if vertex is source else [_Way(into[vertex.id], 1)]
            ways += [] if vertex is target else [_Way(out[vertex.id], 0)]
            for side, sign in ((low, -1.0), (high, 1.0)):
                for k in np.flatnonzero(~np.isfinite(side)).tolist():
                    best = min((_reach(way, k, sign, boxes) for way in ways), default=math.inf)
                    # Where no edge can be taken the vertex is on no such path: any bound will do.
                    if best < math.inf:
                        side[k] = (
                            sign * best if best > -math.inf else np.clip(0.0, low[k], high[k])
                        )
                        changed = True
        if not changed:
            return


def _reach(way: _Way, k: int, sign: float, boxes: dict[int, Box]) -> float:
    """Return a coordinate's range over all edges of a path."""
    most = -math.inf
    for planes in way.edges:
        most = max(most, planes.reach(boxes, {(way.end, k): sign}))
        if most == math.inf:
            break
    return most


def _spread_cost(
    ends: tuple[Vertex, Vertex],
    boxes: dict[int, Box],
    planes: Sequence[EdgePlanes],
    limit: float,
) -> None:
    """Bound each coordinate by that of source and target and by a path's cost."""
    sizes = {len(box[0]) for box in boxes.values()}
    if len(sizes) > 1:
        return
    for k in range(sizes.pop()):
        for sign in (-1.0, 1.0):
            step = {(1, k): sign, (0, k): -sign}
            slope = max((each.reach(boxes, step) for each in planes), default=0.0) / limit
            if not slope < math.inf:
                continue
            slope = max(slope, 0.0)
            left: dict[int, float] = defaultdict(float)
            for each in planes:
                rest = each.reach(boxes, step, -slope)
                left[each.edge.u.id] = max(left[each.edge.u.id], rest)
            moved = slope * limit + sum(left.values())
            # Forward from the source along sign, and backward from the target against it.
            for end, way in ((ends[0], sign), (ends[1], -sign)):
                at = boxes[end.id][0 if way < 0.0 else 1][k]
                for low, high in boxes.values():
                    if way > 0.0:
                        high[k] = min(high[k], at + moved)
                    else:
                        low[k] = max(low[k], at - moved)

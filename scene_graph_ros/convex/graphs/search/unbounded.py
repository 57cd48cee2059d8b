"""Paths through unbounded sets: boxes for these, in which paths are then sought as elsewhere.

A path's cost bounds its points, and so do constraints (`path_extents`). The cost is that of
some path, which is sought in boxes that are guessed. Paths that leave the boxes which follow cost
more than it, so that the bound of those inside holds for all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import itertools
import math

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.graphs.expressions.functions import FunctionCost
from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.placed_set import PlacedSet
from scene_graph_ros.convex.graphs.relax.later import Once
from scene_graph_ros.convex.graphs.search.path_extents import (
    Box,
    extents_of_paths,
    own_extent,
)
from scene_graph_ros.convex.graphs.search.result import (
    GraphOfConvexSetsResult,
    RelaxationAnswer,
)
from scene_graph_ros.convex.sets.cartesian_product import CartesianProduct
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.intersection import Intersection

__all__ = ["Places", "solve_in_boxes"]

Places = Mapping[int, PlacedSet]
"""Bounded sets by the numbers of their vertices."""

Solve = Callable[[Sequence[Vertex], Sequence[Edge], Places, bool], GraphOfConvexSetsResult]
"""Finds a path through vertices, edges and bounded sets; any path, where so told."""

_GUESSES = (10.0, 1e3, 1e6)
"""Beside the size of the bounded sets: how large boxes are guessed, one after the other."""

_MORE = 1e-6
"""Relative: by how much more than the path that was found others may cost."""

_NEAR = 1e-3
"""Of half a guessed box: points nearer to its sides might go on beyond."""


def solve_in_boxes(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    ends: tuple[Vertex, Vertex],
    used: frozenset[Transcription],
    solve: Solve,
) -> GraphOfConvexSetsResult:
    """Return the answer of ``solve`` for the sets in boxes, with a bound that holds beyond them.

    It takes vertices, edges, bounded sets, and whether any path will do. Where nothing bounds a
    set, paths in guessed boxes count if they keep away from the sides; their bound is 0. So it is
    where no path was found in any of these.

    Raises ConvexSetError, which names the vertex, where a bounded set is needed.
    """
    limit = math.inf
    boxes = extents_of_paths(vertices, edges, ends, used, limit)
    if _endless(vertices, boxes) is not None:
        if _has_functions(vertices, edges, used):
            return _without_bound(vertices, edges, boxes, solve)
        found = _some_path(vertices, edges, boxes, solve)
        if not found.is_success:
            return _without_path(vertices, boxes, found)
        limit = found.cost * (1.0 + _MORE) or 1.0
        narrower = extents_of_paths(vertices, edges, ends, used, limit)
        if _endless(vertices, narrower) is not None:
            return _without_bound(vertices, edges, boxes, solve)
        boxes = narrower
    answer = solve(*_in_boxes(vertices, edges, ends, boxes), False)
    return replace(answer, lower_bound=min(answer.lower_bound, limit))


def _has_functions(
    vertices: Sequence[Vertex], edges: Sequence[Edge], used: frozenset[Transcription]
) -> bool:
    """Tell whether costs are functions, which may be below 0: then the rest may cost more."""
    return any(
        isinstance(cost, FunctionCost)
        for part in (*vertices, *edges)
        for cost in part.get_costs(used)
    )


def _endless(vertices: Sequence[Vertex], boxes: Mapping[int, Box]) -> tuple[Vertex, int] | None:
    """Return a vertex and the coordinate along which its box is endless."""
    for vertex in vertices:
        low, high = boxes[vertex.id]
        endless = np.flatnonzero(~(np.isfinite(low) & np.isfinite(high)))
        if len(endless):
            return vertex, int(endless[0])
    return None


def _refusal(vertices: Sequence[Vertex], boxes: Mapping[int, Box], because: str) -> ConvexSetError:
    found = _endless(vertices, boxes)
    assert found is not None
    vertex, k = found
    return ConvexSetError(
        f"GraphOfConvexSets: the set of vertex {vertex.name!r} is unbounded along coordinate {k},"
        f" and {because}; intersect it with a box"
    )


def _placed(vertex: Vertex, box: Box) -> PlacedSet | None:
    """Return a set within a box; None where it has no point there."""
    if vertex.is_bounded:
        return vertex.placed
    if (box[0] > box[1]).any():
        return None
    within = _within(vertex.set, box)
    return None if within.is_empty() else PlacedSet.place(within)


def _within(of: ConvexSet, box: Box) -> ConvexSet:
    """Return the intersection of a set and a box: of a product set by set, flat sets as rows.

    Only where the set itself goes on for ever: rows that nearly repeat its own would cost digits.
    """
    if isinstance(of, CartesianProduct) and of.A is None and of.num_factors():
        factors = [of.factor(k) for k in range(of.num_factors())]
        ends = np.cumsum([0, *(each.ambient_dimension for each in factors)]).tolist()
        return CartesianProduct(
            [
                each if each.is_bounded() else _within(each, (box[0][a:b], box[1][a:b]))
                for each, (a, b) in zip(factors, itertools.pairwise(ends), strict=True)
            ]
        )
    own = own_extent(of)
    rows, sides = [], []
    for ends, given, sign in zip(own, box, (-1.0, 1.0), strict=True):
        endless = ~np.isfinite(ends)
        rows.append(sign * np.eye(len(ends))[endless])
        sides.append(sign * given[endless])
    both = Intersection(of, HPolyhedron(np.concatenate(rows), np.concatenate(sides)))
    lift = both.lifted
    if lift.cones or lift.num_variables > of.ambient_dimension:
        return both
    return HPolyhedron(
        np.concatenate([lift.E, -lift.E, lift.A]), np.concatenate([lift.f, -lift.f, lift.b])
    )


def _in_boxes(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    ends: Sequence[Vertex],
    boxes: Mapping[int, Box],
) -> tuple[list[Vertex], list[Edge], Places]:
    """Return the part of a graph in boxes, source and target at least, and its sets."""
    placed = {vertex.id: _placed(vertex, boxes[vertex.id]) for vertex in vertices}
    places = {number: each for number, each in placed.items() if each is not None}
    for vertex in ends:
        if vertex.id not in places:
            raise SolverError(
                f"GraphOfConvexSets: no point of vertex {vertex.name!r} is left in the box"
                f" {boxes[vertex.id][0].tolist()} to {boxes[vertex.id][1].tolist()}"
            )
    kept = [e for e in edges if e.u.id in places and e.v.id in places]
    return [v for v in vertices if v.id in places], kept, places


def _guessed(
    vertices: Sequence[Vertex], boxes: Mapping[int, Box], factor: float
) -> dict[int, Box]:
    """Return boxes with bounds where there are none, some sizes from the bounded sets."""
    size, guessed = _size(boxes), {}
    for vertex in vertices:
        low, high = boxes[vertex.id]
        n = len(low)
        alike = [b for b in boxes.values() if len(b[0]) == n and np.isfinite(b).all()]
        mean = np.mean(alike, axis=(0, 1)) if alike else np.zeros(n)
        anchor = low if vertex.is_bounded else _near(vertex.set, mean)
        reach = factor * max(size, float(np.abs(anchor - mean).max(initial=0.0)))
        guessed[vertex.id] = (
            np.where(np.isfinite(low), low, np.minimum(anchor, high) - reach),
            np.where(np.isfinite(high), high, np.maximum(anchor, low) + reach),
        )
    return guessed


def _size(boxes: Mapping[int, Box]) -> float:
    """Return the largest distance of finite bounds of a coordinate, or 1."""
    size = 0.0
    for n in {len(low) for low, _ in boxes.values()}:
        sides = np.array([side for box in boxes.values() for side in box if len(side) == n])
        for column in sides.T:
            finite = column[np.isfinite(column)]
            size = max(size, float(np.ptp(finite)) if len(finite) else 0.0)
    return size or 1.0


def _near(of: ConvexSet, p: np.ndarray) -> np.ndarray:
    """Return a point ``(n,)`` of a set, the nearest to another where that is found."""
    try:
        found = of.projection(p[None])
    except SolverError:
        found = None
    if found is not None:
        return np.asarray(found.points[0])
    point = of.maybe_get_feasible_point()
    assert point is not None, "sets of a graph are not empty"
    return point


def _some_path(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    boxes: Mapping[int, Box],
    solve: Solve,
) -> GraphOfConvexSetsResult:
    """Return a path, the first that is found in guessed boxes; else the last answer.

    Rounded paths may all break constraints that others keep: these are searched then.
    """
    last, failure = None, None
    for factor, is_any in itertools.product(_GUESSES, (True, False)):
        if not is_any and last is not None and last.lower_bound == math.inf:
            continue
        guessed = _guessed(vertices, boxes, factor)
        try:
            last = solve(*_in_boxes(vertices, edges, (), guessed), is_any)
        except SolverError as error:
            failure = error
            continue
        if last.is_success and last.cost < math.inf:
            return last
    if last is None:
        assert failure is not None
        raise failure
    return last


def _without_path(
    vertices: Sequence[Vertex], boxes: Mapping[int, Box], found: GraphOfConvexSetsResult
) -> GraphOfConvexSetsResult:
    """Return the answer in the largest guessed boxes, with a bound that holds beyond them."""
    endless = _endless(vertices, boxes)
    assert endless is not None
    said = (
        f"{found.reason}, in boxes up to {max(_GUESSES):g} times as large as what is bounded; the"
        f" set of vertex {endless[0].name!r} goes on along coordinate {endless[1]}"
    )
    return replace(
        found,
        lower_bound=min(found.lower_bound, 0.0),
        relaxation=_unbounded(found.relaxation),
        reason=said,
    )


def _without_bound(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    boxes: Mapping[int, Box],
    solve: Solve,
) -> GraphOfConvexSetsResult:
    """Return the best path of guessed boxes, if it is away from their sides."""
    for factor in _GUESSES:
        guessed = _guessed(vertices, boxes, factor)
        found = solve(*_in_boxes(vertices, edges, (), guessed), False)
        if found.is_success and not _is_at_a_guess(found, boxes, guessed):
            endless = _endless(vertices, boxes)
            assert endless is not None
            said = (
                f"{found.reason}; neither costs nor constraints bound the points of vertex"
                f" {endless[0].name!r} along coordinate {endless[1]}, so that nothing is proven"
                " beyond costs being at least 0"
            )
            return replace(
                found,
                lower_bound=min(found.lower_bound, 0.0),
                relaxation=_unbounded(found.relaxation),
                reason=said,
            )
    raise _refusal(vertices, boxes, "the cost goes down as far as its points are let")


def _unbounded(of: Once[RelaxationAnswer]) -> Once[RelaxationAnswer]:
    return Once(lambda: replace(of(), bound=None))


def _is_at_a_guess(
    found: GraphOfConvexSetsResult, boxes: Mapping[int, Box], guessed: Mapping[int, Box]
) -> bool:
    """Tell whether points are at sides of boxes which were guessed."""
    for number, x in zip(found.vertices, found.points, strict=True):
        near = _NEAR * 0.5 * (guessed[number][1] - guessed[number][0])
        low = np.isfinite(boxes[number][0]) | (x - guessed[number][0] > near)
        high = np.isfinite(boxes[number][1]) | (guessed[number][1] - x > near)
        if not (low & high).all():
            return True
    return False

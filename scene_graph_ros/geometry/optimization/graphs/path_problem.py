"""What is solved for a path: vertices and edges as a network, each with the terms it costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from scene_graph_ros.geometry.optimization.graphs.edge import Edge, Vertex
from scene_graph_ros.geometry.optimization.graphs.edge_terms import EdgeTerms, terms_of
from scene_graph_ros.geometry.optimization.graphs.expressions import Cost
from scene_graph_ros.geometry.optimization.graphs.functions import (
    FunctionConstraint,
    FunctionCost,
)
from scene_graph_ros.geometry.optimization.graphs.network import Network
from scene_graph_ros.geometry.optimization.graphs.placed_set import PlacedSet
from scene_graph_ros.geometry.optimization.graphs.relaxation import PlacedFunction, Problem
from scene_graph_ros.geometry.optimization.graphs.transcription import Transcription
from scene_graph_ros.geometry.optimization.sets.point import Point

__all__ = ["network_of", "problem_of", "standing_problem", "terms_of_edge"]


def network_of(
    vertices: Sequence[Vertex], edges: Sequence[Edge], source: Vertex, target: Vertex
) -> Network:
    """Return the edges by the places of their vertices in a list."""
    place = {vertex.id: k for k, vertex in enumerate(vertices)}
    return Network(
        len(vertices),
        np.array([place[e.u.id] for e in edges], dtype=np.int64),
        np.array([place[e.v.id] for e in edges], dtype=np.int64),
        place[source.id],
        place[target.id],
    )


def _parts(edge: Edge, source: Vertex) -> list[Vertex | Edge]:
    """Return an edge and the vertex it leads to, and the source where it leads from there."""
    return [edge, edge.v, edge.u] if edge.u is source else [edge, edge.v]


def _is_function(term: Any) -> bool:
    return isinstance(term, FunctionCost | FunctionConstraint)


def terms_of_edge(
    edge: Edge,
    source: Vertex,
    more: Sequence[Cost] = (),
    used: Transcription = Transcription.MIP,
    places: Mapping[int, PlacedSet] | None = None,
) -> EdgeTerms:
    """Return what an edge and the vertex it leads to cost, and the source where it leads there.

    And ``more`` costs beside them. Of functions nothing is in them. ``places`` are bounded sets
    by the numbers of vertices, in place of their own.
    """
    parts = _parts(edge, source)
    costs = [c for part in parts for c in part.get_costs(used) if not _is_function(c)]
    constraints = [c for part in parts for c in part.get_constraints(used) if not _is_function(c)]
    at_u, at_v = (_place(vertex, places) for vertex in (edge.u, edge.v))
    ends = ((edge.u.id, at_u), (edge.v.id, at_v))
    label = f"GraphOfConvexSets: edge {edge.name!r}"
    return terms_of([*costs, *more], constraints, ends, label)


def _functions(edge: Edge, source: Vertex) -> tuple[PlacedFunction, ...]:
    """Return the functions of an edge and the vertices that count with it."""
    used, found = Transcription.RESTRICTION, []
    for part in _parts(edge, source):
        takes_u, takes_v = part is not edge.v, part is not edge.u
        terms = [*part.get_costs(used), *part.get_constraints(used)]
        found += [PlacedFunction(each, takes_u, takes_v) for each in terms if _is_function(each)]
    return tuple(found)


def _is_same(edge: Edge, source: Vertex, first: Transcription, second: Transcription) -> bool:
    """Tell whether an edge has the same costs and constraints in two transcriptions."""
    for part in _parts(edge, source):
        terms = [[*part.get_costs(used), *part.get_constraints(used)] for used in (first, second)]
        if [id(each) for each in terms[0]] != [id(each) for each in terms[1]]:
            return False
    return True


def problem_of(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    source: Vertex,
    target: Vertex,
    used: Transcription = Transcription.MIP,
    like: tuple[Problem, Transcription] | None = None,
    places: Mapping[int, PlacedSet] | None = None,
) -> Problem:
    """Return a problem of these edges alone, with costs in units of what a path may cost.

    ``like`` is one of the same edges in another transcription: what is the same is its.
    ``places`` are bounded sets by the numbers of vertices, in place of their own.
    """
    if like is not None and like[1] is used:
        return like[0]
    network = network_of(vertices, edges, source, target)
    terms = [
        like[0].terms[k]
        if like is not None and _is_same(edge, source, like[1], used)
        else terms_of_edge(edge, source, (), used, places)
        for k, edge in enumerate(edges)
    ]
    most = np.array([each.most() for each in terms])
    unit = network.distances(most)[network.target]
    if not 0.0 < unit < np.inf:
        unit = float(most.max(initial=0.0)) or 1.0
    forced = tuple(k for k, edge in enumerate(edges) if True in edge.phi_constraints)
    functions = {}
    if used is Transcription.RESTRICTION:
        placed = {k: _functions(edge, source) for k, edge in enumerate(edges)}
        functions = {k: some for k, some in placed.items() if some}
    sets = [_place(v, places) for v in vertices]
    return Problem(network, sets, terms, forced, float(unit), functions)


def _place(vertex: Vertex, places: Mapping[int, PlacedSet] | None) -> PlacedSet:
    return vertex.placed if places is None else places[vertex.id]


def standing_problem(
    vertex: Vertex, used: Transcription, places: Mapping[int, PlacedSet] | None = None
) -> Problem:
    """Return the problem of staying in one vertex: an edge to a point that costs as it does."""
    ends = ((vertex.id, _place(vertex, places)), (-1, PlacedSet.place(Point())))
    label = f"GraphOfConvexSets: vertex {vertex.name!r}"
    costs, constraints = vertex.get_costs(used), vertex.get_constraints(used)
    terms = terms_of(
        [c for c in costs if not _is_function(c)],
        [c for c in constraints if not _is_function(c)],
        ends,
        label,
    )
    functions = tuple(
        PlacedFunction(each, True, False) for each in (*costs, *constraints) if _is_function(each)
    )
    most = terms.most()
    network = Network(2, np.array([0]), np.array([1]), 0, 1)
    sets = [end[1] for end in ends]
    return Problem(network, sets, [terms], (), most or 1.0, {0: functions} if functions else {})

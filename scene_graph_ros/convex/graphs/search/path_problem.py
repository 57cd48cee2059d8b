"""The problem of a path: vertices and edges as a network, each with its terms."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from scene_graph_ros.convex.graphs.expressions.expressions import Cost
from scene_graph_ros.convex.graphs.expressions.functions import (
    FunctionConstraint,
    FunctionCost,
)
from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.edge_terms import EdgeTerms
from scene_graph_ros.convex.graphs.model.placed_set import PlacedSet
from scene_graph_ros.convex.graphs.network.network import Network
from scene_graph_ros.convex.graphs.network.one_way import split_by_direction
from scene_graph_ros.convex.graphs.relax.edge_table import EdgeTable
from scene_graph_ros.convex.graphs.relax.make_table import EdgeSource, table_of
from scene_graph_ros.convex.graphs.relax.relaxation import PlacedFunction, Problem
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice

__all__ = [
    "forced_of",
    "free_problem",
    "kept_terms",
    "network_of",
    "problem_of",
    "standing_problem",
    "terms_of_edge",
]


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


def forced_of(edges: Sequence[Edge]) -> tuple[int, ...]:
    """Return the places of edges that have to be on the path."""
    asked = [(k, edge) for k, edge in enumerate(edges) if edge.has_phi_constraints]
    return tuple(k for k, edge in asked if True in edge.phi_constraints)


def _parts(edge: Edge, source: Vertex) -> list[Vertex | Edge]:
    """Return an edge and the vertex it leads to, and the source where it leads from there."""
    return [edge, edge.v, edge.u] if edge.u is source else [edge, edge.v]


def _is_function(term: Any) -> bool:
    return isinstance(term, FunctionCost | FunctionConstraint)


def terms_of_edge(edge: Edge, source: Vertex, more: Sequence[Cost] = ()) -> EdgeTerms:
    """Return the terms of an edge and the vertex it leads to, and the source where it leads there.

    And ``more`` costs beside them. Of functions nothing is in them.
    """
    made = _source(edge, source, Transcription.MIP, None)
    terms: EdgeTerms = table_of([made._replace(costs=[*made.costs, *more])])[0]
    return terms


def _source(
    edge: Edge,
    source: Vertex,
    used: Transcription,
    places: Mapping[int, PlacedSet] | None,
    is_known: Callable[[Any], bool] = lambda _: True,
) -> EdgeSource:
    parts = _parts(edge, source)
    costs = [c for part in parts for c in part.get_costs(used) if not _is_function(c)]
    constraints = [c for part in parts for c in part.get_constraints(used) if not _is_function(c)]
    constraints = [c for c in constraints if is_known(c)]
    u, v = ((vertex.id, _place(vertex, places)) for vertex in (edge.u, edge.v))
    return EdgeSource(costs, constraints, u, v, f"GraphOfConvexSets: edge {edge.name!r}")


def _functions(edge: Edge, source: Vertex) -> tuple[PlacedFunction, ...]:
    """Return the functions of an edge and the vertices that count with it."""
    used, found = Transcription.RESTRICTION, []
    for part in _parts(edge, source):
        takes_u, takes_v = part is not edge.v, part is not edge.u
        terms = [*part.get_costs(used), *part.get_constraints(used)]
        found += [PlacedFunction(each, takes_u, takes_v) for each in terms if _is_function(each)]
    return tuple(found)


def _is_same(
    edges: Sequence[Edge], source: Vertex, first: Transcription, second: Transcription
) -> bool:
    """Tell whether edges have the same costs and constraints in two transcriptions."""
    parts = {id(part): part for edge in edges for part in _parts(edge, source)}
    return not any(
        (first in used) != (second in used)
        for part in parts.values()
        for used in part.transcriptions
    )


def _table(
    edges: Sequence[Edge],
    source: Vertex,
    used: Transcription,
    places: Mapping[int, PlacedSet] | None,
) -> EdgeTable:
    """Return the table of edges; they keep the terms that were made before."""
    if places is not None:
        return table_of([_source(edge, source, used, places) for edge in edges])
    return EdgeTable(kept_terms(edges, source, used))


def _new_terms(edges: Sequence[Edge], source: Vertex, used: Transcription) -> EdgeTable:
    """Return the terms of edges, which they keep."""
    made = table_of([_source(edge, source, used, None) for edge in edges])
    for edge, terms in zip(edges, made, strict=True):
        edge.keep_terms(used, edge.u is source, terms)
    return made


def kept_terms(edges: Sequence[Edge], source: Vertex, used: Transcription) -> list[EdgeTerms]:
    """Return the terms of edges in a transcription; they keep those that were made before."""
    kept = [edge.kept_terms(used, edge.u is source) for edge in edges]
    new = [k for k, terms in enumerate(kept) if terms is None]
    if new:
        for k, terms in zip(new, _new_terms([edges[k] for k in new], source, used), strict=True):
            kept[k] = terms
    return [terms for terms in kept if terms is not None]


def problem_of(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    within: Network,
    used: Transcription = Transcription.MIP,
    like: tuple[Problem, Transcription] | None = None,
    places: Mapping[int, PlacedSet] | None = None,
) -> Problem:
    """Return a problem of these edges alone, with costs in units of a path's possible cost.

    ``within`` has their places and those of the vertices.
    ``like`` is one of the same edges in another transcription: equal parts are shared.
    ``places`` are bounded sets by the numbers of vertices, in place of their own.
    """
    if like is not None and like[1] is used:
        return like[0]
    network, source = split_by_direction(within), vertices[within.source]
    placed = [_place(v, places) for v in vertices]
    sets = [placed[v] for v in network.origin]
    table: EdgeTable
    if like is not None and _is_same(edges, source, like[1], used):
        table = like[0].terms
    else:
        table = _table(edges, source, used, places)
    most = table.costs_at_most()
    unit = network.distances(most)[network.target]
    if not 0.0 < unit < np.inf:
        unit = float(most.max(initial=0.0)) or 1.0
    functions = {}
    if used is Transcription.RESTRICTION:
        found = {k: _functions(edge, source) for k, edge in enumerate(edges)}
        functions = {k: some for k, some in found.items() if some}
    return Problem(network, sets, table, forced_of(edges), float(unit), functions)


def free_problem(
    source: Vertex,
    edges: Sequence[Edge],
    of_paths: Problem,
    places: Mapping[int, PlacedSet] | None,
    solver: SolverChoice | None,
) -> Problem:
    """Return a problem of paths without constraints that count in the restriction alone.

    These are choices of the caller that added them: others may cost less. Solved by ``solver``.
    """
    used = Transcription.RESTRICTION
    parts = {id(part): part for edge in edges for part in _parts(edge, source)}
    alone = {
        id(term)
        for part in parts.values()
        for term in part.get_constraints(used)
        if not _is_function(term)
    } - {
        id(term)
        for part in parts.values()
        for term in part.get_constraints(Transcription.RELAXATION)
    }
    if not alone:
        return replace(of_paths, solver=solver)
    made = [_source(edge, source, used, places, lambda c: id(c) not in alone) for edge in edges]
    return replace(of_paths, terms=table_of(made), functions={}, solver=solver)


def _place(vertex: Vertex, places: Mapping[int, PlacedSet] | None) -> PlacedSet:
    return vertex.placed if places is None else places[vertex.id]


def standing_problem(
    vertex: Vertex, used: Transcription, places: Mapping[int, PlacedSet] | None = None
) -> Problem:
    """Return the problem of staying in one vertex: an edge to a point that costs as it does."""
    ends = ((vertex.id, _place(vertex, places)), (-1, PlacedSet.place(Point())))
    label = f"GraphOfConvexSets: vertex {vertex.name!r}"
    costs, constraints = vertex.get_costs(used), vertex.get_constraints(used)
    table = table_of(
        [
            EdgeSource(
                [c for c in costs if not _is_function(c)],
                [c for c in constraints if not _is_function(c)],
                *ends,
                label,
            )
        ]
    )
    functions = tuple(
        PlacedFunction(each, True, False) for each in (*costs, *constraints) if _is_function(each)
    )
    most = float(table.costs_at_most()[0])
    network = Network(2, np.array([0]), np.array([1]), 0, 1)
    sets = [end[1] for end in ends]
    return Problem(network, sets, table, (), most or 1.0, {0: functions} if functions else {})

"""The shortest of few paths: each is solved, and no relaxation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.model.edge import Edge, Vertex
from scene_graph_ros.convex.graphs.model.options import GraphOfConvexSetsOptions
from scene_graph_ros.convex.graphs.network.network import Network
from scene_graph_ros.convex.graphs.relax.bounds import bound_of_relaxation
from scene_graph_ros.convex.graphs.relax.later import Once
from scene_graph_ros.convex.graphs.relax.relaxation import relax
from scene_graph_ros.convex.graphs.restrict.chain import Chain
from scene_graph_ros.convex.graphs.restrict.restriction import best_of_chain, Restricted
from scene_graph_ros.convex.graphs.search.path_answer import (
    relaxation_answer,
    with_points,
)
from scene_graph_ros.convex.graphs.search.path_problem import (
    forced_of,
    kept_terms,
    problem_of,
)
from scene_graph_ros.convex.graphs.search.result import (
    GraphOfConvexSetsResult,
    RelaxationAnswer,
)
from scene_graph_ros.convex.graphs.search.search import Incumbent

__all__ = ["best_of_few"]

_MOST_LOOKS = 2000
"""Edges that are looked at for paths, until there are too many."""

_MOST_EDGES = 160
"""All paths together have no more of them: that takes about as long as a relaxation."""


def best_of_few(
    vertices: Sequence[Vertex],
    edges: Sequence[Edge],
    network: Network,
    options: GraphOfConvexSetsOptions,
) -> GraphOfConvexSetsResult | None:
    """Return the shortest of all paths; None where there are too many, or not all are solved.

    And where the options ask for something else than a shortest path by our own methods. Sets are
    bounded.
    """
    if not _is_asked(options) or any(part.has_functions for part in (*edges, *vertices)):
        return None
    paths = network.few_paths(_MOST_LOOKS, _MOST_EDGES)
    forced = set(forced_of(edges))
    paths = [path for path in paths or () if forced <= set(path)]
    if not 0 < len(paths) <= options.max_search_programs:
        return None
    used, source = Transcription.MIP, vertices[network.source]
    terms = kept_terms(edges, source, used)
    found: list[tuple[Restricted, tuple[int, ...]]] = []
    for path in paths:
        visited = [source, *(edges[k].v for k in path)]
        chain = Chain([terms[k] for k in path], [vertex.placed for vertex in visited])
        best = best_of_chain(chain)
        if best is None:
            return None
        found.append((best, path))
    best, path = min(found, key=lambda each: each[0].cost)
    others = {
        "lower_bound": min(each.lower_bound for each, _ in found),
        "num_search_programs": len(found),
        "num_edges_solved": len(edges),
        "reason": "the best path, to the tolerance",
        "relaxation": Once(lambda: _relaxation(vertices, edges, network)),
    }
    return with_points(edges, Incumbent(path, best), used, others)


def _is_asked(options: GraphOfConvexSetsOptions) -> bool:
    """Tell whether a shortest path is asked for, by our own methods."""
    solvers = options.mixed_integer, options.continuous, options.of_restriction
    if any(each is not None for each in solvers):
        return False
    return not options.convex_relaxation and options.termination_func is None


def _relaxation(
    vertices: Sequence[Vertex], edges: Sequence[Edge], network: Network
) -> RelaxationAnswer:
    problem = problem_of(vertices, edges, network)
    relaxed = relax(problem)
    if relaxed.cost == np.inf:
        raise SolverError("the relaxation was not solved, though paths keep all constraints")
    return relaxation_answer(
        edges, problem, relaxed, (problem, bound_of_relaxation(problem, relaxed))
    )

"""Constraints of an edge that are taken back, replaced and added again."""

import gc
import itertools

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    GraphOfConvexSets,
    Hyperrectangle,
    norm,
    Point,
    Transcription,
)


@pytest.fixture
def way():
    """From 0 through 0 to 9 and back to 1, by the length of the way."""
    graph = GraphOfConvexSets()
    sets = (Point([0.0]), Hyperrectangle([0.0], [9.0]), Point([1.0]))
    vertices = [graph.add_vertex(each) for each in sets]
    edges = [graph.add_edge(u, v) for u, v in itertools.pairwise(vertices)]
    for edge in edges:
        edge.add_cost(norm(edge.xv - edge.xu))
    return graph, edges


def length_through(graph, edges):
    """Return the cost of the way."""
    return graph.solve_convex_restriction(edges).cost


def test_constraints_take_turns(way):
    """Through 2 the way is 3 long, through 5 it is 9; the order of turns does not matter."""
    graph, edges = way
    (first, _), used = edges, Transcription.RESTRICTION
    through = {at: first.xv == np.array([at]) for at in (2.0, 5.0)}
    for at in (2.0, 5.0, 2.0, 2.0, 5.0):
        first.add_constraint(through[at], used)
        assert length_through(graph, edges) == pytest.approx(2.0 * at - 1.0, abs=1e-6)
        first.discard_constraint(through[at])
        assert length_through(graph, edges) == pytest.approx(1.0, abs=1e-6)


def test_constraints_that_nobody_has_any_more(way):
    """New ones may be where those were that are gone: more of them than an edge keeps terms of."""
    graph, edges = way
    # Garbage is looked for in what is made from here on.
    gc.freeze()
    for at in np.linspace(1.0, 9.0, 60):
        constraint = edges[0].add_constraint(edges[0].xv == np.array([at]))
        assert length_through(graph, edges) == pytest.approx(2.0 * at - 1.0, abs=1e-6)
        edges[0].discard_constraint(constraint)
        del constraint
        gc.collect()


def test_other_costs_beside_the_same_constraint(way):
    """A cost that is added counts, and so does one of the vertex that the edge leads to."""
    graph, edges = way
    through = edges[0].xv == np.array([4.0])
    edges[0].add_constraint(through)
    assert length_through(graph, edges) == pytest.approx(7.0, abs=1e-6)
    edges[0].discard_constraint(through)
    edges[0].add_cost(2.0)
    edges[0].v.add_cost(0.5)
    edges[0].add_constraint(through)
    assert length_through(graph, edges) == pytest.approx(9.5, abs=1e-6)

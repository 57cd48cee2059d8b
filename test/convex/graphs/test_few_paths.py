"""The shortest of few paths, each of which is solved; and which paths there are."""

from __future__ import annotations

import itertools
import pickle
import sys

from graphs_of_sets import check, joined
import numpy as np
import pytest

from scene_graph_ros.convex.graphs.network.network import Network
from scene_graph_ros.convex.graphs.relax.later import Later, Once
from scene_graph_ros.convex.graphs.search import few_paths
from scene_graph_ros.geometry.optimization import (
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    Hyperrectangle,
    norm,
    Point,
)


def all_paths(size: int, edges: list[tuple[int, int]], source: int, target: int):
    """Return all simple paths, from all orders of what may be between."""
    numbers = {step: k for k, step in enumerate(edges)}
    inner = [v for v in range(size) if v not in (source, target)]
    return {
        tuple(numbers[step] for step in itertools.pairwise((source, *some, target)))
        for count in range(len(inner) + 1)
        for some in itertools.permutations(inner, count)
        if all(step in numbers for step in itertools.pairwise((source, *some, target)))
    }


@pytest.mark.parametrize("seed", range(40))
def test_few_paths_are_all_paths(seed):
    """In graphs of six vertices, with and without preprocessing."""
    rng = np.random.default_rng(seed)
    edges = [s for s in itertools.permutations(range(6), 2) if rng.random() < 0.4]
    tails, heads = np.array(edges).reshape(-1, 2).T.copy()
    network = Network(6, tails, heads, 0, 5)
    truth = all_paths(6, edges, 0, 5)
    found = network.few_paths(10_000, 10_000)
    assert len(found) == len(truth)
    assert set(found) == truth
    # Each edge of a path survives, and what survives has the same paths.
    kept = network.on_simple_paths()
    assert {e for path in truth for e in path} <= set(kept.tolist())
    less = Network(6, tails[kept], heads[kept], 0, 5).few_paths(10_000, 10_000)
    assert {tuple(kept[list(path)].tolist()) for path in less} == truth


def test_too_many_paths_are_none():
    """A limit of looks, and one of the edges of all paths together."""
    tails, heads = np.array(list(itertools.permutations(range(6), 2))).T.copy()
    network = Network(6, tails, heads, 0, 5)
    paths = network.few_paths(10_000, 10_000)
    total = sum(map(len, paths))
    assert network.few_paths(10_000, total) == paths
    assert network.few_paths(10_000, total - 1) is None
    assert network.few_paths(50, 10_000) is None


def diamond() -> tuple[GraphOfConvexSets, list]:
    """Return a graph with a way over and a longer one under a gap, each with a box."""
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([4.0, 0.0]))
    edges = []
    for low, high in (([1.0, 3.0], [3.0, 5.0]), ([1.0, -6.0], [3.0, -4.0])):
        over = graph.add_vertex(Hyperrectangle(low, high))
        edges += [joined(graph, start, over), joined(graph, over, end)]
    return graph, [start, end, *edges]


TRUTH = 2.0 * np.hypot(2.0, 3.0)


def test_the_shortest_is_proven_without_a_relaxation(monkeypatch):
    """Two paths, two programs; Clarabel is not even imported."""
    monkeypatch.setitem(sys.modules, "clarabel", None)
    graph, (start, end, *edges) = diamond()
    found = graph.solve_shortest_path(start, end)
    check(found, TRUTH)
    assert found.path == (edges[0].id, edges[1].id)
    assert found.num_search_programs == 2
    assert found.edge_costs == pytest.approx({e.id: TRUTH / 2.0 for e in edges[:2]}, rel=1e-6)


def test_the_relaxation_is_solved_when_its_flows_are_read(monkeypatch):
    """Once, and never before."""
    solved = []
    relax = few_paths.relax
    monkeypatch.setattr(few_paths, "relax", lambda problem: solved.append(1) or relax(problem))
    graph, (start, end, *edges) = diamond()
    found = graph.solve_shortest_path(start, end)
    assert not solved
    assert found.flows[edges[0].id] == pytest.approx(1.0, abs=1e-6)
    assert found.flows[edges[2].id] == pytest.approx(0.0, abs=1e-6)
    assert edges[0].get_solution_phi_xv(found) == pytest.approx([2.0, 3.0], abs=1e-4)
    assert found.relaxation_cost == pytest.approx(TRUTH, rel=1e-7)
    assert found.relaxation_bound.verify()
    assert len(solved) == 1


def test_edges_that_have_to_be_on_the_path_are():
    """The longer way is the only one then."""
    graph, (start, end, *edges) = diamond()
    edges[2].add_phi_constraint(True)
    found = graph.solve_shortest_path(start, end)
    check(found, 2.0 * np.hypot(2.0, 4.0))
    assert found.path == (edges[2].id, edges[3].id)


def test_limits_and_functions_that_end_a_search_count(monkeypatch):
    """What may take one program alone, or is to be watched, is searched as before."""
    asked: list[int] = []
    monkeypatch.setattr(few_paths, "best_of_chain", lambda *_: asked.append(1))
    graph, (start, end, *_) = diamond()
    for options in (
        GraphOfConvexSetsOptions(max_search_programs=1),
        GraphOfConvexSetsOptions(termination_func=lambda: False),
        GraphOfConvexSetsOptions(convex_relaxation=True),
        GraphOfConvexSetsOptions(restriction_solver="clarabel"),
    ):
        check(graph.solve_shortest_path(start, end, options), TRUTH)
    assert not asked


def test_a_path_that_can_not_keep_its_constraints_leaves_it_to_the_relaxation():
    """The other is found, and that there is none is told with its proof."""
    graph, (start, end, *edges) = diamond()
    edges[0].add_constraint(edges[0].xv[0] <= 0.5)
    check(graph.solve_shortest_path(start, end), 2.0 * np.hypot(2.0, 4.0))
    edges[2].add_constraint(edges[2].xv[0] <= 0.5)
    found = graph.solve_shortest_path(start, end)
    assert not found.is_success
    assert "proven" in found.reason


def test_results_travel():
    """Pickled, with what had not been made yet."""
    graph, (start, end, *edges) = diamond()
    found = graph.solve_shortest_path(start, end)
    came = pickle.loads(pickle.dumps(found))
    assert came.cost == found.cost
    assert dict(came.edge_costs) == dict(found.edge_costs)
    assert came.flows == found.flows
    assert set(came.flows) <= {edge.id for edge in edges}


def test_what_is_made_later_is_made_once():
    """A mapping that is looked into several times."""
    made = []
    later = Later(lambda: made.append(1) or {1: 2.0})
    assert not made
    assert later == {1: 2.0}
    assert (len(later), list(later), later[1], repr(later)) == (1, [1], 2.0, "{1: 2.0}")
    assert made == [1]
    assert Once.of(3)() == 3


def test_costs_are_those_of_the_moment():
    """What is added to an edge later does not count in an answer of before."""
    graph, (start, end, *edges) = diamond()
    found = graph.solve_shortest_path(start, end)
    edges[0].add_cost(norm(edges[0].xv - edges[0].xu))
    assert found.edge_costs[edges[0].id] == pytest.approx(TRUTH / 2.0, rel=1e-6)

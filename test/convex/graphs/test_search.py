"""Best-first search: the best of all paths, and an honest word of what was left."""

from __future__ import annotations

import itertools
import math

from graphs_of_sets import around, check, joined, RELAXED
import numpy as np
import pytest
from searching import times

from scene_graph_ros.convex.graphs.network.network import Network
from scene_graph_ros.convex.graphs.network.rounding import main_path
from scene_graph_ros.convex.graphs.search import few_paths, rounded_paths, search
from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    Hyperrectangle,
    norm,
    Point,
    SolverError,
    Vertex,
    VPolytope,
)

pytestmark = pytest.mark.usefixtures("both_ways_to_paths")


def loose_graph() -> tuple[GraphOfConvexSets, Vertex, Vertex]:
    """Return a graph whose relaxation mixes two ways in one set.

    From (0, 0) over (1, 1) or (1, -1), then anywhere on x = 2, to (3, 0). Half a flow over each
    is at (2, 1) and at (2, -1) of the segment, on average at (2, 0), for 1 + 1 behind either.
    A path has to go straight to (3, 0) from where it is.
    """
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([3.0, 0.0]))
    wall = graph.add_vertex(VPolytope([[2.0, 1.0], [2.0, -1.0]]))
    for y in (1.0, -1.0):
        over = graph.add_vertex(Point([1.0, y]))
        joined(graph, start, over)
        joined(graph, over, wall)
    joined(graph, wall, end)
    return graph, start, end


def test_search_closes_the_gap_of_a_loose_relaxation():
    """The bound of the relaxation is 2 + sqrt(2); paths are sqrt(2) + sqrt(5), which is proven."""
    graph, start, end = loose_graph()
    truth = math.sqrt(2.0) + math.sqrt(5.0)
    rounded = graph.solve_shortest_path(start, end, RELAXED)
    assert rounded.lower_bound == pytest.approx(2.0 + math.sqrt(2.0), abs=1e-7)
    assert rounded.lower_bound <= 2.0 + math.sqrt(2.0)
    assert rounded.cost == pytest.approx(truth, abs=1e-8)
    assert rounded.relaxation_bound is not None
    assert rounded.relaxation_bound.verify()
    exact = graph.solve_shortest_path(start, end)
    check(exact, truth)
    assert exact.num_search_programs > 0


def test_a_search_that_is_cut_short_says_what_is_left():
    """Without programs to solve, the gap is that of the relaxation."""
    graph, start, end = loose_graph()
    options = GraphOfConvexSetsOptions(max_search_programs=0)
    result = graph.solve_shortest_path(start, end, options)
    assert result.is_success
    assert result.reason == "max_search_programs was reached"
    assert result.gap == pytest.approx(math.sqrt(5.0) - 2.0, abs=1e-7)


def test_a_search_ends_where_a_function_says_so():
    """Asked at each iteration and before each program: what is left is the gap."""
    graph, start, end = loose_graph()

    def ended_after(count):
        left = iter(range(count))
        options = GraphOfConvexSetsOptions(termination_func=lambda: next(left, None) is None)
        return graph.solve_shortest_path(start, end, options), len(list(left))

    whole, left = ended_after(10_000)
    assert not whole.is_stopped and whole.reason == "the best path, to the tolerance"
    bounds = []
    for count in range(10_000 - left):
        result, _ = ended_after(count)
        assert result.is_stopped
        bounds.append(result.lower_bound)
        assert result.lower_bound <= whole.cost * (1.0 + 1e-9)
        if result.is_success:
            assert result.reason == "termination_func ended the search"
            assert result.cost >= whole.cost * (1.0 - 1e-9)
        else:
            assert result.reason == "no path was found until termination_func ended the search"
    assert bounds[0] == -np.inf and bounds == sorted(bounds)
    # The last ones had a path already.
    assert result.is_success

    def stop():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        graph.solve_shortest_path(start, end, GraphOfConvexSetsOptions(termination_func=stop))
    with pytest.raises(ConvexSetError, match="termination_func must be a function or None"):
        GraphOfConvexSetsOptions(termination_func=3)


def refuse(problem, path, **_):
    """Solve nothing."""
    raise SolverError("test: no progress")


@pytest.mark.parametrize("most", [0, 1])
def test_without_a_solved_path_the_solver_is_named(monkeypatch, most):
    """Where neither a rounded path nor one of the search is solved, the reason says who failed."""
    graph, start, end = loose_graph()
    monkeypatch.setattr(few_paths, "_MOST_EDGES", 0)
    monkeypatch.setattr(rounded_paths, "restrict", refuse)
    monkeypatch.setattr(search, "restrict", refuse)
    options = GraphOfConvexSetsOptions(convex_relaxation=bool(most))
    result = graph.solve_shortest_path(start, end, options)
    assert not result.is_success
    assert result.lower_bound == pytest.approx(2.0 + math.sqrt(2.0), abs=1e-7)
    expected = "none of 2 rounded paths was solved: " if most else "no path was found: "
    assert result.reason == expected + "test: no progress"


def test_a_path_that_was_not_solved_leaves_the_search_open(monkeypatch):
    """A path without an answer may be the best one: the bound stays, and the reason says so."""
    graph, start, end = loose_graph()
    monkeypatch.setattr(few_paths, "_MOST_EDGES", 0)
    monkeypatch.setattr(search, "restrict", refuse)
    options = GraphOfConvexSetsOptions(max_rounded_paths=1)
    result = graph.solve_shortest_path(start, end, options)
    assert result.is_success
    assert result.reason == "a path that may be better was not solved: test: no progress"
    assert result.lower_bound < result.cost - 0.1


@pytest.mark.search
@pytest.mark.parametrize("seed", range(4))
def test_bounds_and_costs_of_all_paths_of_random_graphs(seed):
    """Against the restriction of each simple path: none is below the bound, the best is found."""
    for case in range(times(1)):
        scale = (1e-6, 1.0, 1e6, 1.0)[seed]
        check_random_graph(np.random.default_rng([seed, case]), scale, seed)


def check_random_graph(rng: np.random.Generator, scale: float, first_kind: int) -> None:
    """Try all simple paths of a graph of six sets of one size."""
    graph = GraphOfConvexSets()
    centers = rng.uniform(-1.0, 1.0, (6, 2)) * scale
    sets = [around(first_kind + k, c, 0.2 * scale) for k, c in enumerate(centers)]
    vertices = [graph.add_vertex(each) for each in sets]
    always = [(0, 1), (1, 5)]
    others = [s for s in itertools.permutations(range(6), 2) if rng.random() < 0.4]
    steps = [*always, *(s for s in others if s not in ((0, 5), *always))]
    edges = {s: joined(graph, vertices[s[0]], vertices[s[1]]) for s in steps}
    costs = []
    for size in range(5):
        for inner in itertools.permutations(range(1, 5), size):
            path = list(itertools.pairwise((0, *inner, 5)))
            if all(step in edges for step in path):
                costs.append(graph.solve_convex_restriction([edges[s] for s in path]).cost)
    result = graph.solve_shortest_path(vertices[0], vertices[5])
    assert result.is_success, result.reason
    # Sets may overlap, so that the way from one to the other is all rounding.
    rounding = 1e-9 * scale
    assert result.lower_bound <= min(costs) + 1e-13 * scale
    assert result.cost <= min(costs) * (1.0 + 2e-6) + rounding
    assert result.gap <= 2e-6 * result.cost + 20.0 * rounding


def test_the_path_with_the_most_flow_is_among_those_that_are_compared():
    """It goes back where it gets stuck, leaves out too little flow, and needs no luck."""
    # 0 -> 1 -> 2 is a dead end with the most flow at 0; 0 -> 3 -> 4 is the target.
    tails, heads = np.array([0, 1, 0, 3, 3]), np.array([1, 2, 3, 4, 2])
    network = Network(5, tails, heads, 0, 4)
    flows = np.array([0.6, 0.6, 0.4, 0.3, 0.1])
    assert main_path(network, flows, 1e-5) == (2, 3)
    assert main_path(network, flows, 0.35) is None
    # Two ways past a block: one rounded path is the better one, whatever the seed.
    graph = GraphOfConvexSets()
    start, goal = (graph.add_vertex(Point([x, 0.0])) for x in (0.0, 4.0))
    ways = [graph.add_vertex(Hyperrectangle([1.0, y], [3.0, y + 1.0])) for y in (0.5, -2.5)]
    for way in ways:
        for u, v in ((start, way), (way, goal)):
            edge = graph.add_edge(u, v)
            edge.add_cost(norm(edge.xv - edge.xu))
    for seed in range(5):
        options = GraphOfConvexSetsOptions(
            convex_relaxation=True, max_rounded_paths=1, rounding_seed=seed
        )
        result = graph.solve_shortest_path(start, goal, options)
        assert result.cost == pytest.approx(2.0 * math.hypot(2.0, 0.5), abs=1e-9)
        assert result.num_rounded_paths == 1

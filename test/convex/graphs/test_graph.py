"""Graphs of convex sets: what is refused, what is drawn, and what can't be on a path."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from scene_graph_ros.convex.graphs.network.network import Network
from scene_graph_ros.convex.graphs.network.rounding import draw_paths
from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    GcsGraphvizOptions,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperrectangle,
    norm,
    Point,
    quad_form,
    sum_squares,
)


def pair():
    """Return a graph of a point and a box, and the edge between them."""
    graph = GraphOfConvexSets()
    u, v = (
        graph.add_vertex(Point([0.0, 0.0]), "u"),
        graph.add_vertex(Hyperrectangle([1, 1], [2, 2])),
    )
    return graph, u, v, graph.add_edge(u, v, "way")


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda g, u, v, e: g.add_vertex([1.0]), "add_vertex: set must be a ConvexSet"),
        (lambda g, u, v, e: g.add_vertex(HPolyhedron.make_box([1], [0])), "set.*is empty"),
        (lambda g, u, v, e: g.add_edge(u, u), "u and v are both 'u'"),
        (
            lambda g, u, v, e: g.add_edge(u, pair()[2]),
            "add_edge: v must be a vertex of this graph",
        ),
        (lambda g, u, v, e: g.remove_edge(pair()[3]), "remove_edge: edge must be edges of this"),
        (lambda g, u, v, e: e.add_cost(-1.0) and g.solve_shortest_path(u, v), "'way'.* is -1 at"),
        (
            lambda g, u, v, e: e.add_cost(1.5 - e.xv[0]) and g.solve_shortest_path(u, v),
            "edge 'way': the linear part of the cost is -0.5 at some points",
        ),
        (lambda g, u, v, e: e.add_cost(e.xv), "must be a number, not 2 entries"),
        (lambda g, u, v, e: e.add_cost(float("nan")), "must be an expression or a finite number"),
        (lambda g, u, v, e: u.add_cost(norm(v.x)), "only vertex.x may be in it"),
        (lambda g, u, v, e: norm([1.0, 2.0]), "norm takes an expression"),
        (lambda g, u, v, e: -2.0 * norm(e.xu), "at least 0, not -2.0"),
        (lambda g, u, v, e: quad_form(e.xu, [[1.0, 0.0], [0.0, -1.0]]), "quad_form: Q must be"),
        (lambda g, u, v, e: e.xu + np.ones(3), "2 entries can't be added to one of 3"),
        (lambda g, u, v, e: np.ones((2, 3)) @ e.xu, "the matrix before @"),
        (lambda g, u, v, e: e.add_constraint(True), "must be made by ==, <= or >="),
        (lambda g, u, v, e: 0.0 <= e.xu[0] <= 1.0, "no truth value"),
        (lambda g, u, v, e: e.add_phi_constraint(1), "phi_value must be True or False"),
        (lambda g, u, v, e: g.solve_convex_restriction([]), "not empty"),
        (
            lambda g, u, v, e: g.solve_convex_restriction([e, e]),
            "'way' leads to 'v1' and 'way' from 'u'",
        ),
        (
            lambda g, u, v, e: g.solve_convex_restriction([e, g.add_edge(v, u)]),
            "visit a vertex twice",
        ),
        (
            lambda g, u, v, e: g.sample_paths(
                u, v, {e: 1.0}, GraphOfConvexSetsOptions(max_rounded_paths=0)
            ),
            "max_rounded_paths must be at least 1",
        ),
        (lambda g, u, v, e: GraphOfConvexSetsOptions(rounding_seed=-1), "rounding_seed"),
        (lambda g, u, v, e: GraphOfConvexSetsOptions(gap_tolerance=-1.0), "gap_tolerance"),
        (lambda g, u, v, e: GraphOfConvexSetsOptions(preprocessing=1), "preprocessing"),
    ],
)
def test_what_is_refused_is_named(wrong, message):
    """Errors name the argument and its value."""
    with pytest.raises(ConvexSetError, match=message):
        wrong(*pair())


def test_flows_of_another_graph_are_refused():
    """An edge belongs to its graph, though one of another looks alike."""
    graph, u, v, _ = pair()
    _, _, _, foreign = pair()
    with pytest.raises(ConvexSetError, match="flows must be of this graph's edges"):
        graph.sample_paths(u, v, {foreign: 1.0})


def test_expressions_compute_as_arrays_do():
    """Values of expressions at points are those of the same operations on arrays."""
    _, u, v, e = pair()
    a, b = np.array([1.0, -2.0]), np.array([3.0, 5.0])
    at = {u.id: a, v.id: b}
    M = np.array([[1.0, 2.0], [0.0, -1.0], [4.0, 0.5]])
    cases = [
        (e.xv - e.xu, b - a),
        (2.0 * e.xu + e.xv / 4.0 - [1.0, 2.0], 2.0 * a + b / 4.0 - [1.0, 2.0]),
        (M @ (e.xv + 1.0), M @ (b + 1.0)),
        (1.0 - e.xu[::-1] * [3.0, 4.0], 1.0 - a[::-1] * [3.0, 4.0]),
        (e.xu @ [2.0, 3.0] - e.xv[1], a @ [2.0, 3.0] - b[1]),
        ((-e.xv).sum(), -b.sum()),
    ]
    for expression, value in cases:
        np.testing.assert_array_equal(np.squeeze(expression.at(at)), value)
    cost = 2.0 * norm(e.xv - e.xu) + sum_squares(e.xu) * 3.0 + e.xv[0] + 1.0
    assert cost.at(at) == pytest.approx(2.0 * np.hypot(2.0, 7.0) + 15.0 + 3.0 + 1.0, rel=1e-15)


def test_vertices_and_edges_come_and_go():
    """Removing a vertex removes its edges; what was removed is no longer valid."""
    graph, u, v, e = pair()
    back = graph.add_edge(v, u)
    assert (graph.vertices, graph.edges) == ([u, v], [e, back])
    assert (graph.num_vertices, graph.num_edges) == (2, 2)
    assert (u.outgoing_edges, u.incoming_edges) == ([e], [back])
    graph.remove_vertex(v)
    assert (graph.vertices, graph.edges, u.outgoing_edges) == ([u], [], [])
    assert not graph.is_valid(v)
    assert not graph.is_valid(e)
    assert graph.is_valid(u)


def test_drawings_hold_what_was_asked_for():
    """Names with quotes, numbers in the form asked for, and the active path."""
    graph = GraphOfConvexSets()
    u = graph.add_vertex(Point([0.0]), 'the "first"')
    v = graph.add_vertex(Point([2.0]), "last")
    edge = graph.add_edge(u, v, "way")
    edge.add_cost(norm(edge.xv - edge.xu))
    plain = graph.get_graphviz_string()
    assert 'label="the \\"first\\""' in plain
    result = graph.solve_shortest_path(u, v)
    full = graph.get_graphviz_string(result, active_path=[edge])
    for part in ("x = [2.000]", "cost = 2.000", "ϕ = 1.000", "ϕ xᵥ = [2.000]", "#000000ff"):
        assert part in full
    assert full.count("style=dashed") == 1
    options = GcsGraphvizOptions(
        show_slacks=False, show_flows=False, show_vars=False, scientific=True, precision=1
    )
    bare = graph.get_graphviz_string(result, options)
    assert "cost = 2.0e+00" in bare
    assert "ϕ" not in bare
    assert "x =" not in bare


def test_paths_are_drawn_by_their_flows():
    """Of two ways with flows 0.8 and 0.2 both are drawn, from a seed; a dead end is left again."""
    graph = GraphOfConvexSets()
    s, a, b, dead, t = (graph.add_vertex(Point([float(k)])) for k in range(5))
    up = [graph.add_edge(s, a), graph.add_edge(a, t)]
    down = [graph.add_edge(s, b), graph.add_edge(b, t)]
    nowhere = graph.add_edge(a, dead)
    flows = dict.fromkeys(up, 0.8) | dict.fromkeys(down, 0.2) | {nowhere: 0.7}
    first = []
    for seed in range(200):
        options = GraphOfConvexSetsOptions(max_rounded_paths=1, rounding_seed=seed)
        (path,) = graph.sample_paths(s, t, flows, options)
        assert path in (up, down)
        assert path == graph.sample_paths(s, t, flows, options)[0]
        first.append(path == up)
    # Binomial of 200 with 0.8: five standard deviations are 0.14.
    assert abs(np.mean(first) - 0.8) < 0.15
    both = graph.sample_paths(s, t, flows)
    assert sorted(map(len, both)) == [2, 2]
    assert graph.sample_paths(s, t, {up[0]: 1.0}) == []


def simple_path_edges(size, edges, source, target):
    """Return the edges that are on some simple path, by walking all of them."""
    found = set()

    def walk(at, seen, path):
        if at == target:
            found.update(path)
            return
        for k, (u, v) in enumerate(edges):
            if u == at and v not in seen:
                walk(v, seen | {v}, [*path, k])

    walk(source, {source}, [])
    return found


def test_where_there_is_one_way_one_walk_is_enough():
    """A line of vertices takes no number; a way back that is never taken one for each walk."""

    class Counted:
        """Counts the numbers that are drawn."""

        def __init__(self):
            self.count = 0

        def random(self):
            """Return a number."""
            self.count += 1
            return 0.5

    network = Network(4, np.array([0, 1, 2, 1]), np.array([1, 2, 3, 0]), 0, 3)
    for back, drawn in ((0.0, 0), (0.5, 10)):
        generator = Counted()
        flows = np.array([1.0, 1.0, 1.0, back])
        assert list(draw_paths(network, flows, 5, 10, 1e-5, generator)) == [(0, 1, 2)]
        assert generator.count == drawn


@pytest.mark.parametrize("seed", range(20))
def test_preprocessing_keeps_all_edges_of_simple_paths(seed):
    """And drops those that are not reached, lead nowhere, or only back, against all paths."""
    rng = np.random.default_rng(seed)
    edges = [s for s in itertools.permutations(range(7), 2) if rng.random() < 0.25]
    tails, heads = np.array(edges).reshape(-1, 2).T.copy()
    network = Network(7, tails, heads, 0, 6)
    kept = set(network.on_simple_paths().tolist())
    true = simple_path_edges(7, edges, 0, 6)
    assert true <= kept
    # What dominators can't tell is little: a tenth of the edges at most.
    assert len(kept - true) <= 0.1 * len(edges) + 1


def test_preprocessing_drops_the_ways_back_of_a_tree():
    """In a tree with both directions, only the path's own edges are left, in its direction."""
    parents = [0, 0, 1, 1, 2, 2, 3, 4]
    down = [(p, k + 1) for k, p in enumerate(parents)]
    edges = np.array(down + [(v, u) for u, v in down])
    network = Network(9, *edges.T.copy(), 0, 8)
    kept = edges[network.on_simple_paths()].tolist()
    assert sorted(kept) == sorted([p, k] for p, k in down if k in ancestors(8, parents))


def ancestors(vertex, parents):
    """Return a vertex and those above it, without the root."""
    above = []
    while vertex:
        above.append(vertex)
        vertex = parents[vertex - 1]
    return above


def both_ways(pairs):
    """Return tails and heads of edges in both directions."""
    return np.array([step for u, v in pairs for step in ((u, v), (v, u))]).T.copy()


def test_preprocessing_drops_rings_that_hang_on_one_vertex():
    """A ring to which one vertex leads is on no simple path, though each of its edges goes on."""
    tails, heads = both_ways([(0, 1), (1, 2), (1, 3), (3, 4), (4, 5), (5, 1)])
    kept = Network(6, tails, heads, 0, 2).on_simple_paths()
    assert [(tails[e], heads[e]) for e in kept] == [(0, 1), (1, 2)]


@pytest.mark.parametrize("seed", range(3))
def test_of_undirected_graphs_preprocessing_keeps_edges_of_simple_paths_alone(seed):
    """With both directions of each edge: those that are in one block with source and target."""
    rng = np.random.default_rng(seed)
    pairs = [p for p in itertools.combinations(range(7), 2) if rng.random() < 0.33]
    tails, heads = both_ways(pairs)
    kept = Network(7, tails, heads, 0, 6).on_simple_paths()
    steps = {(int(tails[e]), int(heads[e])) for e in kept}
    on_paths = set()
    for size in range(6):
        for inner in itertools.permutations(range(1, 6), size):
            path = list(itertools.pairwise((0, *inner, 6)))
            if all(tuple(sorted(step)) in pairs for step in path):
                on_paths.update(path)
    assert on_paths <= steps
    # No edge of a block that hangs on a single vertex is left.
    assert {frozenset(s) for s in steps} == {frozenset(s) for s in on_paths}

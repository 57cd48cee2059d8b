"""Constraints that no path goes there and back: a tighter relaxation, whose bound stays proven."""

from __future__ import annotations

from dataclasses import replace
import itertools

import numpy as np
import pytest

from benchmarks.mazes import doors_of, our_graph
from scene_graph_ros.convex.graphs.network.network import Network, TwoCycle
from scene_graph_ros.convex.graphs.network.one_way import split_by_direction
from scene_graph_ros.convex.graphs.relax.bounds import bound_of_paths, Potentials
from scene_graph_ros.convex.graphs.relax.relaxation import CyclePrice, relax
from scene_graph_ros.geometry.optimization import (
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    Hyperrectangle,
    norm,
)

pytestmark = pytest.mark.usefixtures("both_ways_to_paths")


def relaxed(tightenings):
    """Return options that solve the relaxation so often again."""
    return GraphOfConvexSetsOptions(convex_relaxation=True, max_tightenings=tightenings)


def random_graph(seed, count=8, share=0.45, widest=0.5):
    """Return a graph of sets with edges both ways between a share of all pairs, and the sets."""
    rng = np.random.default_rng(seed)
    graph = GraphOfConvexSets()
    centers = rng.uniform(-1.0, 1.0, (count, 2))
    made = []
    for k, c in enumerate(centers):
        half = rng.uniform(0.05, widest, 2) * (0 < k < count - 1)
        made.append(graph.add_vertex(Hyperrectangle(c - half, c + half)))
    for a, b in itertools.combinations(range(count), 2):
        if rng.random() < share and (a, b) != (0, count - 1):
            for u, v in ((made[a], made[b]), (made[b], made[a])):
                edge = graph.add_edge(u, v)
                edge.add_cost(norm(edge.xv - edge.xu))
    return graph, made


def all_paths(graph, source, target):
    """Return all simple paths by their edges."""
    found, waiting = [], [[]]
    while waiting:
        path = waiting.pop()
        at = path[-1].v if path else source
        if at is target:
            found.append(path)
            continue
        seen = {source.id, *(e.v.id for e in path)}
        waiting += [[*path, e] for e in at.outgoing_edges if e.v.id not in seen]
    return found


@pytest.mark.parametrize("seed", range(3))
def test_bounds_are_between_the_looser_one_and_the_best_path(seed):
    """Against all paths of random graphs."""
    graph, made = random_graph(seed)
    paths = all_paths(graph, made[0], made[7])
    if not paths:
        assert not graph.solve_shortest_path(made[0], made[7]).is_success
        return
    # What the solver finds of a path is not its least cost to the last digit.
    best = min(graph.solve_convex_restriction(path).cost for path in paths)
    loose, tight = (graph.solve_shortest_path(made[0], made[7], relaxed(k)) for k in (0, 3))
    assert loose.lower_bound - 1e-12 <= tight.lower_bound <= best * (1.0 + 1e-13)
    assert tight.cost >= best * (1.0 - 1e-9)
    assert tight.relaxation_bound.verify()
    found = graph.solve_shortest_path(made[0], made[7])
    assert found.cost == pytest.approx(best, rel=2e-6)


def test_cycles_are_listed_where_edges_lead_both_ways():
    """With parallel edges, and none at source and target."""
    tails, heads = np.array([0, 1, 1, 2, 2]), np.array([1, 2, 2, 1, 3])
    network = Network(4, tails, heads, 0, 3)
    assert network.two_cycles() == [
        TwoCycle(1, (3,), (1, 2)),
        TwoCycle(2, (1, 2), (3,)),
    ]


@pytest.mark.parametrize("seed", range(4))
def test_any_prices_give_a_bound(seed):
    """Numbers that have nothing to do with the problem, negative ones too."""
    graph, made = random_graph(3)
    result = graph.solve_shortest_path(made[0], made[7])
    problem, given = result.relaxation_bound.problem, result.relaxation_bound.potentials
    rng = np.random.default_rng(seed)
    cycles = problem.network.two_cycles()
    assert cycles
    for size in (1e-3, 1.0):
        prices = [CyclePrice(c, size * rng.normal(), size * rng.normal(size=2)) for c in cycles]
        wrong = Potentials(
            given.levels, given.slopes, given.visits, given.prizes, given.weights, prices
        )
        assert bound_of_paths(problem, wrong).value <= result.cost * (1.0 + 1e-13)


def with_turns():
    """Return a graph in whose relaxation flow turns around where there are several ways on."""
    graph, made = random_graph(24, 12, 0.25, 0.8)
    return graph, made[0], made[-1]


def test_a_bound_is_higher_with_them():
    """By more than rounding, below the best path; and where it is asked for only."""
    graph, start, goal = with_turns()
    best = graph.solve_shortest_path(start, goal)
    loose, tight = (graph.solve_shortest_path(start, goal, relaxed(k)) for k in (0, 2))
    assert loose.lower_bound * (1.0 + 1e-2) < tight.lower_bound <= best.cost
    assert not loose.relaxation_bound.potentials.cycles
    assert tight.relaxation_bound.potentials.cycles
    assert tight.relaxation_bound.verify()
    # The flow of each cycle leaves room for itself.
    flows = np.array([tight.flows[e.id] for e in graph.edges if e.id in tight.flows])
    network = tight.relaxation_bound.problem.network
    for cycle in network.two_cycles():
        around = flows[[*cycle.into, *cycle.back]].sum()
        assert around <= flows[network.leaving[cycle.vertex]].sum() + 1e-5


def test_one_tightening_parts_all_cycles_where_flow_goes_around_most():
    """So flow does not turn to the others: after it no cycle is violated, and the bound is final.

    Flow goes around most of this graph's cycles at first.
    """
    graph, start, goal = with_turns()
    loose, once, more = (graph.solve_shortest_path(start, goal, relaxed(k)) for k in (0, 1, 9))
    network = once.relaxation_bound.problem.network

    def violated(result):
        flows = np.array([result.flows[e.id] for e in graph.edges if e.id in result.flows])
        return sum(
            flows[[*cycle.into, *cycle.back]].sum()
            > flows[network.leaving[cycle.vertex]].sum() + 1e-5
            for cycle in network.two_cycles()
        )

    assert violated(loose) > 0
    assert violated(once) == 0
    assert more.lower_bound == pytest.approx(once.lower_bound, rel=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_vertices_that_are_passed_one_way_or_the_other_keep_all_simple_paths(seed):
    """A network with them split has the same simple paths, listed in full, and fewer walks."""
    rng = np.random.default_rng(seed)
    pairs = [p for p in itertools.combinations(range(9), 2) if rng.random() < 0.3]
    ends = np.array([e for a, b in pairs for e in ((a, b), (b, a))]).reshape(-1, 2)
    ends = ends[(rng.random(len(ends)) < 0.9) & (ends[:, 1] != 0) & (ends[:, 0] != 8)]
    network = Network(9, ends[:, 0], ends[:, 1], 0, 8)
    split = split_by_direction(network)
    assert [split.origin[v] for v in split.tails] == network.tails.tolist()
    assert [split.origin[v] for v in split.heads] == network.heads.tolist()

    def simple(of, path=(), seen=frozenset([0])):
        at = of.heads[path[-1]] if path else 0
        found = {path} if at == 8 else set()
        for e in of.leaving[at] if at != 8 else ():
            v = int(of.heads[e])
            if v not in seen:
                found |= simple(of, (*path, e), seen | {v})
        return found

    assert simple(split) == simple(network)


def test_flow_does_not_turn_around_between_two_neighbours():
    """So that a maze's relaxation is tighter than that of vertices which flow may turn in."""
    size = 10
    graph, start, goal = our_graph(doors_of(np.random.default_rng(1), size), size)
    found = graph.solve_shortest_path(start, goal, relaxed(0))
    problem = found.relaxation_bound.problem
    network, whole = problem.network, {v.id: k for k, v in enumerate(graph.vertices)}
    edges = [e for e in graph.edges if e.id in found.flows]
    assert network.size > len({v.id for e in edges for v in (e.u, e.v)})
    turning = Network(
        len(whole),
        np.array([whole[e.u.id] for e in edges]),
        np.array([whole[e.v.id] for e in edges]),
        whole[start.id],
        whole[goal.id],
    )
    loose = relax(replace(problem, network=turning, sets=[v.placed for v in graph.vertices]))
    assert loose.cost * (1.0 + 1e-4) < found.relaxation_cost <= found.cost * (1.0 + 1e-9)

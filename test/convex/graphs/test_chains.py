"""Paths by the method for paths: as by programs over cones, and proven in their own way."""

from __future__ import annotations

import itertools
import math

from graphs_of_sets import around, joined
import numpy as np
import pytest

from scene_graph_ros.convex.graphs.expressions.transcription import Transcription
from scene_graph_ros.convex.graphs.restrict import chain as chain_module
from scene_graph_ros.convex.graphs.restrict.chain import Chain
from scene_graph_ros.convex.graphs.search.path_problem import kept_terms
from scene_graph_ros.geometry.optimization import (
    Edge,
    exp,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    Hyperellipsoid,
    Hyperrectangle,
    norm,
    norm_inf,
    Point,
    quad_over_lin,
    second_order_cone,
    sum_squares,
    VPolytope,
)

BY_CLARABEL = GraphOfConvexSetsOptions(restriction_solver="clarabel")
SIMPLE = (0, 1, 2, 3, 4, 8)
"""Kinds of sets around points whose reach is told by arrays, or by a closed form."""


def random_path(seed: int, size: float, far: float, kinds: tuple[int, ...] = SIMPLE):
    """Return a graph and the edges of a path, with costs and constraints of all sorts."""
    rng = np.random.default_rng(seed)
    n, count = int(rng.integers(1, 5)), int(rng.integers(2, 12))
    graph = GraphOfConvexSets()
    x, vertices = rng.normal(size=n) * far * size, []
    for _ in range(count):
        x = x + rng.normal(size=n) * size
        width = size * 10.0 ** rng.uniform(-3.0, 0.0)
        kind = int(rng.choice(kinds))
        of = Point(x) if rng.random() < 0.15 else around(kind, x, width)
        vertices.append(graph.add_vertex(of))
    edges = []
    for u, v in itertools.pairwise(vertices):
        edge = graph.add_edge(u, v)
        step = edge.xv - edge.xu
        costs = (
            lambda d=step: norm(d),
            lambda d=step: sum_squares(d) * (1.0 / size),
            lambda d=step: norm_inf(d),
            lambda d=step: norm(d) + quad_over_lin(d, d[0] * 0.0 + size),
        )
        edge.add_cost(costs[int(rng.integers(len(costs)))]())
        share = rng.random()
        if share < 0.1:
            edge.add_constraint(step[0] <= 10.0 * size)
        elif share < 0.2:
            edge.add_constraint(norm(step) <= 8.0 * size)
        edges.append(edge)
    return graph, edges


def chain_of(edges: list[Edge]) -> Chain:
    """Return a path's chain."""
    sets = [edges[0].u.placed, *(edge.v.placed for edge in edges)]
    return Chain(kept_terms(edges, edges[0].u, Transcription.RESTRICTION), sets)


@pytest.mark.parametrize("far", [0.0, 1e3])
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("seed", range(12))
def test_paths_cost_what_programs_over_cones_say(seed, size, far):
    """Within what the worse of both is proven to, and by the method itself for most."""
    graph, edges = random_path(seed, size, far)
    ours = graph.solve_convex_restriction(edges)
    other = graph.solve_convex_restriction(edges, BY_CLARABEL)
    assert ours.is_success
    assert other.is_success
    rounding = 1e-9 * (size + other.cost)
    assert ours.lower_bound <= other.cost + rounding
    assert other.lower_bound <= ours.cost + rounding
    assert ours.gap <= 1e-7 * (size + ours.cost)
    assert ours.violation <= 1e-7


def test_the_method_is_asked_and_gives_up_seldom():
    """Of 60 paths no more than three are left to programs over cones."""
    left = [seed for seed in range(60) if chain_of(random_path(seed, 1.0, 1.0)[1]).solve() is None]
    assert len(left) <= 3


@pytest.mark.parametrize("kinds", [(5,), (6,), (7,)])
def test_sets_that_are_put_together(kinds):
    """Sums, hulls and intersections tell their reach themselves."""
    graph, edges = random_path(3, 1.0, 0.0, kinds)
    ours = graph.solve_convex_restriction(edges)
    other = graph.solve_convex_restriction(edges, BY_CLARABEL)
    assert ours.cost == pytest.approx(other.cost, rel=1e-7)
    assert ours.gap <= 1e-6 * ours.cost


@pytest.mark.parametrize("tolerance", [1e-1, 1e-3, 1e-6])
@pytest.mark.parametrize("seed", range(10))
def test_a_search_that_ends_early_makes_the_bound_worse_and_not_wrong(
    seed, tolerance, monkeypatch
):
    """Whatever the multipliers are, no path costs less than the bound."""
    graph, edges = random_path(seed, 1.0, 1.0)
    truth = graph.solve_convex_restriction(edges).cost
    monkeypatch.setattr(chain_module, "_LIMITS", (tolerance, 40))
    monkeypatch.setattr(chain_module, "_ACCEPTED", np.inf)
    bound = chain_of(edges).solve().bound
    assert bound <= truth * (1.0 + 1e-12)


@pytest.mark.parametrize("kind", [norm, norm_inf, sum_squares])
def test_one_step_by_its_closed_form(kind):
    """From (0, 0) to a box at (3, 4) and beyond: 5, 4, and 25."""
    graph = GraphOfConvexSets()
    u, v = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Hyperrectangle([3, 4], [5, 9]))
    edge = graph.add_edge(u, v)
    edge.add_cost(kind(edge.xv - edge.xu))
    found = graph.solve_convex_restriction([edge])
    truth = {norm: 5.0, norm_inf: 4.0, sum_squares: 25.0}[kind]
    assert found.cost == pytest.approx(truth, rel=1e-9)
    assert truth - 1e-8 <= found.lower_bound <= truth
    assert chain_of([edge]).solve() is not None


def test_a_divisor_grows_until_it_costs_as_much():
    """|w|^2 / s + s with |w| = 2 is least at s = 2, where it is 4."""
    graph = GraphOfConvexSets()
    u, v = graph.add_vertex(Point([2.0])), graph.add_vertex(Hyperrectangle([0.5], [9.0]))
    edge = graph.add_edge(u, v)
    edge.add_cost(quad_over_lin(edge.xu, edge.xv[0]))
    edge.add_cost(edge.xv[0])
    assert chain_of([edge]).solve().bound == pytest.approx(4.0, rel=1e-8)
    assert graph.solve_convex_restriction([edge]).cost == pytest.approx(4.0, rel=1e-8)


def test_constraints_of_all_sorts_are_kept():
    """A rope of length 2 from (0, 0), a wall, and a line that the point is on."""
    graph = GraphOfConvexSets()
    u, v = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Hyperrectangle([-9, -9], [9, 9]))
    goal = graph.add_vertex(Point([0.0, 10.0]))
    first, second = graph.add_edge(u, v), graph.add_edge(v, goal)
    second.add_cost(norm(second.xv - second.xu))
    rope = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) @ first.xv + np.array([2.0, 0.0, 0.0])
    first.add_constraint(second_order_cone(rope))
    first.add_constraint(first.xv[0] == first.xv[1])
    second.add_constraint(second.xu[0] <= 1.0)
    found = graph.solve_convex_restriction([first, second])
    # On the diagonal no further than 1, which is nearer than the rope's end at the root of 2.
    assert found.points[1] == pytest.approx([1.0, 1.0], abs=1e-6)
    assert found.cost == pytest.approx(math.hypot(1.0, 9.0), rel=1e-8)
    assert chain_of([first, second]).solve() is not None


def test_what_the_method_does_not_know_is_left_to_others():
    """Exponentials, and bands that are too wide; the answers are there all the same."""
    graph = GraphOfConvexSets()
    u, v = graph.add_vertex(Point([0.0])), graph.add_vertex(Hyperrectangle([-1.0], [1.0]))
    edge = graph.add_edge(u, v)
    edge.add_cost(exp(edge.xv))
    assert not chain_of([edge]).is_known
    assert graph.solve_convex_restriction([edge]).cost == pytest.approx(math.exp(-1.0), rel=1e-7)
    angles = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    corners = np.column_stack([np.cos(angles), np.sin(angles)])
    first, second = (graph.add_vertex(VPolytope(corners + at)) for at in ([0.0, 0.0], [3.0, 0.0]))
    wide = joined(graph, first, second)
    assert chain_of([wide]).solve() is None
    assert graph.solve_convex_restriction([wide]).cost == pytest.approx(1.0, rel=1e-6)


def test_a_path_that_can_not_keep_its_constraints_is_proven_to_have_no_points():
    """The method finds nothing; that there is nothing is shown as before."""
    graph = GraphOfConvexSets()
    u, v = graph.add_vertex(Point([0.0])), graph.add_vertex(Hyperrectangle([1.0], [2.0]))
    edge = joined(graph, u, v)
    edge.add_constraint(edge.xv[0] <= 0.5)
    found = graph.solve_convex_restriction([edge])
    assert not found.is_success
    assert "proven" in found.reason


def test_sets_that_touch_and_sets_that_are_points():
    """Through the one point of two discs, with an end in the same place as the start."""
    graph = GraphOfConvexSets()
    here = graph.add_vertex(Point([0.0, 0.0]))
    discs = [
        graph.add_vertex(Hyperellipsoid.make_hypersphere(1.0, np.array([x, 0.0])))
        for x in (1.0, 3.0)
    ]
    there = graph.add_vertex(Hyperrectangle([0.0, 0.0], [0.0, 0.0]))
    edges = [joined(graph, u, v) for u, v in zip([here, *discs], [*discs, there], strict=True)]
    edges[1].add_constraint(edges[1].xu == edges[1].xv)
    found = graph.solve_convex_restriction(edges)
    assert found.cost == pytest.approx(4.0, rel=1e-6)
    assert found.points[1] == pytest.approx([2.0, 0.0], abs=1e-3)

"""Bounds of paths hold whatever the solver says."""

from __future__ import annotations

import itertools
import sys

import clarabel
import numpy as np
import pytest

from scene_graph_ros.convex.graphs.relax.bounds import bound_of_paths, Potentials
from scene_graph_ros.convex.solve.cones import optimum as wall
from scene_graph_ros.convex.solve.cones.standard_form import Status
from scene_graph_ros.geometry.optimization import (
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    Hyperrectangle,
    norm,
    Point,
    SolverError,
    sum_squares,
    VPolytope,
)

pytestmark = pytest.mark.usefixtures("both_ways_to_paths")

RELAXED = GraphOfConvexSetsOptions(convex_relaxation=True)


def grid(kinds: int = 3):
    """Return a graph of nine sets around whole points, joined both ways, and two corners."""
    graph = GraphOfConvexSets()
    sets = {}
    for i, j in itertools.product(range(3), repeat=2):
        low, high = np.array([i - 0.3, j - 0.3]), np.array([i + 0.3, j + 0.3])
        made = (Hyperrectangle, VPolytope.make_box)[(i + j) % 2](low, high)
        sets[i, j] = graph.add_vertex(made)
    for a, b in itertools.permutations(sets, 2):
        if abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1:
            edge = graph.add_edge(sets[a], sets[b])
            edge.add_cost((norm, sum_squares)[kinds % 2](edge.xv - edge.xu))
            edge.add_constraint(edge.xv[0] + edge.xv[1] >= 0.1 * a[0] - 0.5)
    return graph, sets[0, 0], sets[2, 2]


@pytest.mark.parametrize("kind", [0, 1])
def test_weights_bound_what_every_edge_costs_beyond_its_potentials(kind):
    """At random points an edge costs at least its drop of potential and its weight."""
    graph, start, end = grid(kind)
    options = GraphOfConvexSetsOptions(convex_relaxation=True, max_tightenings=0)
    bound = graph.solve_shortest_path(start, end, options).relaxation_bound
    problem, given = bound.problem, bound.potentials
    proven = bound_of_paths(problem, given)
    rng = np.random.default_rng(kind)
    for e, terms in enumerate(problem.terms):
        u, v = problem.network.tails[e], problem.network.heads[e]
        for _ in range(20):
            # Boxes of half-width 0.3, as often at a corner as inside.
            xu, xv = np.clip(rng.uniform(-0.6, 0.6, (2, 2)), -0.3, 0.3)
            if terms.violation(xu, xv) > 0.0:
                continue
            drop = given.levels[u] - given.levels[v]
            drop += given.slopes[u] @ xu - given.slopes[v] @ xv
            weight = proven.weights[e] - proven.visits[u]
            assert terms.cost(xu, xv) >= drop + weight - 1e-14


@pytest.mark.parametrize("seed", range(5))
def test_any_multipliers_give_a_bound(seed):
    """Numbers that have nothing to do with the problem never give more than the true cost."""
    graph, start, end = grid()
    result = graph.solve_shortest_path(start, end)
    problem = result.relaxation_bound.problem
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-3.0, 1.0)

    def noise(shape):
        return size * rng.normal(size=shape)

    given = result.relaxation_bound.potentials
    wrong = Potentials(
        given.levels + noise(given.levels.shape),
        [slope + noise(slope.shape) for slope in given.slopes],
        given.visits + noise(given.visits.shape),
        given.prizes,
        given.weights + noise(given.weights.shape),
    )
    # Potentials of source and target enter by their sets' reach, whatever they are.
    assert bound_of_paths(problem, wrong).value <= result.lower_bound + 1e-6


def test_a_solver_that_is_wrong_does_not_spoil_the_bound(monkeypatch):
    """Multipliers that are off by a tenth make the bound worse, not wrong."""
    graph, start, end = grid()
    truth = graph.solve_shortest_path(start, end)
    ask = wall.ask_clarabel

    def ask_wrongly(form, *others):
        found = ask(form, *others)
        rng = np.random.default_rng(0)
        return found._replace(z=found.z * (1.0 + 0.1 * rng.uniform(-1.0, 1.0, len(form.b))))

    monkeypatch.setattr(wall, "ask_clarabel", ask_wrongly)
    monkeypatch.setattr(wall, "_ACCEPTED", np.inf)
    wrong = graph.solve_shortest_path(start, end, RELAXED)
    assert wrong.lower_bound < truth.lower_bound
    assert wrong.cost >= truth.lower_bound


def test_a_solution_that_does_not_solve_is_an_error_with_its_residual(monkeypatch):
    """Numbers that are no solution are refused at the wall."""
    graph, start, end = grid()
    ask = wall.ask_clarabel

    def ask_wrongly(*asked):
        found = ask(*asked)
        return found._replace(x=found.x + 0.01, status=Status.SOLVED, word="Solved")

    monkeypatch.setattr(wall, "ask_clarabel", ask_wrongly)
    with pytest.raises(SolverError, match=r"largest residual \d"):
        graph.solve_shortest_path(start, end, RELAXED)


def test_a_relaxation_is_solved_with_refined_steps_where_it_is_off_without(monkeypatch):
    """Once without, which is enough; with them where what comes is off by more than is trusted."""
    graph, start, end = grid()
    ask = wall.ask_clarabel
    asked, off = [], 0.0

    def ask_and_note(form, tolerance, options, what, is_over):
        found = ask(form, tolerance, options, what, is_over)
        if "relaxation" not in what:
            return found
        asked.append((tolerance, not options))
        return found._replace(x=found.x + (off if options else 0.0))

    monkeypatch.setattr(wall, "ask_clarabel", ask_and_note)
    options = GraphOfConvexSetsOptions(convex_relaxation=True, max_tightenings=0)
    plain = graph.solve_shortest_path(start, end, options)
    assert asked == [(1e-10, False)]
    asked.clear()
    off = 1e-7
    refined = graph.solve_shortest_path(start, end, options)
    assert asked == [(1e-10, False), (1e-10, True)]
    assert refined.lower_bound == pytest.approx(plain.lower_bound, rel=1e-8)


def test_a_solver_that_breaks_is_an_error(monkeypatch):
    """What the solver raises ends in a typed error, also where it is no Exception."""

    class PanicError(BaseException):
        """As a library of another language raises it."""

    def panic(*_):
        raise PanicError("index out of bounds")

    monkeypatch.setattr(clarabel, "DefaultSolver", panic)
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0])), graph.add_vertex(Point([1.0]))
    edge = graph.add_edge(start, end)
    edge.add_cost(norm(edge.xv - edge.xu))
    with pytest.raises(SolverError, match="the solver failed: index out of bounds"):
        graph.solve_shortest_path(start, end, RELAXED)


def test_without_a_solver_the_error_says_what_to_install(monkeypatch):
    """Nothing else of the core needs it."""
    monkeypatch.setitem(sys.modules, "clarabel", None)
    graph, start, end = grid()
    with pytest.raises(SolverError, match="pip install clarabel"):
        graph.solve_shortest_path(start, end, RELAXED)

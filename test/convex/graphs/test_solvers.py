"""Solvers that a caller chooses: the same truths, their own settings, and what each refuses."""

from __future__ import annotations

import importlib.util
import itertools
import math

from graphs_of_sets import check, joined
import numpy as np
import pytest

from scene_graph_ros.convex.graphs.network.flow_programs import on_disjoint_ways
from scene_graph_ros.convex.graphs.network.network import Network
from scene_graph_ros.convex.solve.cones.solver_choice import SolverChoice
from scene_graph_ros.geometry.optimization import (
    ConicProgram,
    ConvexSetError,
    exp,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperrectangle,
    ImplicitGraphOfConvexSets,
    norm1,
    Point,
    positive_semidefinite,
    SolverError,
    VPolytope,
)


def needs(package):
    """Skip without a package that only a chosen solver wants."""
    is_there = importlib.util.find_spec(package) is not None
    return pytest.mark.skipif(not is_there, reason=f"the extra solver {package} is not installed")


SCS = pytest.param("scs", marks=needs("scs"))


def around_a_corner(cost=None):
    """Return a graph from (0, 0) over the segment x = 4, y >= 3 to (8, 0), and two ways more."""
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([8.0, 0.0]))
    door = graph.add_vertex(VPolytope([[4.0, 3.0], [4.0, 9.0]]))
    longer = graph.add_vertex(Hyperrectangle([3.0, -9.0], [5.0, -4.0]))
    for u, v in ((start, door), (door, end), (start, longer), (longer, end)):
        if cost is None:
            joined(graph, u, v)
        else:
            edge = graph.add_edge(u, v)
            edge.add_cost(cost(edge.xv - edge.xu))
    return graph, start, end


@pytest.mark.parametrize("solver", ["clarabel", SCS])
@pytest.mark.parametrize("is_relaxed", [False, True])
def test_each_solver_finds_the_way_and_its_proof(solver, is_relaxed):
    """Two sides 5 of 3-4-5 triangles; multipliers of each solver prove the bound."""
    graph, start, end = around_a_corner()
    options = GraphOfConvexSetsOptions(solver=solver, convex_relaxation=is_relaxed)
    result = graph.solve_shortest_path(start, end, options)
    check(result, 10.0, 1e-6)
    assert result.relaxation_bound.verify()
    path = graph.get_solution_path(start, end, result)
    check(graph.solve_convex_restriction(path, options=options), 10.0, 1e-6)


@pytest.mark.parametrize("method", ["highs", "highs-ds", "highs-ipm"])
def test_linear_programs_by_highs(method):
    """Sums of magnitudes: 4 + 3 twice."""
    graph, start, end = around_a_corner(norm1)
    options = GraphOfConvexSetsOptions(solver="highs", solver_options={"method": method})
    for relaxed in (None, True):
        result = graph.solve_shortest_path(
            start, end, GraphOfConvexSetsOptions(**{**vars(options), "convex_relaxation": relaxed})
        )
        check(result, 14.0)


@pytest.mark.parametrize("solver", ["clarabel", "highs", SCS])
def test_what_can_not_be_is_proven_by_each(solver):
    """Weights that show that there is no point."""
    graph, start, end = around_a_corner(norm1)
    for edge in graph.edges:
        edge.add_constraint(edge.xu[1] + edge.xv[1] >= 20.0)
    options = GraphOfConvexSetsOptions(solver=solver)
    result = graph.solve_shortest_path(start, end, options)
    assert not result.is_success
    assert "proven" in result.reason


@pytest.mark.parametrize("solver", ["clarabel", "highs", SCS])
def test_programs_by_each_solver(solver):
    """The largest x + y where x + 2 y <= 4, 3 x + y <= 7: at (2, 1); multipliers 2/5 and 1/5."""
    program = ConicProgram()
    x = program.add_variables(2)
    program.add_linear_cost([-1.0, -1.0], x)
    rows = program.add_linear_inequalities([[1.0, 2.0], [3.0, 1.0]], [4.0, 7.0], x)
    even = program.add_linear_equations([[1.0, -2.0]], [0.0], x)
    found = program.solve(solver)
    np.testing.assert_allclose(found.value(x), [2.0, 1.0], atol=1e-7)
    # One multiplier of three is free; cost and weighted rows balance for any choice.
    weights = np.array([[1.0, 2.0], [3.0, 1.0]]).T @ found.dual(rows)
    weights -= np.array([1.0, -2.0]) * found.dual(even)
    np.testing.assert_allclose(weights, [1.0, 1.0], atol=1e-6)


@pytest.mark.parametrize("solver", ["clarabel", SCS])
def test_matrices_and_exponentials_by_each_solver(solver):
    """Orders of rows differ between solvers: a matrix of three rows with one answer."""
    program = ConicProgram()
    x = program.add_variables(3)
    # [[1, x, y], [x, 1, z], [y, z, 1]] with x = 0.6, y = 0.8: z is at least 0.48 - 0.48.
    F = np.zeros((4, 3, 3))
    F[0] = np.eye(3)
    for k, (i, j) in enumerate(((0, 1), (0, 2), (1, 2)), start=1):
        F[k, i, j] = F[k, j, i] = 1.0
    program.add_positive_semidefinite(F, x)
    program.add_linear_equations(np.eye(3)[:2], [0.6, 0.8], x)
    t = program.add_variables(1)
    program.add_exponential_cone([[0.0], [0.0], [1.0]], [1.0, 1.0, 0.0], t)
    program.add_linear_cost([0.0, 0.0, 1.0, 1.0], np.append(x, t))
    found = program.solve(solver)
    assert found.value(x)[2] == pytest.approx(0.48 - 0.8 * 0.6, abs=1e-5)
    assert found.value(t)[0] == pytest.approx(math.e, rel=1e-6)


def test_settings_reach_their_solver():
    """One iteration is too few for each; of the restriction alone, the relaxation is solved."""
    graph, start, end = around_a_corner()
    few = {"max_iter": 1}
    with pytest.raises(SolverError, match="MaxIterations"):
        graph.solve_shortest_path(start, end, GraphOfConvexSetsOptions(solver_options=few))
    options = GraphOfConvexSetsOptions(
        convex_relaxation=True, restriction_solver="clarabel", restriction_solver_options=few
    )
    result = graph.solve_shortest_path(start, end, options)
    assert not result.is_success
    assert "rounded paths was solved" in result.reason
    assert result.relaxation_cost == pytest.approx(10.0, rel=1e-6)
    with pytest.raises(SolverError, match="MaxIterations"):
        graph.solve_convex_restriction([start.outgoing_edges[0]], options=options)
    # Settings of the whole are those of single paths where these have none and the solver is one.
    one = GraphOfConvexSetsOptions(solver="clarabel", solver_options={"max_iter": 77})
    assert one.of_restriction.options == {"max_iter": 77}
    two = GraphOfConvexSetsOptions(
        solver="highs", solver_options={"presolve": False}, restriction_solver="clarabel"
    )
    assert two.of_restriction == SolverChoice("clarabel", {})


def corner_with(constraint):
    """Return a graph around a corner whose door has a constraint."""
    graph, start, end = around_a_corner(norm1)
    door = start.outgoing_edges[0].v
    door.add_constraint(constraint(door.x))
    return graph, start, end


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (
            lambda: GraphOfConvexSetsOptions(solver="mosek"),
            "solver must be one of 'clarabel', 'highs', 'scs', 'scip', not 'mosek'",
        ),
        (
            lambda: GraphOfConvexSetsOptions(restriction_solver="scip"),
            "restriction_solver must be one of 'clarabel', 'highs', 'scs', not 'scip'",
        ),
        (lambda: GraphOfConvexSetsOptions(preprocessing_solver=3), "preprocessing_solver must be"),
        (lambda: GraphOfConvexSetsOptions(solver_options=[1]), "must be a mapping of their names"),
        (
            lambda: around_a_corner()[0].solve_convex_restriction(
                around_a_corner()[0].edges[:1], options=None
            ),
            "must be edges of this graph",
        ),
        (lambda: ConicProgram().solve("gurobi"), "ConicProgram.solve: solver must be one of"),
    ],
)
def test_names_that_do_not_exist_are_refused_with_those_that_do(ask, message):
    """And options that are none."""
    with pytest.raises(ConvexSetError, match=message):
        ask()


@pytest.mark.parametrize(
    ("options", "constraint", "message"),
    [
        ({"solver_options": {"max_iters": 3}}, None, "'clarabel' has no option 'max_iters'; it"),
        ({"solver_options": {"max_iter": "x"}}, None, "'clarabel': option 'max_iter'"),
        (
            {"solver": "highs", "solver_options": {"tol": 1}},
            None,
            "'highs' has no option 'tol'; it has dual_feasibility_tolerance",
        ),
        ({"solver": "highs"}, lambda x: exp(x[0]) <= 99.0, "'highs' solves linear programs alone"),
        (
            {"solver": "highs"},
            lambda x: positive_semidefinite(np.zeros((3, 2, 2)), x),
            "'highs' solves linear programs alone",
        ),
    ],
)
def test_what_a_solver_does_not_know_is_refused(options, constraint, message):
    """With its name, and what it has."""
    graph, start, end = corner_with(constraint or (lambda x: x[0] <= 9.0))
    with pytest.raises(ConvexSetError, match=message):
        graph.solve_shortest_path(start, end, GraphOfConvexSetsOptions(**options))


@pytest.mark.parametrize(("solver", "package"), [("scs", "scs"), ("scip", "pyscipopt")])
def test_without_its_package_the_error_says_what_to_install(monkeypatch, solver, package):
    """When the options are made."""
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == package else find(name)
    )
    with pytest.raises(ConvexSetError, match=f"not installed: pip install {package}"):
        GraphOfConvexSetsOptions(solver=solver)


WAYS = ["sc", "cu", "ut", "uv", "vc", "sv", "ct"]
"""From s to t; who goes from u to v came over c, and gets on over c alone."""


def test_flows_leave_out_what_walks_of_the_graph_do_not_see():
    """The edge from u to v; each of the others is on one of three simple paths."""
    names = "scuvt"
    tails, heads = (np.array([names.index(e[k]) for e in WAYS]) for k in (0, 1))
    network = Network(5, tails, heads, 0, 4)
    assert network.on_simple_paths().tolist() == [0, 1, 2, 3, 4, 5, 6]
    for solver in ("clarabel", "highs"):
        assert on_disjoint_ways(network, SolverChoice(solver)).tolist() == [0, 1, 2, 4, 5, 6]


@pytest.mark.parametrize("seed", range(6))
def test_flows_keep_every_edge_of_a_simple_path(seed):
    """Against all simple paths of random graphs, which are listed."""
    rng = np.random.default_rng(seed)
    pairs = [p for p in itertools.permutations(range(6), 2) if rng.random() < 0.35]
    tails, heads = np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])
    network = Network(6, tails, heads, 0, 5)
    on_paths: set[int] = set()

    def walk(at, path, seen):
        if at == 5:
            on_paths.update(path)
            return
        for e in network.leaving[at]:
            if heads[e] not in seen:
                walk(int(heads[e]), [*path, e], seen | {int(heads[e])})

    walk(0, [], {0})
    kept = set(on_disjoint_ways(network, SolverChoice("highs")).tolist())
    assert on_paths <= kept
    assert len(kept) <= len(on_paths) + 2


def test_preprocessing_by_a_solver_is_an_option():
    """It leaves six edges of seven."""
    graph = GraphOfConvexSets()
    at = {name: graph.add_vertex(Point([float(k)]), name) for k, name in enumerate("scuvt")}
    for u, v in WAYS:
        joined(graph, at[u], at[v])
    counts = [
        graph.solve_shortest_path(
            at["s"], at["t"], GraphOfConvexSetsOptions(preprocessing_solver=solver)
        ).num_edges_solved
        for solver in (None, "clarabel", "highs")
    ]
    assert counts == [7, 6, 6]


def rooms(seed):
    """Return a graph of boxes joined at random, some both ways, and its first and last."""
    rng = np.random.default_rng(seed)
    graph = GraphOfConvexSets()
    boxes = []
    for _ in range(7):
        low = rng.uniform(0.0, 3.0, 2)
        boxes.append(graph.add_vertex(HPolyhedron.make_box(low, low + rng.uniform(0.2, 1.5, 2))))
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([4.0, 4.0]))
    for u, v in itertools.permutations(boxes, 2):
        if rng.random() < 0.4:
            joined(graph, u, v)
    for vertex in boxes:
        if rng.random() < 0.5:
            joined(graph, start, vertex)
        if rng.random() < 0.5:
            joined(graph, vertex, end)
        vertex.add_cost(float(rng.uniform(0.0, 0.3)))
    return graph, start, end


@needs("pyscipopt")
@pytest.mark.parametrize("seed", range(4))
def test_scip_finds_what_the_search_proves(seed):
    """Two methods that share no code but the program: integers, and a search by bounds."""
    graph, start, end = rooms(seed)
    if seed % 2:
        # One that is not on the best path, so that it has to be made a part of it.
        free = graph.solve_shortest_path(start, end)
        for edge in graph.edges:
            edge.add_phi_constraint(True)
            if edge.id not in free.path and graph.solve_shortest_path(start, end).is_success:
                break
            edge.clear_phi_constraints()
    ours = graph.solve_shortest_path(start, end)
    scip = graph.solve_shortest_path(start, end, GraphOfConvexSetsOptions(solver="scip"))
    assert ours.is_success
    assert scip.cost == pytest.approx(ours.cost, rel=1e-5)
    # It keeps squares to a tolerance, of which short lengths are the root.
    assert scip.solver_bound == pytest.approx(ours.cost, rel=1e-3)
    assert scip.lower_bound <= ours.cost
    assert "solver_bound is not proven" in scip.reason


@needs("pyscipopt")
def test_what_scip_does_not_take_is_refused():
    """The relaxation, matrices, names of settings, graphs that are made on the way."""
    with pytest.raises(ConvexSetError, match="'scip' solves the exact problem"):
        GraphOfConvexSetsOptions(solver="scip", convex_relaxation=True)
    options = GraphOfConvexSetsOptions(solver="scip")
    graph, start, end = corner_with(lambda x: positive_semidefinite(np.zeros((3, 2, 2)), x))
    with pytest.raises(ConvexSetError, match="second-order cones, not SEMIDEFINITE"):
        graph.solve_shortest_path(start, end, options)
    graph, start, end = around_a_corner()
    wrong = GraphOfConvexSetsOptions(solver="scip", solver_options={"limits/tiem": 1.0})
    with pytest.raises(ConvexSetError, match="'limits/tiem'"):
        graph.solve_shortest_path(start, end, wrong)
    short = GraphOfConvexSetsOptions(solver="scip", solver_options={"limits/nodes": 0})
    with pytest.raises(SolverError, match="ended without a solution"):
        graph.solve_shortest_path(start, end, short)

    class One(ImplicitGraphOfConvexSets):
        """A point alone."""

        def do_successors(self, v):
            """Lead nowhere."""
            return []

    implicit = One()
    point = implicit.gcs.add_vertex(Point([0.0]))
    with pytest.raises(ConvexSetError, match="'scip' takes a whole graph"):
        implicit.solve_shortest_path(point, lambda v: False, options)


@needs("pyscipopt")
def test_scip_says_where_there_is_none():
    """Constraints that contradict each other are proven before it is asked."""
    graph, start, end = corner_with(lambda x: x[1] >= 20.0)
    start.outgoing_edges[1].add_constraint(start.outgoing_edges[1].xv[1] >= 3.0)
    result = graph.solve_shortest_path(start, end, GraphOfConvexSetsOptions(solver="scip"))
    assert not result.is_success

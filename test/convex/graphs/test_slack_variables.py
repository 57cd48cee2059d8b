"""Slack variables of edges and vertices, with optima derived by hand.

The usual graph: from the box [0, 1]^2 to the box [3, 4] x [2, 3], and on to the point (6, 2).
In 1-norms from the first box to the point it is 5 + 1: along x from 1 to 6, along y from 1 to 2.
"""

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    exp,
    FunctionConstraint,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    Hyperrectangle,
    ImplicitGraphOfConvexSets,
    norm,
    Point,
    Transcription,
)


def boxes():
    """Return the usual graph, its vertices and edges; only (1.5, 2) to the point has a cost."""
    graph = GraphOfConvexSets()
    vertices = [
        graph.add_vertex(Hyperrectangle([0.0, 0.0], [1.0, 1.0]), "start"),
        graph.add_vertex(Hyperrectangle([3.0, 2.0], [4.0, 3.0]), "box"),
        graph.add_vertex(Point([6.0, 2.0]), "goal"),
    ]
    edges = [graph.add_edge(vertices[0], vertices[1]), graph.add_edge(vertices[1], vertices[2])]
    return graph, vertices, edges


def add_norm1(edge, bound):
    """Give an edge the 1-norm of its step as cost, by slack variables that are at least |step|."""
    s = edge.new_slack_variables(2, "at least |step|", -bound, bound)
    step = edge.xv - edge.xu
    edge.add_constraint(s >= step)
    edge.add_constraint(s >= -step)
    return edge.add_cost(s.sum())


@pytest.mark.parametrize("bound", [np.inf, 20.0])
@pytest.mark.parametrize("relaxed", [False, True])
@pytest.mark.usefixtures("both_ways_to_paths")
def test_edges_cost_the_sum_of_their_slack_variables(bound, relaxed):
    """The 1-norm by hand is 6; so says the bound, and the variables are the steps' lengths."""
    graph, (start, box, goal), edges = boxes()
    costs = [add_norm1(edge, bound) for edge in edges]
    options = GraphOfConvexSetsOptions(convex_relaxation=relaxed)
    result = graph.solve_shortest_path(start, goal, options)
    assert result.cost == pytest.approx(6.0, rel=1e-6)
    assert result.lower_bound == pytest.approx(6.0, rel=1e-6)
    assert result.lower_bound <= 6.0
    assert result.path == tuple(edge.id for edge in edges)
    assert result.vertices == (start.id, box.id, goal.id)
    assert [len(x) for x in result.points] == [2, 2, 2]
    total = 0.0
    for edge, cost in zip(edges, costs, strict=True):
        step = edge.v.get_solution(result) - edge.u.get_solution(result)
        s = edge.get_solution_slack_variables(result)
        np.testing.assert_allclose(s, np.abs(step), atol=1e-5)
        total += edge.get_solution_cost(result, cost)
        assert edge.get_solution_cost(result) == pytest.approx(s.sum(), abs=1e-6)
    assert total == pytest.approx(6.0, rel=1e-6)
    given = graph.solve_convex_restriction(edges)
    assert given.cost == pytest.approx(6.0, rel=1e-6)
    assert [e.get_solution_phi(result) for e in edges] == pytest.approx([1.0, 1.0])
    np.testing.assert_allclose(edges[1].get_solution_phi_xv(result), [6.0, 2.0], atol=1e-6)
    assert set(result.flows) == {e.id for e in edges}


def test_a_vertex_and_an_edge_have_slack_variables_in_curved_terms():
    """``t >= |x|`` at the box costs t, at (3, 2) sqrt(13); the edge costs exp(s), s >= 1 - x_v."""
    graph, (start, box, goal), (into, _) = boxes()
    t = box.new_slack_variables(1)
    box.add_constraint(norm(box.x) <= t)
    box.add_cost(t)
    s = into.new_slack_variables(1)
    into.add_constraint(s >= 1.0 - into.xu[0])
    into.add_constraint(s <= 5.0)
    into.add_cost(exp(s))
    result = graph.solve_shortest_path(start, goal)
    # Nothing else costs: x_u = (1, .), s = 0 and x_v = (3, 2).
    assert result.cost == pytest.approx(np.sqrt(13.0) + 1.0, rel=1e-6)
    np.testing.assert_allclose(box.get_solution(result), [3.0, 2.0], atol=1e-4)
    assert box.get_solution_slack_variables(result) == pytest.approx([np.sqrt(13.0)], rel=1e-6)
    assert box.get_solution_cost(result) == pytest.approx(np.sqrt(13.0), rel=1e-6)
    assert into.get_solution_slack_variables(result) == pytest.approx([0.0], abs=1e-6)


def test_a_relaxation_without_paths_has_the_flows_mean_of_slack_variables():
    """From a point over two points at -1 and +1, to one that both cost s >= 2 x: -2 and 2.

    The flow through +1 costs 2 and that through -1 costs 0, as costs count from 0 on; all flow
    takes that one, where s is at least -2 and the vertex's t is exactly x = -1.
    """
    graph = GraphOfConvexSets()
    start, goal = graph.add_vertex(Point([0.0])), graph.add_vertex(Point([5.0]))
    sides = {x: graph.add_vertex(Point([x])) for x in (-1.0, 1.0)}
    into = {}
    for x, side in sides.items():
        into[x] = graph.add_edge(start, side)
        s = into[x].new_slack_variables(1, "", -3.0, 3.0)
        into[x].add_constraint(s == 2.0 * into[x].xv)
        into[x].add_cost(s)
        t = side.new_slack_variables(1)
        side.add_constraint(t == side.x)
        graph.add_edge(side, goal)
    options = GraphOfConvexSetsOptions(convex_relaxation=True, max_rounded_paths=0)
    result = graph.solve_shortest_path(start, goal, options)
    assert not result.is_success
    assert result.relaxation_cost == pytest.approx(0.0, abs=1e-7)
    assert into[-1.0].get_solution_phi(result) == pytest.approx(1.0, abs=1e-6)
    assert into[-1.0].get_solution_slack_variables(result) == pytest.approx([-2.0], abs=1e-5)
    assert sides[-1.0].get_solution_slack_variables(result) == pytest.approx([-1.0], abs=1e-5)
    found = graph.solve_shortest_path(start, goal)
    assert found.vertices == (start.id, sides[-1.0].id, goal.id)
    assert into[1.0].get_solution_slack_variables(found) is None
    assert sides[1.0].get_solution_slack_variables(found) is None
    assert into[-1.0].get_solution_cost(found, into[-1.0].get_costs()[0]) == 0.0


def test_functions_take_points_and_then_slack_variables():
    """Of a restriction: with s free, (s - x)^2 and s = 3 pull a point of [0, 4] to 3.

    The second function sees all slack variables of its edge: s and r, which has to be s / 2.
    """
    graph = GraphOfConvexSets()
    start, goal = graph.add_vertex(Point([0.0])), graph.add_vertex(Hyperrectangle([0.0], [4.0]))
    edge = graph.add_edge(start, goal)
    s, r = (edge.new_slack_variables(1, name, -9.0, 9.0) for name in "sr")
    edge.add_constraint(s == 3.0)
    seen = []

    def cost(xu, xv, slack):
        seen.append((np.shape(xu), np.shape(xv), np.shape(slack)))
        return (slack[0] - xv[0]) ** 2

    alone = {Transcription.RESTRICTION}
    added = edge.add_cost(cost, alone)
    edge.add_constraint(
        FunctionConstraint(lambda xu, xv, slack: slack[0] - 2.0 * slack[1], 0.0, 0.0), alone
    )
    goal.add_cost(lambda x: 0.0 * x[0], alone)
    result = graph.solve_convex_restriction([edge], initial_guess={start: [0.0], goal: [1.0]})
    assert result.points[1] == pytest.approx([3.0], abs=1e-4)
    np.testing.assert_allclose(edge.get_solution_slack_variables(result), [3.0, 1.5], atol=1e-4)
    assert set(result.slack_variables) == {*s.terms, *r.terms}
    assert edge.get_solution_cost(result, added) == pytest.approx(0.0, abs=1e-7)
    assert seen[-1] == ((1,), (1,), (2,))
    again = graph.solve_convex_restriction([edge], initial_guess=result)
    assert again.points[1] == pytest.approx([3.0], abs=1e-4)


def test_templates_and_clones_have_slack_variables_of_their_own():
    """A clone keeps the numbers; a template's are new, and neither takes the other's."""
    graph, (start, _, goal), edges = boxes()
    for edge in edges:
        add_norm1(edge, 20.0)
    copy = graph.clone()
    ends = copy.vertices[0], copy.vertices[2]
    result = copy.solve_shortest_path(*ends)
    assert result.cost == pytest.approx(6.0, rel=1e-6)
    np.testing.assert_allclose(
        edges[0].get_solution_slack_variables(result),
        copy.edges[0].get_solution_slack_variables(result),
    )
    fresh = copy.add_vertex(Point([6.0, 2.0])).id
    taken = {n for each in copy.edges for s in each.slack_variables for n in s.terms}
    assert fresh not in taken
    direct = graph.add_edge_from_template(start, goal, edges[0])
    numbers = [set(each.slack_variables[0].terms) for each in (edges[0], direct)]
    assert not numbers[0] & numbers[1]
    assert graph.solve_convex_restriction([direct]).cost == pytest.approx(6.0, rel=1e-6)
    with pytest.raises(ConvexSetError, match="slack variables of its own may be in it"):
        direct.add_cost(edges[0].slack_variables[0].sum())


def test_slack_variables_of_a_graph_that_grows():
    """An implicit chain of points 0, 1, 2, 3: each step costs s >= 2 |step|, in all 6."""

    class Chain(ImplicitGraphOfConvexSets):
        def do_successors(self, v):
            x = float(v.set.x[0])
            if x >= 3.0:
                return []
            edge = self.gcs.add_edge(v, self.gcs.add_vertex(Point([x + 1.0])))
            s = edge.new_slack_variables(1, "", 0.0, 10.0)
            edge.add_constraint(s >= 2.0 * (edge.xv - edge.xu))
            edge.add_cost(s)
            t = edge.v.new_slack_variables(1, "", 0.0, 10.0)
            edge.v.add_constraint(t == edge.v.x)
            return [edge]

    for heuristic in (None, lambda v: norm(2.0 * (v.x - 3.0))):
        chain = Chain()
        start = chain.gcs.add_vertex(Point([0.0]))
        found = chain.solve_shortest_path(
            start, lambda v: float(v.set.x[0]) == 3.0, heuristic=heuristic, max_successor_calls=3
        )
        assert found.cost == pytest.approx(6.0, rel=1e-6)
        assert found.num_edges_solved == 3
        assert len(found.path) == 3
        last = chain.gcs.edges[-1]
        assert last.get_solution_slack_variables(found) == pytest.approx([2.0], abs=1e-5)
        assert last.v.get_solution_slack_variables(found) == pytest.approx([3.0], abs=1e-5)


def test_a_path_of_one_vertex_and_forced_edges():
    """Staying costs the vertex's t >= 2 - x, at x = 1; a forced edge with slack is on the path."""
    graph, (start, _, goal), (into, _) = boxes()
    t = start.new_slack_variables(1)
    start.add_constraint(t >= 2.0 - start.x[0])
    start.add_cost(t)
    staying = graph.solve_shortest_path(start, start)
    assert staying.cost == pytest.approx(1.0, rel=1e-6)
    assert start.get_solution_slack_variables(staying) == pytest.approx([1.0], rel=1e-6)
    assert staying.points[0].shape == (2,)
    direct = graph.add_edge(start, goal)
    into.new_slack_variables(1, "", 0.0, 1.0)
    into.add_cost(4.0)
    assert graph.solve_shortest_path(start, goal).path == (direct.id,)
    into.add_phi_constraint(True)
    forced = graph.solve_shortest_path(start, goal)
    assert into.id in forced.path
    assert forced.cost == pytest.approx(5.0, rel=1e-6)
    into.clear_phi_constraints()
    into.add_phi_constraint(False)
    direct.add_cost(9.0)
    assert graph.solve_shortest_path(start, goal).cost == pytest.approx(10.0, rel=1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0,), "rows must be a whole number, at least 1 and at most 10000, not 0"),
        ((10_001,), "rows must be a whole number, at least 1 and at most 10000, not 10001"),
        ((True,), "rows must be a whole number"),
        ((1.5,), "rows must be a whole number"),
        ((2, "", [0.0, 0.0, 0.0]), "lower_bound must be a number or 2 numbers"),
        ((1, "", np.nan), "lower_bound must be a number or 1 numbers"),
        ((1, "", 2.0, 1.0), "lower_bound .2.0. must be at most upper_bound .1.0."),
        ((1, "", "low"), "lower_bound"),
        ((1, "", np.inf), "must be at most"),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    """Counts and bounds that are none are refused, and nothing is added."""
    _, (start, _, _), (edge, _) = boxes()
    for part in (start, edge):
        with pytest.raises(ConvexSetError, match=message):
            part.new_slack_variables(*arguments)
        assert part.slack_variables == []


def test_slack_variables_that_nothing_bounds_are_said():
    """A path is found with the bound 0, and the reason names the edge."""
    graph, (start, _, goal), (into, out) = boxes()
    out.add_cost(norm(out.xv - out.xu))
    into.new_slack_variables(1)
    result = graph.solve_shortest_path(start, goal)
    assert result.is_success
    assert "and its slack variables" in result.reason
    assert result.lower_bound == 0.0

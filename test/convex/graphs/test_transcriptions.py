"""What counts in the exact problem, the relaxation and along single paths; cones, functions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    FunctionConstraint,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    Hyperellipsoid,
    Hyperrectangle,
    norm,
    norm1,
    norm_inf,
    Point,
    quad_form,
    SolverError,
    sum_squares,
    Transcription,
)

pytestmark = pytest.mark.usefixtures("both_ways_to_paths")

RELAXED = GraphOfConvexSetsOptions(convex_relaxation=True)
MIP, RELAXATION, RESTRICTION = Transcription


def through(middle, start=(0.0, 0.0), goal=(4.0, 0.0)):
    """Return a graph of two points with a set between them, whose edges cost their lengths."""
    graph = GraphOfConvexSets()
    s, m, t = map(graph.add_vertex, (Point(start), middle, Point(goal)))
    edges = [graph.add_edge(u, v) for u, v in ((s, m), (m, t))]
    for edge in edges:
        edge.add_cost(norm(edge.xv - edge.xu))
    return graph, (s, m, t), edges


BOX = Hyperrectangle([1.0, -2.0], [3.0, 2.0])
DETOUR = 2.0 * math.hypot(2.0, 0.5)
"""By way of (2, 0.5)."""


@pytest.mark.parametrize(
    ("constraint", "truth"),
    [
        # A disc and a square about (2, 1) of "radius" 0.5, an ellipse, and what is slack.
        (lambda x: norm(x - [2.0, 1.0]) <= 0.5, DETOUR),
        (lambda x: 2.0 * norm(x - [2.0, 1.0]) + 1.0 <= 2.0, DETOUR),
        (lambda x: sum_squares(x - [2.0, 1.0]) <= 0.25, DETOUR),
        (lambda x: norm_inf(x - [2.0, 1.0]) <= 0.5, DETOUR),
        (lambda x: quad_form(x - [2.0, 1.0], np.diag([1.0, 4.0])) <= 1.0, DETOUR),
        (lambda x: norm(x - [2.0, 1.0]) <= x[0] - 1.0, 4.0),
        (lambda x: norm(x - [2.0, 1.0]) <= 1.5, 4.0),
    ],
)
def test_norms_at_most_an_affine_number_are_constraints(constraint, truth):
    """By geometry: the nearest point of a disc about (2, 1) to the straight way is below it."""
    graph, (s, m, t), _ = through(BOX)
    m.add_constraint(constraint(m.x))
    for options in (None, RELAXED):
        result = graph.solve_shortest_path(s, t, options)
        # norm <= x - 1 is right of a parabola through (2, 0) where it touches the straight way.
        assert result.cost == pytest.approx(truth, rel=1e-7)
        assert truth * (1.0 - 1e-7) <= result.lower_bound <= truth * (1.0 + 1e-12)
        assert result.violation <= 1e-7
        assert result.relaxation_bound.verify()


def test_cones_that_no_path_keeps_are_proven():
    """A disc that is outside of the set."""
    graph, (s, m, t), _ = through(BOX)
    m.add_constraint(norm(m.x - [9.0, 9.0]) <= 1.0)
    result = graph.solve_shortest_path(s, t)
    assert not result.is_success
    assert "proven" in result.reason


def test_each_transcription_has_its_own_costs_and_constraints():
    """A toll counts in one of the three programs, or in all."""
    graph, (s, m, t), (first, second) = through(BOX)
    assert first.add_cost(8.0, MIP) in first.get_costs()
    first.add_cost(0.5, {RELAXATION, RESTRICTION})
    second.add_constraint(m.x[1] >= 0.5, RESTRICTION)
    assert graph.solve_shortest_path(s, t).cost == pytest.approx(12.0, rel=1e-6)
    rounded = graph.solve_shortest_path(s, t, RELAXED)
    assert rounded.cost == pytest.approx(DETOUR + 0.5, rel=1e-7)
    assert rounded.lower_bound == pytest.approx(4.5, rel=1e-6)
    alone = graph.solve_convex_restriction([first, second])
    assert alone.cost == pytest.approx(DETOUR + 0.5, rel=1e-7)
    assert first.get_solution_cost(alone) == pytest.approx(DETOUR / 2.0 + 0.5, rel=1e-6)
    assert first.get_solution_cost(alone, first.get_costs(MIP)[1]) == 8.0
    assert [len(first.get_costs(t)) for t in Transcription] == [2, 2, 2]
    assert [len(second.get_constraints(t)) for t in Transcription] == [0, 0, 1]


def test_vertices_tell_what_they_cost():
    """Of a path that visits them; one cost at a time on request."""
    graph, (s, m, t), _ = through(BOX)
    cost = m.add_cost(0.1 * norm(m.x - [2.0, 1.0]))
    m.add_cost(0.25)
    other = graph.add_vertex(Point([0.0, 9.0]))
    result = graph.solve_shortest_path(s, t)
    # The length changes by as much as this cost where 2 y / sqrt(4 + y^2) = 0.1.
    y = 0.2 / math.sqrt(4.0 - 0.01)
    assert m.get_solution_cost(result) == pytest.approx(0.1 * (1.0 - y) + 0.25, abs=1e-3)
    rest = m.get_solution_cost(result) - m.get_solution_cost(result, cost)
    assert rest == pytest.approx(0.25, rel=1e-12)
    assert (s.get_solution_cost(result), other.get_solution_cost(result)) == (0.0, None)
    with pytest.raises(ConvexSetError, match="cost must be one of"):
        m.get_solution_cost(result, 3.0)


@pytest.mark.parametrize("preprocessing", [True, False])
def test_flows_of_a_relaxation_have_their_costs(preprocessing):
    """Without a path, each part costs its flow's share; together that is the relaxation's cost."""
    graph = GraphOfConvexSets()
    s, t = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([4.0, 0.0]))
    doors = [graph.add_vertex(Hyperrectangle([2.0, y], [2.0, y + 1.0])) for y in (0.5, -1.5)]
    s.add_cost(0.125)
    squares = []
    for door in doors:
        door.add_cost(0.25)
        for u, v in ((s, door), (door, t), (door, s)):
            edge = graph.add_edge(u, v)
            squares.append(edge.add_cost(sum_squares(edge.xv - edge.xu)))
            edge.add_cost(1.0, Transcription.MIP)
    aside = graph.add_vertex(Point([9.0, 9.0]))
    options = GraphOfConvexSetsOptions(
        convex_relaxation=True, max_rounded_paths=0, preprocessing=preprocessing
    )
    result = graph.solve_shortest_path(s, t, options)
    assert not result.is_success
    # Over (2, 0.5) or (2, -0.5) or both: two squares of 4.25 each.
    assert result.relaxation_cost == pytest.approx(8.5 + 0.25 + 0.125, rel=1e-6)
    assert sum(door.get_solution_cost(result) for door in doors) == pytest.approx(0.25, rel=1e-6)
    assert s.get_solution_cost(result) == pytest.approx(0.125, rel=1e-6)
    assert t.get_solution_cost(result) == 0.0
    assert aside.get_solution_cost(result) is None
    kept = [e for e in graph.edges if e.get_solution_phi(result) is not None]
    assert len(kept) == (4 if preprocessing else 6)
    for edge in kept:
        phi = edge.get_solution_phi(result)
        share = 0.0 if edge.v is s else 4.25 * phi
        assert edge.get_solution_cost(result) == pytest.approx(share, abs=1e-5)
        assert edge.get_solution_cost(result, edge.get_costs()[0]) == pytest.approx(
            share, abs=1e-5
        )
    with pytest.raises(ConvexSetError, match="cost must be one of"):
        kept[0].get_solution_cost(result, squares[-1])


def test_surrogates_are_not_in_the_bound():
    """What the relaxation asks and paths need not keep says nothing of what they cost."""
    graph, (s, m, t), _ = through(BOX)
    m.add_constraint(m.x[1] >= 0.5, RELAXATION)
    result = graph.solve_shortest_path(s, t, RELAXED)
    assert result.cost == pytest.approx(4.0, rel=1e-7)
    assert result.lower_bound == pytest.approx(4.0, rel=1e-7)
    assert result.relaxation_bound.value == result.lower_bound
    assert result.relaxation_bound.verify()
    # Costs that are functions may be less than anything that the relaxation knows.
    m.add_cost(lambda x: 0.0, RESTRICTION)
    assert graph.solve_shortest_path(s, t, RELAXED).lower_bound == -np.inf


def outside_of_a_circle(x):
    """Return the squared distance from (2, 0)."""
    return (x[0] - 2.0) ** 2 + x[1] ** 2


def test_functions_need_not_be_convex():
    """Around a circle of radius 1 in a narrower set: straight to its tip and on, by geometry."""
    graph, (s, m, t), edges = through(Hyperrectangle([1.5, -2.0], [2.5, 2.0]))
    m.add_constraint(FunctionConstraint(outside_of_a_circle, 1.0, np.inf), RESTRICTION)
    # Where x = 1.5 the circle is at y = sqrt(0.75).
    truth = math.hypot(1.5, math.sqrt(0.75)) + math.hypot(2.5, math.sqrt(0.75))
    best = graph.solve_convex_restriction(edges)
    assert best.cost == pytest.approx(truth, rel=1e-6)
    assert 4.0 - 1e-6 <= best.lower_bound <= truth
    assert best.violation <= 1e-7
    rounded = graph.solve_shortest_path(s, t, RELAXED)
    assert rounded.cost == pytest.approx(truth, rel=1e-6)
    # The exact problem does not know of it.
    assert graph.solve_shortest_path(s, t).cost == pytest.approx(4.0, rel=1e-6)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_guess_says_on_which_side(side):
    """The nearest solution to it is found."""
    graph, (s, m, t), edges = through(Hyperrectangle([1.9, -2.0], [2.1, 2.0]))
    m.add_constraint(FunctionConstraint(outside_of_a_circle, 1.0, 9.0), RESTRICTION)
    guess = {s: [0.0, 0.0], m: [2.0, 1.5 * side], t: [4.0, 0.0]}
    found = graph.solve_convex_restriction(edges, None, guess)
    assert found.points[1][1] * side > 0.9
    again = graph.solve_convex_restriction(edges, None, found)
    assert again.cost == pytest.approx(found.cost, rel=1e-9)


def test_functions_cost():
    """Of both points of an edge."""
    disc = Hyperellipsoid.make_hypersphere(1.0, [2.0, 1.5])
    graph, _, (first, second) = through(disc)
    cost = first.add_cost(lambda xu, xv: 0.5 * (xv[0] - xu[0]) ** 2, RESTRICTION)
    found = graph.solve_convex_restriction([first, second])
    x = found.points[1]
    assert first.get_solution_cost(found, cost) == pytest.approx(0.5 * x[0] ** 2, rel=1e-9)
    assert found.lower_bound == -np.inf
    # Against a fine search around the disc's edge and inside.
    angles, radii = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 721), np.linspace(0.0, 1.0, 101))
    X, Y = 2.0 + radii * np.cos(angles), 1.5 + radii * np.sin(angles)
    least = (np.hypot(X, Y) + np.hypot(4.0 - X, Y) + 0.5 * X**2).min()
    assert least - 1e-3 <= found.cost <= least + 1e-6


def test_functions_that_no_points_keep_are_an_error_with_what_is_left():
    """Nothing was proven, so it is no answer."""
    graph, _, edges = through(BOX)
    edges[0].add_constraint(FunctionConstraint(lambda xu, xv: xv[0], 8.0, 9.0), RESTRICTION)
    with pytest.raises(SolverError, match="break a set or a constraint by"):
        graph.solve_convex_restriction(edges)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda m: m.add_cost(1.0, []), "use_in_transcription must have one Transcription"),
        (lambda m: m.add_cost(1.0, {1}), "use_in_transcription must have one Transcription"),
        (lambda m: m.get_costs([]), "used_in_transcription must have"),
        (lambda m: m.add_cost(len), "is a function, which has no relaxation"),
        (
            lambda m: m.add_constraint(FunctionConstraint(len, 0.0, 1.0), {MIP, RESTRICTION}),
            "is a function, which has no relaxation",
        ),
        (lambda m: FunctionConstraint(3, 0.0, 1.0), "function must be callable"),
        (lambda m: FunctionConstraint(len, 1.0, 0.0), r"lower_bound \[1.0\] must be at most"),
        (lambda m: FunctionConstraint(len, np.nan, 0.0), "lower_bound"),
        (lambda m: FunctionConstraint(len, [0.0], [0.0, 1.0]), "bounds have the shapes"),
        (lambda m: norm1(m.x) <= 1.0, "takes one norm or sum of squares, not 2"),
        (lambda m: norm(m.x) <= norm(m.x), "right side of <= must be a number or affine"),
    ],
)
def test_what_is_refused_is_named(wrong, message):
    """With what was given."""
    _, (_, m, _), _ = through(BOX)
    with pytest.raises(ConvexSetError, match=message):
        wrong(m)


@pytest.mark.parametrize("value", [np.nan, [1.0, 2.0], "x"])
def test_what_a_function_returns_is_checked(value):
    """It must be one number here."""
    graph, _, edges = through(BOX)
    edges[0].add_cost(lambda xu, xv: value, RESTRICTION)
    with pytest.raises(ConvexSetError, match="returns"):
        graph.solve_convex_restriction(edges)

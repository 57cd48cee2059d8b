"""Unbounded sets: paths as through bounded ones, with bounds that hold beyond every box."""

from __future__ import annotations

import itertools
import math

from graphs_of_sets import check, joined, RELAXED
import numpy as np
import pytest

from scene_graph_ros.convex.graphs.expressions.transcription import ALL_TRANSCRIPTIONS
from scene_graph_ros.convex.graphs.search.path_extents import extents_of_paths
from scene_graph_ros.geometry.optimization import (
    AffineSubspace,
    CartesianProduct,
    ConvexSetError,
    GraphOfConvexSets,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    ImplicitGraphOfConvexSets,
    MinkowskiSum,
    norm,
    norm_inf,
    Point,
    quad_over_lin,
    Spectrahedron,
    sum_squares,
    Transcription,
)

PLANE = HPolyhedron(np.zeros((0, 2)), np.zeros(0))
ABOVE = HPolyhedron([[0.0, -1.0]], [-3.0])
"""Where y is at least 3."""

SETS = {
    "half plane": ABOVE,
    "wedge": HPolyhedron([[0.0, -1.0], [1.0, -2.0]], [-3.0, 4.0]),
    "line": AffineSubspace([[1.0], [0.0]], [0.0, 3.0]),
    "slab of an ellipsoid": Hyperellipsoid([[0.0, 1.0]], [0.0, 4.0]),
    "parabola": Spectrahedron(
        # Where (y - 3) is at least (x - 4)^2.
        [[[-3.0, -4.0], [-4.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]]]
    ),
    "rounded quadrant": MinkowskiSum(
        HPolyhedron([[-1.0, 0.0], [0.0, -1.0]], [-1.0, -4.0]),
        Hyperellipsoid.make_unit_ball(2),
    ),
}


@pytest.mark.parametrize(
    ("kind", "scale"),
    [*((kind, 1.0) for kind in SETS), ("half plane", 1e-3), ("half plane", 1e4)],
)
def test_each_kind_is_passed_where_it_is_nearest(kind, scale):
    """From (0, 0) to (8, 0) over (4, 3): two sides 5 of 3-4-5 triangles, in any unit."""
    graph = GraphOfConvexSets()
    start, goal = (graph.add_vertex(Point([x * scale, 0.0])) for x in (0.0, 8.0))
    middle = graph.add_vertex(
        SETS[kind] if scale == 1.0 else HPolyhedron([[0.0, -1.0]], [-3.0 * scale])
    )
    edges = [joined(graph, start, middle), joined(graph, middle, goal)]
    results = [graph.solve_shortest_path(start, goal, options) for options in (None, RELAXED)]
    for result in (*results, graph.solve_convex_restriction(edges)):
        check(result, 10.0 * scale, 1e-6)
        np.testing.assert_allclose(result.points[1], [4.0 * scale, 3.0 * scale], atol=1e-3 * scale)


@pytest.mark.parametrize("count", [1, 4])
def test_a_chain_of_planes_is_crossed_straight(count):
    """Sets that are everything leave the straight way."""
    graph = GraphOfConvexSets()
    chain = [graph.add_vertex(Point([1.0, 1.0]))]
    chain += [graph.add_vertex(PLANE) for _ in range(count)]
    chain.append(graph.add_vertex(Point([4.0, 5.0])))
    for u, v in itertools.pairwise(chain):
        joined(graph, u, v)
    for options in (None, RELAXED):
        check(graph.solve_shortest_path(chain[0], chain[-1], options), 5.0)


def test_planes_on_circles_are_bounded_by_what_a_path_costs():
    """Nine planes joined both ways: no path leaves an ellipse around its ends, by geometry."""
    graph = GraphOfConvexSets()
    cells = {at: graph.add_vertex(PLANE) for at in itertools.product(range(3), repeat=2)}
    start, goal = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([3.0, 4.0]))
    joined(graph, start, cells[0, 0])
    joined(graph, cells[2, 2], goal)
    for a, b in itertools.permutations(cells, 2):
        if abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1:
            joined(graph, cells[a], cells[b])
    check(graph.solve_shortest_path(start, goal), 5.0)
    boxes = extents_of_paths(graph.vertices, graph.edges, (start, goal), ALL_TRANSCRIPTIONS, 6.0)
    for low, high in boxes.values():
        # Of all points whose distances to both ends add up to 6, none is further.
        assert (low >= [-6.0 - 1e-6, -6.0 - 1e-6]).all()
        assert (high <= [9.0 + 1e-6, 10.0 + 1e-6]).all()


def test_boxes_hold_every_point_that_a_path_can_have():
    """At random points of cheap enough paths, over each kind of cost and constraint."""
    rng = np.random.default_rng(5)
    for trial in range(12):
        graph = GraphOfConvexSets()
        start, goal = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([1.0, 0.5]))
        middle = [graph.add_vertex(PLANE) for _ in range(2)]
        edges = []
        for u, v in itertools.pairwise([start, *middle, goal]):
            edge = graph.add_edge(u, v)
            step = rng.normal(size=(2, 2)) @ (edge.xv - edge.xu) + rng.normal(size=2) * 0.1
            edge.add_cost((norm, sum_squares, norm_inf)[trial % 3](step))
            edges.append(edge)
        edges[1].add_constraint(norm(edges[1].xv - edges[1].xu) <= 2.0)
        edges[1].add_constraint(rng.normal(size=2) @ edges[1].xv <= 3.0)
        limit = 10.0 ** rng.uniform(-0.5, 1.0)
        boxes = extents_of_paths(
            graph.vertices, graph.edges, (start, goal), ALL_TRANSCRIPTIONS, limit
        )
        inside = 0
        for _ in range(2000):
            x = 10.0 ** rng.uniform(-1.0, 1.0) * rng.normal(size=(2, 2)) + [0.5, 0.2]
            points = dict(
                zip((v.id for v in graph.vertices), ([0.0, 0.0], [1.0, 0.5], *x), strict=True)
            )
            at = {number: np.array(p) for number, p in points.items()}
            if sum(cost.at(at) for edge in edges for cost in edge.get_costs()) > limit:
                continue
            if np.linalg.norm(x[1] - x[0]) > 2.0:
                continue
            if edges[1].get_constraints()[1].rows.at(at)[0] > 0.0:
                continue
            inside += 1
            for vertex, p in zip(middle, x, strict=True):
                assert (boxes[vertex.id][0] <= p).all()
                assert (p <= boxes[vertex.id][1]).all()
        assert inside or limit < 2.0


def test_durations_without_a_last_one():
    """|(3, 4)|^2 / T + T is least at T = 5, which is any time at least 0."""
    graph = GraphOfConvexSets()
    start, goal = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([3.0, 4.0]))
    times = HPolyhedron([[-1.0]], [0.0])
    timed = graph.add_vertex(CartesianProduct([Point([3.0, 4.0]), times]))
    first = graph.add_edge(start, timed)
    first.add_cost(quad_over_lin(first.xv[:2] - first.xu, first.xv[2]) + first.xv[2])
    graph.add_edge(timed, goal)
    for options in (None, RELAXED):
        result = graph.solve_shortest_path(start, goal, options)
        check(result, 10.0, 1e-6)
        assert result.points[1][2] == pytest.approx(5.0, abs=1e-2)


def test_durations_of_steps_through_rooms():
    """Three steps of 1 in a row, each in its own time without a last one: 2 each at T = 1."""
    graph = GraphOfConvexSets()
    start, goal = graph.add_vertex(Point([7.0])), graph.add_vertex(Point([10.0]))
    times = HPolyhedron([[-1.0]], [0.0])
    rooms = [
        graph.add_vertex(CartesianProduct([Hyperrectangle([6.0 + k], [8.0 + k]), times]))
        for k in range(3)
    ]
    for u, v in itertools.pairwise([start, *rooms, goal]):
        edge = graph.add_edge(u, v)
        if v is not goal:
            edge.add_cost(quad_over_lin(edge.xv[:1] - edge.xu[:1], edge.xv[1]) + edge.xv[1])
        else:
            edge.add_constraint(edge.xv == edge.xu[:1])
    for options in (None, RELAXED):
        result = graph.solve_shortest_path(start, goal, options)
        assert result.cost == pytest.approx(6.0, rel=1e-6)
        assert 6.0 * (1.0 - 1e-6) <= result.lower_bound <= 6.0 * (1.0 + 1e-12)


def test_a_slack_variable_is_bounded_by_its_own_cost():
    """The least radius of a disc about (1, 2) that holds the origin."""
    graph = GraphOfConvexSets()
    slack = graph.add_vertex(HPolyhedron([[-1.0]], [0.0]))
    start = graph.add_vertex(Hyperrectangle([-1.0, -1.0], [0.0, 0.0]))
    edge = graph.add_edge(start, slack)
    edge.add_constraint(norm(edge.xu - [1.0, 2.0]) <= edge.xv[0])
    slack.add_cost(slack.x[0])
    result = graph.solve_shortest_path(start, slack)
    assert result.cost == pytest.approx(math.sqrt(5.0), rel=1e-7)
    assert result.lower_bound <= math.sqrt(5.0) * (1.0 + 1e-12)
    assert result.gap <= 1e-6


def test_staying_in_an_unbounded_set():
    """At its cheapest point."""
    graph = GraphOfConvexSets()
    vertex = graph.add_vertex(ABOVE)
    vertex.add_cost(norm(vertex.x - [2.0, 1.0]) + 0.5)
    result = graph.solve_shortest_path(vertex, vertex)
    check(result, 2.5)
    np.testing.assert_allclose(result.points[0], [2.0, 3.0], atol=1e-3)


def test_functions_may_make_up_for_the_length_of_a_way():
    """To 1 and back costs 2, less 10 there: no box follows from a cost of -8."""
    graph = GraphOfConvexSets()
    start, goal = graph.add_vertex(Point([0.0])), graph.add_vertex(Point([0.0]))
    line = graph.add_vertex(HPolyhedron(np.zeros((0, 1)), np.zeros(0)))
    edges = [joined(graph, start, line), joined(graph, line, goal)]
    line.add_cost(lambda x: -10.0 * math.exp(-10.0 * (x[0] - 1.0) ** 2), Transcription.RESTRICTION)
    found = graph.solve_convex_restriction(
        edges, initial_guess={start: [0.0], line: [0.8], goal: [0.0]}
    )
    # 2 = 200 (1 - x) exp(...) where the slopes meet, next to 1.
    x = found.points[1][0]
    assert pytest.approx(200.0 * (1.0 - x) * math.exp(-10.0 * (x - 1.0) ** 2), rel=1e-2) == 2.0
    assert found.cost == pytest.approx(2.0 * x - 10.0 * math.exp(-10.0 * (x - 1.0) ** 2), rel=1e-9)
    assert found.cost < -8.0
    assert found.lower_bound == -np.inf


def test_what_nothing_bounds_has_a_path_and_no_bound():
    """From a half plane to another: 3, wherever along them; the bound says that it is none."""
    graph = GraphOfConvexSets()
    below = graph.add_vertex(HPolyhedron([[0.0, 1.0]], [0.0]), "below")
    above = graph.add_vertex(ABOVE)
    joined(graph, below, above)
    result = graph.solve_shortest_path(below, above)
    assert result.cost == pytest.approx(3.0, rel=1e-7)
    assert result.lower_bound == 0.0
    assert "bound the points of vertex 'below' along coordinate 0" in result.reason


def test_constraints_that_no_path_keeps_are_proven():
    """They contradict each other wherever the points are."""
    graph = GraphOfConvexSets()
    start, goal = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([1.0, 0.0]))
    middle = graph.add_vertex(PLANE)
    for u, v in ((start, middle), (middle, goal)):
        edge = joined(graph, u, v)
        edge.add_constraint(norm_inf(edge.xv - edge.xu) <= 0.4)
    result = graph.solve_shortest_path(start, goal)
    assert not result.is_success
    assert "proven" in result.reason


def test_costs_that_go_down_for_ever_are_refused_with_the_vertex():
    """1 / x has no least value where x has no largest."""
    graph = GraphOfConvexSets()
    start = graph.add_vertex(Point([0.0]))
    far = graph.add_vertex(HPolyhedron([[-1.0]], [0.0]), "far")
    graph.add_edge(start, far)
    far.add_cost(quad_over_lin(0.0 * far.x + 1.0, far.x))
    with pytest.raises(ConvexSetError, match=r"'far' is unbounded along coordinate 0.*with a box"):
        graph.solve_shortest_path(start, far)


def test_linear_costs_without_a_least_value_are_refused_with_the_edge():
    """As where the sets are bounded."""
    graph = GraphOfConvexSets()
    start = graph.add_vertex(Point([0.0]))
    line = graph.add_vertex(HPolyhedron(np.zeros((0, 1)), np.zeros(0)))
    edge = graph.add_edge(start, line, "down")
    edge.add_cost(edge.xv[0])
    with pytest.raises(ConvexSetError, match="'down': the linear part of the cost is -inf"):
        graph.solve_shortest_path(start, line)


def test_graphs_that_are_made_while_they_are_searched_take_bounded_sets():
    """As paths begin before any is known, whose cost would bound them."""

    class Plane(ImplicitGraphOfConvexSets):
        """A point, and the plane around it."""

        def do_successors(self, v):
            """Lead from the point to the plane."""
            return [] if v.outgoing_edges or v.id else [joined(self.gcs, v, self.plane)]

    implicit = Plane()
    start = implicit.gcs.add_vertex(Point([0.0, 0.0]))
    implicit.plane = implicit.gcs.add_vertex(PLANE, "plane")
    with pytest.raises(ConvexSetError, match=r"'plane'.* is unbounded; intersect it with a box"):
        implicit.solve_shortest_path(start, implicit.plane)


def test_without_a_path_in_any_box_that_is_said():
    """Above one diagonal and below one further down: no box that is guessed has a path."""
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([4.0, 0.0]))
    middle = graph.add_vertex(PLANE)
    first, last = joined(graph, start, middle), joined(graph, middle, end)
    first.add_constraint(first.xv[1] - first.xv[0] >= 2.0)
    last.add_constraint(last.xu[1] - last.xu[0] <= 0.0)
    for result in (
        graph.solve_shortest_path(start, end),
        graph.solve_convex_restriction([first, last]),
    ):
        assert not result.is_success
        assert result.lower_bound == 0.0
        assert "is proven" in result.reason or "keeps" in result.reason, result.reason
        assert f"vertex {middle.name!r} goes on along coordinate 0" in result.reason


def test_rounded_paths_that_break_what_is_asked_are_not_the_last_word():
    """The relaxation goes straight; an edge that has to be on the path is on another one."""
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([4.0, 0.0]))
    near, far = (graph.add_vertex(HPolyhedron([[0.0, -1.0]], [-y])) for y in (1.0, 2.0))
    for u, v in ((start, near), (near, end), (near, far), (far, end)):
        joined(graph, u, v)
    for edge in graph.edges:
        if edge.u is near and edge.v is far:
            edge.add_phi_constraint(True)
    result = graph.solve_shortest_path(start, end)
    # Up to y = 2 and down again, each half 2 along.
    check(result, 2.0 * math.hypot(2.0, 2.0))

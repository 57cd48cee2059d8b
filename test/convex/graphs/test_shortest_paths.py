"""Shortest paths through sets: constructed truths between the bound and the cost."""

from __future__ import annotations

import itertools
import math

from graphs_of_sets import around, check, joined, RELAXED
import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperrectangle,
    norm,
    norm1,
    norm_inf,
    Point,
    quad_form,
    sum_squares,
    VPolytope,
)

pytestmark = pytest.mark.usefixtures("both_ways_to_paths")


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_sets_on_a_line_are_crossed_straight(n, scale):
    """Between two points with sets around points of the line, the path is the line."""
    way = np.arange(1.0, n + 1.0) * scale
    shift = -3.0 * way
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point(shift)), graph.add_vertex(Point(shift + way))
    sets = [around(n + k, shift + s * way, 0.07 * scale) for k, s in enumerate((0.2, 0.5, 0.8))]
    chain = [start, *(graph.add_vertex(each) for each in sets), end]
    for u, v in itertools.pairwise(chain):
        joined(graph, u, v)
    # Beside them a way around, which is longer, and one that leads nowhere.
    aside = graph.add_vertex(Point(shift + way + scale))
    joined(graph, chain[1], aside)
    joined(graph, aside, chain[2])
    joined(graph, aside, graph.add_vertex(Point(shift)))
    result = graph.solve_shortest_path(start, end)
    check(result, float(np.linalg.norm(way)))
    assert list(result.vertices) == [v.id for v in chain]
    for vertex, x in zip(chain, result.points, strict=True):
        assert vertex.set.point_in_set(x, 1e-9 * scale)
        assert (vertex.get_solution(result) == x).all()
    assert aside.get_solution(result) is None


@pytest.mark.parametrize("kind", range(9))
def test_every_kind_of_set_is_crossed(kind):
    """A path from a point to another over a set that holds a point of the straight line."""
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([3.0, 4.0]))
    middle = graph.add_vertex(around(kind, np.array([1.5, 2.0]), 0.2))
    joined(graph, start, middle)
    joined(graph, middle, end)
    check(graph.solve_shortest_path(start, end), 5.0)


def test_a_path_around_a_corner_has_a_rational_length():
    """From (0, 0) over the segment x = 4, y >= 3 to (8, 0): two sides 5 of 3-4-5 triangles."""
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([8.0, 0.0]))
    door = graph.add_vertex(VPolytope([[4.0, 3.0], [4.0, 9.0]]))
    longer = graph.add_vertex(Hyperrectangle([3.0, -9.0], [5.0, -4.0]))
    for through in (door, longer):
        joined(graph, start, through)
        joined(graph, through, end)
    for options in (None, RELAXED):
        result = graph.solve_shortest_path(start, end, options)
        check(result, 10.0)
        np.testing.assert_allclose(result.points[1], [4.0, 3.0], atol=1e-8)
    given = graph.solve_convex_restriction([longer.incoming_edges[0], longer.outgoing_edges[0]])
    # Over (4, -4): twice the square root of 32.
    check(given, 2.0 * math.sqrt(32.0))


@pytest.mark.parametrize(
    ("cost", "truth"),
    [
        # Over x = 4, y >= 3, from (0, 0) to (8, 0), per step (4, 3) and (4, -3).
        (sum_squares, 50.0),
        (norm1, 14.0),
        (norm_inf, 8.0),
        (lambda d: 2.0 * norm(d) + 1.5, 23.0),
        (lambda d: quad_form(d, [[2.0, 0.0], [0.0, 1.0]]), 2.0 * (2.0 * 16.0 + 9.0)),
        (lambda d: d[0] + 0.25, 8.5),
        (lambda d: 3, 6.0),
    ],
)
def test_costs_of_each_kind(cost, truth):
    """Each kind of cost has its least value at the nearest end of the door, or all along it."""
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([8.0, 0.0]))
    door = graph.add_vertex(VPolytope([[4.0, 3.0], [4.0, 9.0]]))
    for u, v in ((start, door), (door, end)):
        edge = graph.add_edge(u, v)
        edge.add_cost(cost(edge.xv - edge.xu))
    result = graph.solve_shortest_path(start, end)
    check(result, truth)
    total = sum(edge.get_solution_cost(result) for edge in graph.edges)
    assert total == pytest.approx(result.cost, rel=1e-12)


def test_squared_steps_are_of_equal_length():
    """Ten squared steps along 1 cost ten times (1/10)^2, in sets wide enough for them."""
    graph = GraphOfConvexSets()
    chain = [graph.add_vertex(Point([0.0]))]
    chain += [graph.add_vertex(Hyperrectangle([0.0], [1.0])) for _ in range(9)]
    chain.append(graph.add_vertex(Point([1.0])))
    for u, v in itertools.pairwise(chain):
        edge = graph.add_edge(u, v)
        edge.add_cost(sum_squares(edge.xv - edge.xu))
    result = graph.solve_shortest_path(chain[0], chain[-1])
    check(result, 0.1)
    np.testing.assert_allclose(np.concatenate(result.points), np.linspace(0.0, 1.0, 11), atol=1e-5)


def test_touching_sets_are_left_where_they_touch():
    """Boxes that share the corner (3, 4) alone are passed there, by sides 5 and 5."""
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([6.0, 8.0]))
    first = graph.add_vertex(HPolyhedron.make_box([0.0, 0.0], [3.0, 4.0]))
    second = graph.add_vertex(HPolyhedron.make_box([3.0, 4.0], [6.0, 8.0]))
    joined(graph, start, first)
    joined(graph, second, end)
    through = graph.add_edge(first, second)
    through.add_constraint(through.xu == through.xv)
    result = graph.solve_shortest_path(start, end)
    assert result.is_success
    assert result.lower_bound <= 10.0
    # Points that are tied keep sets and constraints to rounding of the solver.
    assert result.cost == pytest.approx(10.0, abs=1e-7)
    assert result.violation <= 1e-7
    np.testing.assert_allclose(result.points[1:3], [[3.0, 4.0], [3.0, 4.0]], atol=1e-5)


def test_inequalities_of_edges_move_the_points():
    """A step that has to rise by 3 along y on the way to (8, 0) makes the path 5 + 5."""
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([8.0, 0.0]))
    middle = graph.add_vertex(Hyperrectangle([4.0, -9.0], [4.0, 9.0]))
    rise = joined(graph, start, middle)
    rise.add_constraint(rise.xv[1] >= rise.xu[1] + 3.0)
    joined(graph, middle, end)
    result = graph.solve_shortest_path(start, end)
    assert result.lower_bound <= 10.0
    assert result.cost == pytest.approx(10.0, abs=1e-7)
    rise.add_constraint(rise.xv[1] <= 2.0)
    refused = graph.solve_shortest_path(start, end)
    assert not refused.is_success
    assert "proven" in refused.reason


def least_over_points(n: int, lengths: dict[tuple[int, int], int]) -> float:
    """Return the least sum over all simple paths from 0 to n - 1, by trying every one."""
    best = math.inf
    for size in range(n - 1):
        for inner in itertools.permutations(range(1, n - 1), size):
            steps = list(itertools.pairwise((0, *inner, n - 1)))
            if all(step in lengths for step in steps):
                best = min(best, sum(lengths[step] for step in steps))
    return best


@pytest.mark.parametrize("seed", range(6))
def test_a_graph_of_points_is_an_ordinary_graph(seed):
    """Sets of one point with whole numbers: the least sum of all paths, exactly known."""
    rng = np.random.default_rng(seed)
    n = 7
    places = rng.integers(-20, 20, (n, 3))
    graph = GraphOfConvexSets()
    vertices = [graph.add_vertex(Point(p)) for p in places]
    lengths: dict[tuple[int, int], int] = {}
    for u, v in itertools.permutations(range(n), 2):
        if rng.random() < 0.35 and (u, v) != (0, n - 1):
            lengths[u, v] = int(np.abs(places[u] - places[v]).sum()) + int(rng.integers(5))
            edge = graph.add_edge(vertices[u], vertices[v])
            extra = lengths[u, v] - int(np.abs(places[u] - places[v]).sum())
            edge.add_cost(norm1(edge.xv - edge.xu) + extra)
    truth = least_over_points(n, lengths)
    result = graph.solve_shortest_path(vertices[0], vertices[-1])
    if truth == math.inf:
        assert not result.is_success
        assert result.reason == "no edges lead from 'v0' to 'v6'"
    else:
        check(result, truth)


def test_no_vertex_is_visited_twice():
    """A circle that would shorten what is constrained is no part of a path.

    Only from the point (0, 5) may the target be entered; it is beyond a box, which would have to
    be crossed twice to return.
    """
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([4.0, 0.0]))
    box = graph.add_vertex(Hyperrectangle([1.0, 0.0], [2.0, 5.0]))
    there = graph.add_vertex(Point([0.0, 5.0]))
    joined(graph, start, box)
    joined(graph, box, there)
    joined(graph, there, box)
    last = joined(graph, box, end)
    check(graph.solve_shortest_path(start, end), 4.0)
    last.add_constraint(last.xu[1] >= 4.0)
    # Up to (x, 4) and down to (4, 0): mirrored at y = 4, straight from (0, 0) to (4, 8).
    result = graph.solve_shortest_path(start, end)
    assert result.lower_bound <= math.sqrt(80.0)
    assert result.cost == pytest.approx(math.sqrt(80.0), abs=1e-6)


def test_of_parallel_edges_the_cheaper_is_taken():
    """Two edges between the same vertices differ by a constant."""
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0])), graph.add_vertex(Point([1.0]))
    dear, cheap = joined(graph, start, end), joined(graph, start, end)
    dear.add_cost(0.5)
    result = graph.solve_shortest_path(start, end)
    check(result, 1.0)
    assert graph.get_solution_path(start, end, result) == [cheap]
    dear.add_phi_constraint(True)
    check(graph.solve_shortest_path(start, end), 1.5)
    dear.clear_phi_constraints()
    cheap.add_phi_constraint(False)
    check(graph.solve_shortest_path(start, end), 1.5)
    cheap.add_phi_constraint(True)
    refused = graph.solve_shortest_path(start, end)
    assert not refused.is_success
    assert "has to be on the path" in refused.reason
    graph.clear_all_phi_constraints()
    check(graph.solve_shortest_path(start, end), 1.0)


def test_costs_and_constraints_of_vertices_count_once_on_a_path():
    """Each visited vertex pays, also the source, the target, and one that is both."""
    graph = GraphOfConvexSets()
    boxes = [graph.add_vertex(Hyperrectangle([k, 0.0], [k + 0.5, 1.0])) for k in range(3)]
    for u, v in itertools.pairwise(boxes):
        joined(graph, u, v)
    for k, box in enumerate(boxes):
        box.add_cost(box.x[1] + k)
        box.add_constraint(box.x[1] >= 0.25)
    # Twice half a unit along x at y = 1/4; levels 0.25 + 1.25 + 2.25. The middle is crossed.
    result = graph.solve_shortest_path(boxes[0], boxes[2])
    assert result.lower_bound <= 5.25
    assert result.cost == pytest.approx(5.25, abs=1e-7)
    stay = graph.solve_shortest_path(boxes[1], boxes[1])
    assert stay.cost == pytest.approx(1.25, abs=1e-7)
    assert stay.path == ()
    assert stay.vertices == (boxes[1].id,)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_steps_within_regions_are_costs_of_vertices(scale):
    """Sets of a step's two ends, which are one point at the set's centre, with ends that are tied.

    Through the square [0, 3] x [0, 4] and one that touches it in (3, 4): twice a side of 5.
    """
    graph = GraphOfConvexSets()
    start, end = (graph.add_vertex(Point(scale * np.tile(p, 2))) for p in ([0, 0], [6.0, 8.0]))
    chain = [start]
    for low in (np.zeros(2), np.array([3.0, 4.0])):
        square = HPolyhedron.make_box(scale * low, scale * (low + np.array([3.0, 4.0])))
        step = graph.add_vertex(square.cartesian_power(2))
        step.add_cost(norm(step.x[2:] - step.x[:2]))
        chain.append(step)
    for u, v in itertools.pairwise([*chain, end]):
        edge = graph.add_edge(u, v)
        edge.add_constraint(edge.xu[2:] == edge.xv[:2])
    result = graph.solve_shortest_path(start, end)
    assert result.lower_bound <= 10.0 * scale
    assert result.cost == pytest.approx(10.0 * scale, rel=1e-7)
    np.testing.assert_allclose(result.points[1][2:], scale * np.array([3.0, 4.0]), rtol=1e-6)


def test_what_is_not_reached_is_said():
    """Neither a vertex without edges, nor one whose edges lead the other way, is reached."""
    graph = GraphOfConvexSets()
    start = graph.add_vertex(Point([0.0]), "start")
    end = graph.add_vertex(Point([1.0]), "end")
    joined(graph, end, start)
    for preprocessing in (True, False):
        options = GraphOfConvexSetsOptions(preprocessing=preprocessing)
        result = graph.solve_shortest_path(start, end, options)
        assert not result.is_success
        assert result.reason == "no edges lead from 'start' to 'end'"
        assert result.cost == result.lower_bound == math.inf
        assert result.gap == math.inf


def test_a_path_without_cost_costs_nothing():
    """Where nothing costs, cost and bound are 0."""
    graph = GraphOfConvexSets()
    start, end = graph.add_vertex(Point([0.0])), graph.add_vertex(Point([1.0]))
    graph.add_edge(start, end)
    result = graph.solve_shortest_path(start, end)
    assert result.is_success
    assert result.cost == 0.0
    assert -1e-9 <= result.lower_bound <= 0.0

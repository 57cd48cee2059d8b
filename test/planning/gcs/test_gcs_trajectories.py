"""Trajectories through graphs of convex sets, where the best is known in closed form."""

import itertools
import math

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    norm,
    Point,
    VPolytope,
)
from scene_graph_ros.planning import GcsTrajectoryOptimization

SEARCH = GraphOfConvexSetsOptions(convex_relaxation=False)
L_SHAPE = (([0.0, 0.0], [3.0, 1.0]), ([2.0, 0.0], [3.0, 3.0]))
"""Boxes around a corner at (2, 1)."""


def through(regions, start, goal, order=1, joints=(), **options):
    """Return a problem of regions between two points, and its three subgraphs."""
    graph = GcsTrajectoryOptimization(len(start), joints)
    free = graph.add_regions(regions, order, name="free", **options)
    begin = graph.add_regions([Point(start)], 0, name="start")
    end = graph.add_regions([Point(goal)], 0, name="goal")
    graph.add_edges(begin, free)
    graph.add_edges(free, end)
    return graph, begin, free, end


def boxes(corners, kind=Hyperrectangle):
    """Return boxes as sets of a kind."""
    return [kind(low, high) for low, high in corners]


def check(trajectory, result, regions, start, goal):
    """Check what every trajectory promises, by values and by control points."""
    assert result.is_success
    assert result.lower_bound <= result.cost
    assert result.gap == result.cost - result.lower_bound
    np.testing.assert_allclose(trajectory.value(trajectory.start_time), start, atol=1e-12)
    np.testing.assert_allclose(trajectory.value(trajectory.end_time), goal, atol=1e-12)
    assert np.abs(trajectory.jumps()).max(initial=0.0) <= 1e-12
    numbers = [int(v.name.split("[")[1][:-1]) for v in result.vertices if "free" in v.name]
    assert len(numbers) == trajectory.num_segments
    for number, segment in zip(numbers, trajectory.segments, strict=True):
        assert regions[number].point_in_set(segment.control_points, 1e-12).all()
        at = np.linspace(segment.start_time, segment.end_time, 33)
        assert regions[number].point_in_set(segment.value(at), 1e-12).all()
    assert result.outside <= 1e-12
    assert result.velocity_excess <= 1e-9


@pytest.mark.parametrize("kind", [Hyperrectangle, HPolyhedron.make_box])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_shortest_way_through_two_boxes_is_the_line_or_goes_by_the_corner(kind, order):
    """By the corner (2, 1) of an L, where the straight line leaves the boxes."""
    regions = boxes(L_SHAPE, kind)
    for start, goal, length in [
        ((0.5, 0.5), (2.5, 0.25), math.hypot(2.0, 0.25)),
        ((0.0, 0.0), (2.5, 3.0), math.hypot(2.0, 1.0) + math.hypot(0.5, 2.0)),
    ]:
        graph, begin, _, end = through(regions, start, goal, order)
        graph.add_path_length_cost()
        trajectory, result = graph.solve_path(begin, end, SEARCH)
        check(trajectory, result, regions, start, goal)
        assert result.cost == pytest.approx(length, abs=1e-6)
        assert length - 1e-5 <= result.lower_bound <= length + 1e-12


@pytest.mark.parametrize("order", [1, 3])
def test_the_least_time_is_that_of_the_slowest_joint(order):
    """Without corners in the way it takes the largest way by its own limit of velocity."""
    start, goal, limit = np.array([0.1, 0.9]), np.array([2.8, 0.3]), np.array([0.9, 0.15])
    regions = boxes((L_SHAPE[0], ([1.0, -1.0], [4.0, 2.0])), HPolyhedron.make_box)
    graph, begin, free, end = through(regions, start, goal, order, h_max=50.0)
    graph.add_time_cost()
    graph.add_velocity_bounds(-limit, limit)
    trajectory, result = graph.solve_path(begin, end, SEARCH)
    check(trajectory, result, regions, start, goal)
    least = float((np.abs(goal - start) / limit).max())
    assert result.cost == pytest.approx(least, abs=1e-5)
    assert result.lower_bound <= least
    assert trajectory.duration == pytest.approx(result.cost, rel=1e-14)
    rates = trajectory.derivative().value(np.linspace(0.0, trajectory.end_time, 200))
    assert (np.abs(rates) <= limit * (1.0 + 1e-9)).all()
    # A weight scales cost and bound; what is asked of all is asked of subgraphs, too.
    twice, begin, free, end = through(regions, start, goal, order, h_max=50.0)
    free.add_time_cost(2.0)
    free.add_velocity_bounds(-limit, limit)
    _, again = twice.solve_path(begin, end, SEARCH)
    assert again.cost == pytest.approx(2.0 * least, abs=2e-5)


def test_one_sided_and_infinite_bounds_hold():
    """Backwards as fast as it likes, forwards at 0.5 at most; nothing bounds the rest."""
    regions = boxes([([0.0, 0.0], [4.0, 4.0])])
    for start, goal, least in [((0.0, 0.0), (2.0, 3.0), 4.0), ((2.0, 3.0), (0.0, 0.0), 1e-6)]:
        graph, begin, _, end = through(regions, start, goal, 2)
        graph.add_time_cost()
        graph.add_velocity_bounds([-np.inf, -np.inf], [0.5, np.inf])
        _, result = graph.solve_path(begin, end)
        assert result.cost == pytest.approx(least, abs=1e-6)


def test_cubics_go_on_in_direction_and_curvature():
    """Order 3 with continuity 2: r(s) has no jumps in r, r' and r'', q(t) keeps its direction."""
    regions = boxes((*L_SHAPE, ([0.0, 2.5], [3.0, 3.5])), HPolyhedron.make_box)
    start, goal = (0.2, 0.5), (0.3, 3.0)
    graph, begin, _free, end = through(regions, start, goal, 3)
    graph.add_time_cost()
    graph.add_path_energy_cost(0.3)
    graph.add_velocity_bounds([-1.0, -0.5], [1.0, 0.5])
    graph.add_path_continuity_constraints(2)
    trajectory, result = graph.solve_path(begin, end, SEARCH)
    check(trajectory, result, regions, start, goal)
    assert result.gap <= 1e-5
    path = graph.normalize_segment_times(trajectory)
    assert path.start_time == 0.0
    assert path.end_time == path.num_segments == 3
    assert path.is_continuous(2, 1e-9)
    assert result.jump <= 1e-9
    before, after = (
        [s.derivative().value(t) for s, t in pairs]
        for pairs in (
            [(s, s.end_time) for s in trajectory.segments[:-1]],
            [(s, s.start_time) for s in trajectory.segments[1:]],
        )
    )
    for a, b in zip(before, after, strict=True):
        np.testing.assert_allclose(a / np.linalg.norm(a), b / np.linalg.norm(b), atol=1e-8)
    # Without being asked for, the direction jumps at the same places.
    loose, begin, _, end = through(regions, start, goal, 3)
    loose.add_path_length_cost()
    bent, _ = loose.solve_path(begin, end)
    assert not loose.normalize_segment_times(bent).is_continuous(1, 1e-3)


def test_the_energy_is_that_of_evenly_spread_control_points():
    """Between two points of one region, n squares of a way of 1/n each: 1/n of the squared way."""
    for order in (1, 2, 4):
        graph, begin, _, end = through([Hyperrectangle([0, 0], [5, 5])], (0, 0), (3, 4), order)
        graph.add_path_energy_cost(np.diag([1.0, 2.0]))
        trajectory, result = graph.solve_path(begin, end)
        assert result.cost == pytest.approx((9.0 + 4.0 * 16.0) / order, rel=1e-7)
        points = trajectory.segments[0].control_points
        even = np.linspace([0, 0], [3, 4], order + 1)
        np.testing.assert_allclose(points, even, atol=1e-4)
        # A number w stands for w times the identity.
        again, begin, free, end = through([Hyperrectangle([0, 0], [5, 5])], (0, 0), (3, 4), order)
        free.add_path_energy_cost(0.5)
        assert again.solve_path(begin, end)[1].cost == pytest.approx(0.25 * 25.0 / order, rel=1e-7)


CIRCLE = [
    ([low, 0.0], [high, 1.0]) for low, high in ((0.0, 2.0), (1.5, 3.3), (-3.2, -1.5), (-2.0, 0.2))
]


@pytest.mark.parametrize("kind", [Hyperrectangle, HPolyhedron.make_box])
def test_a_joint_without_an_end_takes_the_short_way_through_pi(kind):
    """From 3 to -3 it is 2 pi - 6, with an apparent jump of a turn that is unwrapped."""
    regions = boxes(CIRCLE, kind)
    graph, begin, _free, end = through(regions, (3.0, 0.5), (-3.0, 0.5), 1, joints=[0])
    graph.add_path_length_cost()
    trajectory, result = graph.solve_path(begin, end, SEARCH)
    assert result.cost == pytest.approx(2.0 * math.pi - 6.0, abs=1e-9)
    assert result.jump <= 1e-12
    (jump,) = trajectory.jumps()
    np.testing.assert_allclose(jump, [-2.0 * math.pi, 0.0], atol=1e-12)
    unwrapped = graph.unwrap_to_continuous_trajectory(trajectory, [0])
    assert unwrapped.is_continuous(0, 1e-12)
    np.testing.assert_allclose(unwrapped.value(99.0), [2.0 * math.pi - 3.0, 0.5], atol=1e-12)
    moved = graph.unwrap_to_continuous_trajectory(trajectory, [0], [-1])
    np.testing.assert_allclose(moved.value(0.0), [3.0 - 2.0 * math.pi, 0.5], atol=1e-12)
    assert moved.is_continuous(0, 1e-12)
    # As an ordinary joint it goes all the way round.
    plain, begin, _, end = through(regions, (3.0, 0.5), (-3.0, 0.5), 1)
    plain.add_path_length_cost()
    assert plain.solve_path(begin, end, SEARCH)[1].cost == pytest.approx(6.0, abs=1e-9)


def test_edges_between_subgraphs_turn_round_too():
    """The start is in its own subgraph, two turns away from the region that holds it."""
    regions = boxes(CIRCLE)
    start = (3.0 + 4.0 * math.pi, 0.5)
    graph, begin, _, end = through(regions, start, (-3.0, 0.5), 1, joints=[0])
    graph.add_path_length_cost()
    trajectory, result = graph.solve_path(begin, end)
    assert result.cost == pytest.approx(2.0 * math.pi - 6.0, abs=1e-9)
    assert trajectory.value(0.0)[0] == pytest.approx(3.0, abs=1e-12)


def test_several_modes_meet_in_a_subspace_at_rest():
    """Order 3 to a line, order 2 from there on; the velocity is 0 at the change, on both sides."""
    graph = GcsTrajectoryOptimization(2)
    graph.add_velocity_bounds([-1.0, -1.0], [1.0, 1.0])
    graph.add_time_cost()  # both also for what is added later
    first = graph.add_regions([Hyperrectangle([0, 0], [2, 2])], 3, name="reach")
    second = graph.add_regions([HPolyhedron.make_box([1, 0], [4, 2])], 2, name="place")
    begin = graph.add_regions([Point([0.0, 1.0])], 0, name="start")
    end = graph.add_regions([Point([4.0, 1.0])], 0, name="goal")
    line = HPolyhedron.make_box([1.0, 1.9], [2.0, 1.9])
    graph.add_edges(begin, first)
    change = graph.add_edges(first, second, line)
    graph.add_edges(second, end)
    change.add_zero_derivative_constraints(1)
    change.add_velocity_bounds([-1.0, -1.0], [1.0, 1.0])
    trajectory, result = graph.solve_path(begin, end)
    assert result.is_success
    assert [s.order for s in trajectory.segments] == [3, 2]
    meeting = trajectory.segments[0].final_value
    assert meeting[1] == pytest.approx(1.9, abs=1e-12)
    for segment, t in zip(trajectory.segments, [trajectory.breaks[1]] * 2, strict=True):
        np.testing.assert_allclose(segment.derivative().value(t), 0.0, atol=1e-9)
    # At rest the last two control points are one: a cubic moves at v for two thirds of its time
    # at most, a parabola for half. 2 and 4 - x along x, x where it is best.
    least = min(1.5 * x + 2.0 * (4.0 - x) for x in (1.0, 2.0))
    assert result.cost == pytest.approx(least, abs=1e-5)
    # Only regions that meet in the subspace are joined.
    assert graph.add_edges(second, first, Point([1.5, 1.0])).edges
    assert not graph.add_edges(second, first, Point([3.5, 1.0])).edges
    graph.remove_subgraph(second)
    assert second not in graph.get_subgraphs()
    assert [each.name for each in graph.get_edges_between_subgraphs()] == ["start -> reach"]
    _, none = graph.solve_path(begin, end)
    assert not none.is_success
    assert none.reason == "no edges lead from 'start[0]' to 'goal[0]'"


def test_any_region_of_a_subgraph_may_be_the_first_or_the_last():
    """From the nearest of three points to the nearest of two."""
    graph = GcsTrajectoryOptimization(2)
    free = graph.add_regions([Hyperrectangle([0, 0], [5, 5])], 1)
    starts = graph.add_regions([Point(p) for p in ([0.0, 0.0], [1.0, 1.0], [0.0, 5.0])], 0)
    goals = graph.add_regions([Point(p) for p in ([5.0, 5.0], [4.0, 1.5])], 0)
    graph.add_edges(starts, free)
    graph.add_edges(free, goals)
    graph.add_path_length_cost()
    count = graph.graph_of_convex_sets.num_vertices
    trajectory, result = graph.solve_path(starts, goals, SEARCH)
    assert result.cost == pytest.approx(math.hypot(3.0, 0.5), abs=1e-8)
    np.testing.assert_allclose(trajectory.value([0.0, 99.0]), [[1.0, 1.0], [4.0, 1.5]])
    assert graph.graph_of_convex_sets.num_vertices == count


def test_costs_and_constraints_of_ones_own_are_of_each_region_and_edge():
    """A detour through a height, and a price for the place where regions meet."""
    regions = boxes([([0, 0], [2, 2]), ([1, 0], [4, 2])])
    graph, begin, free, end = through(regions, (0.0, 0.0), (4.0, 0.0), 1)
    graph.add_path_length_cost()
    before, after = free.edge_constituent_vertex_control_points()
    free.add_edge_constraint(before[-1][1] == 1.5)
    trajectory, result = graph.solve_path(begin, end, SEARCH)
    # By symmetry it turns at x = 2, which both have.
    assert result.cost == pytest.approx(2.0 * math.hypot(2.0, 1.5), abs=1e-6)
    np.testing.assert_allclose(trajectory.segments[0].final_value, [2.0, 1.5], atol=1e-3)
    free.add_edge_cost(100.0 * norm(after[0] - np.array([1.25, 1.5])))
    free.add_vertex_constraint(free.vertex_duration() == 0.5)
    points = free.vertex_control_points()
    free.add_vertex_cost(norm(points[1] - points[0]))
    trajectory, result = graph.solve_path(begin, end, SEARCH)
    length = math.hypot(1.25, 1.5) + math.hypot(2.75, 1.5)
    assert result.cost == pytest.approx(2.0 * length, abs=1e-5)
    np.testing.assert_allclose(np.diff(trajectory.breaks), 0.5, atol=1e-12)
    with pytest.raises(ConvexSetError, match="it has those of vertex"):
        free.add_vertex_cost(norm(free.vertices[0].x))
    with pytest.raises(ConvexSetError, match="add_edge_constraint: constraint must be made by"):
        free.add_edge_constraint(3.0)


def test_given_regions_in_order_have_the_same_best_trajectory():
    """The restriction to the path that was found finds it; what is no path is refused."""
    regions = boxes((*L_SHAPE, ([0.0, 2.5], [3.0, 3.5])))
    graph, begin, free, end = through(regions, (0.2, 0.5), (0.3, 3.0), 2)
    graph.add_path_length_cost()
    _, result = graph.solve_path(begin, end, SEARCH)
    trajectory, again = graph.solve_convex_restriction(result.vertices)
    check(trajectory, again, regions, (0.2, 0.5), (0.3, 3.0))
    assert again.cost == pytest.approx(result.cost, abs=1e-7)
    assert again.reason == "the path was given"
    first, last = free.vertices[0], free.vertices[2]
    with pytest.raises(
        ConvexSetError, match=r"'free\[0\]', must have one edge to the next, 'free"
    ):
        graph.solve_convex_restriction([begin.vertices[0], first, last])
    with pytest.raises(ConvexSetError, match="must be two or more, not 1"):
        graph.solve_convex_restriction([first])
    drawing = graph.get_graphviz_string(result)
    assert "free[0]" in drawing
    assert graph.get_graphviz_string() != drawing


def test_costs_do_not_depend_on_order_place_size_or_direction_of_the_regions():
    """Regions permuted, moved, turned by a right angle and scaled; start and goal exchanged."""
    rng = np.random.default_rng(4)
    corners = [*L_SHAPE, ([0.0, 2.5], [3.0, 3.5]), ([0.0, 0.5], [1.0, 3.0])]
    start, goal = np.array([0.2, 0.1]), np.array([2.9, 2.9])

    def cost(order, change, ends, unit=1.0):
        polytopes = []
        for k in order:
            low, high = (np.array(c, dtype=float) for c in corners[k])
            square = np.array(list(itertools.product(*zip(low, high, strict=True))))
            polytopes.append(VPolytope(change(square)))
        points = [change(p[None])[0] for p in ends]
        graph, begin, _, end = through(polytopes, *points, 2)
        graph.add_path_length_cost(unit)
        return graph.solve_path(begin, end, SEARCH)[1].cost

    reference = cost(range(4), lambda p: p, (start, goal))
    assert reference == pytest.approx(math.hypot(1.8, 0.9) + math.hypot(0.9, 1.9), abs=1e-6)
    for change, unit in [
        (lambda p: p, 1.0),
        (lambda p: p + np.array([100.0, -30.0]), 1.0),
        (lambda p: p @ np.array([[0.0, 1.0], [-1.0, 0.0]]), 1.0),
        (lambda p: 1e-3 * p, 1e3),
    ]:
        for ends in ((start, goal), (goal, start)):
            found = cost(rng.permutation(4), change, ends, unit)
            assert found == pytest.approx(reference, abs=1e-6)


def test_regions_may_be_curved():
    """Two discs of radius 1 that overlap: by the point where their circles meet, or straight."""
    discs = [Hyperellipsoid.make_hypersphere(1.0, [x, 0.0]) for x in (0.0, 1.6)]
    graph, begin, _, end = through(discs, (0.0, 0.95), (1.6, 0.95), 2)
    graph.add_path_length_cost()
    trajectory, result = graph.solve_path(begin, end, SEARCH)
    # The circles meet at (0.8, 0.6): the straight line at height 0.95 leaves both.
    assert result.cost == pytest.approx(2.0 * math.hypot(0.8, 0.35), abs=1e-6)
    for disc, segment in zip(discs, trajectory.segments, strict=True):
        assert disc.point_in_set(segment.control_points, 1e-9).all()

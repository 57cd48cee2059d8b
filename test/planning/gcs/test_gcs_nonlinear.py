"""Derivatives of q(t) that go on and are bounded, programs that count alone, and cones."""

import numpy as np
import pytest

from scene_graph_ros.convex.solve.smooth_program import _without_opposites, SmoothProgram
from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    GraphOfConvexSetsOptions,
    Hyperrectangle,
    norm,
    Point,
    Transcription,
)
from scene_graph_ros.planning import GcsTrajectoryOptimization
from scene_graph_ros.planning.gcs.result import _meeting_excess, Step

CORNER = [Hyperrectangle([0.0, 0.0], [3.0, 1.0]), Hyperrectangle([2.0, 0.0], [3.0, 3.0])]


def around_a_corner(order=4, noise=(0.0, 0.0), path_continuity=1):
    """Return a problem with bounded velocities, and its start, regions, goal and edges."""
    graph = GcsTrajectoryOptimization(2)
    first = Hyperrectangle([0.0, 0.0], np.add([3.0, 1.0], noise))
    free = graph.add_regions([first, CORNER[1]], order, name="free", h_min=0.1)
    start = graph.add_regions([Point([0.2, 0.5])], 0, name="start")
    goal = graph.add_regions([Point([2.5, 2.8])], 0, name="goal")
    between = graph.add_edges(start, free), graph.add_edges(free, goal)
    graph.add_time_cost()
    graph.add_path_length_cost(0.1)
    graph.add_velocity_bounds([-1.0, -0.5], [1.0, 0.5])
    if path_continuity:
        graph.add_path_continuity_constraints(path_continuity)
    return graph, start, free, goal, between


def inside(trajectory):
    """Tell whether each segment's control points are in its region."""
    return all(
        region.point_in_set(segment.control_points, 1e-9).all()
        for region, segment in zip(CORNER, trajectory.segments, strict=True)
    )


def test_velocities_and_accelerations_go_on():
    """Which jump where nothing is asked of them, and then cost less."""
    graph, start, _, goal, _ = around_a_corner()
    plain, least = graph.solve_path(start, goal)
    assert abs(plain.jumps(2)).max() > 0.1
    graph.add_continuity_constraints(1)
    graph.add_continuity_constraints(2)
    smooth, result = graph.solve_path(start, goal)
    assert result.is_success
    assert abs(smooth.jumps(1)).max() <= 1e-9
    assert abs(smooth.jumps(2)).max() <= 1e-8
    assert result.derivative_jump <= 1e-9
    assert inside(smooth)
    assert least.cost < result.cost < 1.5 * least.cost
    # The bound is that of ways which need not be so smooth.
    assert 0.99 * least.lower_bound <= result.lower_bound <= least.cost
    at = np.linspace(0.0, smooth.end_time, 500)
    assert (abs(smooth.derivative().value(at)) <= np.array([1.0, 0.5]) + 1e-9).all()


@pytest.mark.parametrize("first", ["path", "time"])
def test_continuity_of_path_and_time_has_one_answer(first):
    """Whichever is asked first, and whatever the last digits of the regions.

    The best of 60 random starts of an interior-point method costs 7.618. Where r' and q' = r' / h
    go on, so does h, and with equal durations the program is convex.
    """
    costs = []
    generator = np.random.default_rng(0)
    for _ in range(3):
        noise = 1e-12 * generator.normal(size=2)
        graph, start, _, goal, _ = around_a_corner(4, noise, int(first == "path"))
        graph.add_continuity_constraints(1)
        graph.add_continuity_constraints(2)
        if first == "time":
            graph.add_path_continuity_constraints(1)
        trajectory, result = graph.solve_path(start, goal)
        durations = [s.end_time - s.start_time for s in trajectory.segments]
        assert durations[0] == pytest.approx(durations[1], rel=1e-8)
        assert abs(trajectory.jumps(1)).max() <= 1e-9
        assert abs(trajectory.jumps(2)).max() <= 1e-8
        costs.append(result.cost)
    np.testing.assert_allclose(costs, 7.618, rtol=1e-4)
    assert max(costs) - min(costs) <= 1e-7


@pytest.mark.parametrize("orders", [(1,), (1, 2)])
def test_a_stop_between_two_segments_may_cost_less(orders):
    """1 m and 10 m at 1 m/s, meeting at 1: of order 3 a segment that ends at rest takes 1.5 times.

    With a stop 1.5 and 15 s; with no acceleration there, either, 3 and 30 s. With equal durations
    h the last step of control points in 1 m is d <= 1, as is the first one in 10 m: so
    10 <= d + 2 h / 3 and both take 27 s; with accelerations that go on 10 <= 4 + h / 3, 36 s.
    """
    graph = GcsTrajectoryOptimization(1)
    pieces = [Hyperrectangle([0.0], [1.0]), Hyperrectangle([1.0], [11.0])]
    free = graph.add_regions(pieces, 3, 0.01, 100.0)
    start, goal = (graph.add_regions([Point([x])], 0) for x in (0.0, 11.0))
    graph.add_edges(start, free)
    graph.add_edges(free, goal)
    graph.add_time_cost()
    graph.add_velocity_bounds([-1.0], [1.0])
    graph.add_path_continuity_constraints(1)
    for order in orders:
        graph.add_continuity_constraints(order)
    trajectory, result = graph.solve_path(start, goal)
    expected = 16.5 if orders == (1,) else 33.0
    assert trajectory.end_time == pytest.approx(expected, rel=1e-6)
    assert abs(trajectory.jumps(1)).max() <= 1e-9
    assert 11.0 <= result.lower_bound <= expected
    # It is the same when it is asked again, and along a path that is given.
    again, _ = graph.solve_path(start, goal)
    assert again.end_time == trajectory.end_time
    way = [start.vertices[0], *free.vertices, goal.vertices[0]]
    given, of_given = graph.solve_convex_restriction(way)
    assert given.end_time == pytest.approx(expected, rel=1e-6)
    assert of_given.cost == pytest.approx(expected, rel=1e-6)


def test_a_stop_where_equal_durations_do_not_reach():
    """At most 2 s for the first segment, which do not reach for the second one, 15 m at 2 m/s."""
    graph = GcsTrajectoryOptimization(1)
    pieces = [Hyperrectangle([0.0], [2.0]), Hyperrectangle([2.0], [17.0])]
    free = graph.add_regions(pieces, 3, 0.01, 12.0)
    start, goal = (graph.add_regions([Point([x])], 0) for x in (0.0, 17.0))
    graph.add_edges(start, free)
    graph.add_edges(free, goal)
    graph.add_time_cost()
    graph.add_velocity_bounds([-2.0], [2.0])
    free.vertices[0].add_constraint(free.vertices[0].x[-1] <= 2.0)
    graph.add_path_continuity_constraints(1)
    graph.add_continuity_constraints(1)
    way = [start.vertices[0], *free.vertices, goal.vertices[0]]
    for trajectory, result in (graph.solve_path(start, goal), graph.solve_convex_restriction(way)):
        # 1.5 times 1 s and 7.5 s.
        assert result.is_success and result.cost == pytest.approx(12.75, rel=1e-6)
        assert trajectory.end_time == pytest.approx(12.75, rel=1e-6)


def test_surrogates_that_nothing_keeps_forbid_nothing():
    """100 m from rest to rest with 1 m/s2: 20 s at least; what is linear in them allows none."""
    pytest.importorskip("casadi")
    graph = GcsTrajectoryOptimization(1)
    free = graph.add_regions([Hyperrectangle([0.0], [100.0])], 6, 1.0, 60.0)
    start, goal = (graph.add_regions([Point([x])], 0) for x in (0.0, 100.0))
    ends = graph.add_edges(start, free), graph.add_edges(free, goal)
    for each in ends:
        each.add_zero_derivative_constraints(1)
    graph.add_time_cost()
    graph.add_velocity_bounds([-50.0], [50.0])
    free.add_nonlinear_derivative_bounds([-1.0], [1.0], 2)
    trajectory, result = graph.solve_path(start, goal)
    assert result.is_success
    assert 20.0 <= trajectory.end_time <= 26.0
    at = np.linspace(0.0, trajectory.end_time, 1000)
    assert abs(trajectory.derivative(2).value(at)).max() <= 1.0 + 1e-6
    assert 0.0 < result.lower_bound <= result.cost


@pytest.mark.parametrize("acceleration", [1.0, 0.5])
def test_bounds_that_are_one_are_an_equation(acceleration):
    """An even acceleration from rest along x, none across: 2 m take the root of 4 m by it."""
    pytest.importorskip("casadi")
    graph = GcsTrajectoryOptimization(2)
    free = graph.add_regions([Hyperrectangle([0.0, 0.0], [2.0, 1.0])], 4, 0.1, 50.0)
    start, goal = (graph.add_regions([Point([x, 0.5])], 0) for x in (0.0, 2.0))
    graph.add_edges(start, free).add_zero_derivative_constraints(1)
    graph.add_edges(free, goal)
    graph.add_time_cost()
    graph.add_velocity_bounds([-9.0, -9.0], [9.0, 9.0])
    free.add_nonlinear_derivative_bounds([acceleration, 0.0], [acceleration, 0.0], 2)
    trajectory, result = graph.solve_path(start, goal)
    assert result.is_success, result.reason
    assert trajectory.end_time == pytest.approx(np.sqrt(4.0 / acceleration), rel=1e-9)
    along = trajectory.derivative(2).value(np.linspace(0.0, trajectory.end_time, 50))
    np.testing.assert_allclose(along, np.tile([acceleration, 0.0], (50, 1)), atol=1e-7)


def test_rows_that_are_opposite_are_one_equation():
    """Two that leave no room between them; those that leave some, and equal ones, stay."""
    M = np.array([[1.0, 2.0], [-2.0, -4.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, 3.0],
                  [0.0, 0.0]])  # fmt: skip
    m = np.array([0.5, -1.0, 0.0, 1.0, 0.0, 0.0, 2.0])
    once, equal = _without_opposites(M, m)
    assert sorted(once.tolist()) == [2, 3, 5, 6]
    assert equal.tolist() == [0]
    program = SmoothProgram(2)
    program.add_least(M, m)
    program.add_cost("sum", np.array([[0.0, 1.0]]), np.zeros(1), 1.0, 1.0)
    found, is_optimal = program.solve(np.array([0.9, 0.9]))
    # The least y from 0 on with x + 2 y = -0.5 and x from 0 to 1 would be none: x is at its edge.
    assert not is_optimal
    other = SmoothProgram(2)
    other.add_least(M[:2] * [[-1.0, 1.0]], m[:2])
    other.add_least(M[2:], m[2:])
    other.add_cost("sum", np.array([[0.0, 1.0]]), np.zeros(1), 1.0, 1.0)
    found, is_optimal = other.solve(np.array([0.9, 0.9]))
    assert is_optimal
    # 2 y = x - 0.5 with y from 0 on.
    np.testing.assert_allclose(found, [0.5, 0.0], atol=1e-6)


def test_a_wait_and_bounded_accelerations_on_a_track():
    """Two stretches of a track, a wait of 10 s between them, accelerations of at most 3.

    Order 6 needs 19.365 and 15.166 s to move from rest to rest, which a sampled program agrees on.
    """
    pytest.importorskip("casadi")
    graph = GcsTrajectoryOptimization(2)
    track = Hyperrectangle([0.0, -5.0], [305.0, 5.0])
    first, second = (graph.add_regions([track], 6, 0.0, 500.0) for _ in range(2))
    for each in (first, second):
        each.add_velocity_bounds([0.0, 0.0], [50.0, 0.0])
    pit = graph.add_regions([Hyperrectangle([75.0, -5.0], [75.0, 5.0])], 0, 10.0, 20.0)
    start = graph.add_regions([Point([0.0, 0.0])], 0, 0.0)
    goal = graph.add_regions([Point([305.0, 0.0])], 0, 0.0)
    away, to, off = (graph.add_edges(*p) for p in ((start, first), (first, pit), (pit, second)))
    graph.add_edges(second, goal)
    for k in (1, 2):
        away.add_zero_derivative_constraints(k)
    for each in (to, off):
        each.add_velocity_bounds([0.0, 0.0], [0.0, 0.0])
        each.add_zero_derivative_constraints(2)
    graph.add_time_cost()
    for each in (first, second):
        each.add_nonlinear_derivative_bounds([-3.0, 0.0], [3.0, 0.0], 2)
    trajectory, result = graph.solve_path(start, goal)
    assert result.is_success
    assert trajectory.end_time == pytest.approx(44.531, abs=2e-3)
    at = np.linspace(0.0, trajectory.end_time, 1000)
    assert abs(trajectory.derivative(2).value(at)).max() <= 3.0 * (1.0 + 1e-9)


@pytest.mark.parametrize("order", [3, 6])
def test_accelerations_go_on_through_many_corners(order):
    """Sixteen boxes up a staircase: smooth ways cost next to no more than those with corners."""
    pytest.importorskip("casadi")
    steps = np.cumsum([[0.8 * (k % 2), 0.8 * (k % 2 == 0)] for k in range(16)], axis=0)
    graph = GcsTrajectoryOptimization(2)
    boxes = [Hyperrectangle(p - 0.6, p + 0.6) for p in steps]
    free = graph.add_regions(boxes, order, h_min=0.01)
    start, goal = (graph.add_regions([Point(p)], 0) for p in (steps[0], steps[-1]))
    graph.add_edges(start, free)
    graph.add_edges(free, goal)
    graph.add_path_length_cost()
    graph.add_time_cost()
    graph.add_velocity_bounds([-1.0, -1.0], [1.0, 1.0])
    options = GraphOfConvexSetsOptions(max_rounded_paths=1, convex_relaxation=True)
    _, least = graph.solve_path(start, goal, options)
    for k in (1, 2):
        graph.add_continuity_constraints(k)
    trajectory, result = graph.solve_path(start, goal, options)
    assert result.is_success
    assert max(abs(trajectory.jumps(k)).max() for k in (1, 2)) <= 1e-7
    assert least.lower_bound <= result.cost <= 1.01 * least.cost


def test_accelerations_are_bounded_at_all_times():
    """Along one axis from rest to rest: no sooner than by full acceleration, then full braking."""
    graph = GcsTrajectoryOptimization(1)
    free = graph.add_regions([Hyperrectangle([0.0], [1.0])], 6, name="free", h_min=0.1)
    start = graph.add_regions([Point([0.0])], 0, name="start")
    goal = graph.add_regions([Point([1.0])], 0, name="goal")
    for edges in (graph.add_edges(start, free), graph.add_edges(free, goal)):
        edges.add_zero_derivative_constraints(1)
    graph.add_time_cost()
    quick, before = graph.solve_path(start, goal)
    bound = 2.0
    assert max(abs(s.derivative(2).control_points).max() for s in quick.segments) > 10.0 * bound
    graph.add_nonlinear_derivative_bounds([-bound], [bound], 2)
    trajectory, result = graph.solve_path(start, goal)
    assert result.is_success
    assert result.derivative_excess <= 1e-9
    at = np.linspace(0.0, trajectory.end_time, 1000)
    accelerations = trajectory.derivative(2).value(at)
    assert abs(accelerations).max() <= bound * (1.0 + 1e-9)
    # Two halves of the way by full acceleration take sqrt(4 / bound) = 1.414 s.
    assert 2.0 / np.sqrt(bound) <= trajectory.end_time <= 1.35 * 2.0 / np.sqrt(bound)
    assert before.cost < result.cost
    assert abs(accelerations).max() > 0.9 * bound


def test_where_modes_change_and_later_subgraphs():
    """Bounds at the meeting of two subgraphs alone, and rules for what is added after them."""
    graph, start, free, goal, (first, _) = around_a_corner()
    first.add_nonlinear_derivative_bounds([-0.2, -np.inf], [0.2, np.inf], 2)
    trajectory, _ = graph.solve_path(start, goal)
    assert abs(trajectory.derivative(2).value(0.0)[0]) <= 0.2 * (1.0 + 1e-6)
    graph.add_continuity_constraints(1)
    graph.add_nonlinear_derivative_bounds([-3.0] * 2, [3.0] * 2, 3)
    later = graph.add_regions(CORNER, 3, name="later")
    assert later.continuous_derivatives == [1] == free.continuous_derivatives
    assert [order for order, _, _ in later.derivative_bounds] == [3]
    assert not graph.add_regions(CORNER, 2, name="low").derivative_bounds


@pytest.mark.parametrize(
    ("bounds", "excess"),
    [
        # At the end of q(t) = (t / 2)^3, t = 2, q' is 1.5 and q'' 1.5; q = t begins with 1 and 0.
        (("add_velocity_bounds", [-1.2], [1.2]), (0.0, 0.3 / 1.2, 0.0)),
        (("add_velocity_bounds", [-2.0], [0.5]), (0.0, 1.0 / 2.0, 0.0)),
        (("add_nonlinear_derivative_bounds", [-1.0], [1.0], 2), (0.0, 0.0, 0.5)),
        (("add_nonlinear_derivative_bounds", [0.5], [2.0], 2), (0.0, 0.0, 0.5 / 2.0)),
        # The velocity ends as its largest, 1.5, and is 1 of at most 1 where the next begins.
        (("add_zero_derivative_constraints", 1), (1.0, 0.0, 0.0)),
        (("add_velocity_bounds", [-1.5], [1.5]), (0.0, 0.0, 0.0)),
    ],
)
def test_bounds_at_a_meeting_are_measured_on_what_was_found(bounds, excess):
    """Of two segments that are known in closed form, whatever a solver would say."""
    graph = GcsTrajectoryOptimization(1)
    first, second = (
        graph.add_regions([Hyperrectangle([0.0], [2.0])], 3, name=name) for name in "ab"
    )
    change = graph.add_edges(first, second)
    name, *arguments = bounds
    getattr(change, name)(*arguments)
    assert len(change.meeting_bounds) == 1
    at = np.array([0.0, 0.0, 0.0, 1.0, 2.0]), np.array([1.0, 4.0 / 3.0, 5.0 / 3.0, 2.0, 1.0])
    zero = np.zeros(1)
    steps = [
        Step(first.vertices[0], first, at[0], zero, 0, (), change.meeting_bounds),
        Step(second.vertices[0], second, at[1], zero, 0),
    ]
    assert _meeting_excess(steps) == pytest.approx(excess, abs=1e-12)


def test_what_is_asked_at_a_meeting_is_measured_and_kept():
    """From rest to rest, and a velocity at a change of modes."""
    graph, start, _, goal, (first, last) = around_a_corner()
    for edges in (first, last):
        edges.add_zero_derivative_constraints(1)
    last.add_velocity_bounds([-0.1, -0.1], [0.1, 0.1])
    trajectory, result = graph.solve_path(start, goal)
    assert result.unrest <= 1e-9
    assert result.velocity_excess <= 1e-9
    ends = trajectory.derivative().value([0.0, trajectory.end_time])
    np.testing.assert_allclose(ends, 0.0, atol=1e-9)


def test_costs_and_constraints_count_where_they_are_said_to():
    """A toll of the relaxation alone is no cost of what is found."""
    graph, start, free, goal, (first, _) = around_a_corner(2)
    _, plain = graph.solve_path(start, goal)
    assert plain.is_success
    free.add_vertex_cost(free.vertex_duration(), Transcription.RELAXATION)
    free.add_edge_cost(7.0, Transcription.RELAXATION)
    _, tolled = graph.solve_path(start, goal)
    assert tolled.cost == pytest.approx(plain.cost, rel=1e-6)
    free.add_edge_cost(7.0, Transcription.RESTRICTION)
    _, costly = graph.solve_path(start, goal)
    assert costly.cost == pytest.approx(plain.cost + 7.0, rel=1e-6)
    end = first.edge_constituent_vertex_control_points()[1][-1]
    first.add_edge_constraint(end[1] >= 0.9, Transcription.RESTRICTION)
    free.add_vertex_constraint(free.vertex_duration() >= 2.5, Transcription.RESTRICTION)
    trajectory, result = graph.solve_path(start, goal)
    assert result.is_success
    assert trajectory.segments[0].control_points[-1, 1] >= 0.9 - 1e-8
    assert all(s.end_time - s.start_time >= 2.5 - 1e-8 for s in trajectory.segments)


def test_cones_of_control_points_are_kept():
    """The first segment ends in a disc that is off its shortest way."""
    graph, start, _, goal, (first, _) = around_a_corner(2)
    end = first.edge_constituent_vertex_control_points()[1][-1]
    first.add_edge_constraint(norm(end - [2.9, 0.5]) <= 0.1)
    trajectory, result = graph.solve_path(start, goal)
    assert result.is_success
    assert np.linalg.norm(trajectory.segments[0].control_points[-1] - [2.9, 0.5]) <= 0.1 + 1e-7


def test_what_makes_no_sense_is_refused():
    """Orders without such derivatives, bounds that hold nothing, and searches."""
    graph, start, free, goal, (first, _) = around_a_corner(3)
    for to in (graph, free):
        with pytest.raises(ConvexSetError, match="continuity_order must be a whole number"):
            to.add_continuity_constraints(0)
        with pytest.raises(ConvexSetError, match="derivative_order must be a whole number"):
            to.add_nonlinear_derivative_bounds([-1.0] * 2, [1.0] * 2, 1)
        with pytest.raises(ConvexSetError, match=r"lb\[0\] = 1.0 must not be above"):
            to.add_nonlinear_derivative_bounds([1.0, -1.0], [0.0, 1.0], 2)
        with pytest.raises(ConvexSetError, match="lb must have the shape"):
            to.add_nonlinear_derivative_bounds([1.0], [2.0], 2)
    with pytest.raises(ConvexSetError, match="must not be above the order of both, 3"):
        free.add_continuity_constraints(4)
    with pytest.raises(ConvexSetError, match="must not be above that of the segments, 3"):
        free.add_nonlinear_derivative_bounds([-1.0] * 2, [1.0] * 2, 4)
    with pytest.raises(ConvexSetError, match="none of segments of order 3"):
        first.add_nonlinear_derivative_bounds([-1.0] * 2, [1.0] * 2, 4)
    with pytest.raises(ConvexSetError, match="must have one Transcription"):
        free.add_vertex_cost(free.vertex_duration(), "relaxation")
    free.add_continuity_constraints(1)
    with pytest.raises(ConvexSetError, match="convex_relaxation must not be False"):
        graph.solve_path(start, goal, GraphOfConvexSetsOptions(convex_relaxation=False))


def test_complexity_counts_what_is_asked():
    """A time cost is one variable of each region; continuity of q' adds to every edge."""
    graph, *_ = around_a_corner(2)
    before = graph.estimate_complexity()
    graph.add_time_cost(3.0)
    regions = sum(len(each.vertices) for each in graph.get_subgraphs() if each.order)
    assert graph.estimate_complexity() == before + regions
    graph.add_continuity_constraints(1)
    assert graph.estimate_complexity() > before + regions
    assert GcsTrajectoryOptimization(3).estimate_complexity() == 0


def along_a_line():
    """Return a problem of three boxes in a row, its start, regions, goal and edges."""
    graph = GcsTrajectoryOptimization(1)
    boxes = [Hyperrectangle([k - 0.2], [k + 1.2]) for k in range(3)]
    free = graph.add_regions(boxes, 4, h_min=0.1)
    start, goal = (graph.add_regions([Point([x])], 0) for x in (0.0, 3.0))
    between = graph.add_edges(start, free), graph.add_edges(free, goal)
    graph.add_time_cost()
    graph.add_velocity_bounds([-1.0], [1.0])
    return graph, start, free, goal, between


def test_one_search_is_enough_near_the_bound(monkeypatch):
    """Full speed all along costs what the convex part does; from rest to rest it is 3 s for 4."""
    searches = []
    solve = SmoothProgram.solve

    def counted(self, start, **how):
        searches.append(None)
        return solve(self, start, **how)

    monkeypatch.setattr(SmoothProgram, "solve", counted)
    options = GraphOfConvexSetsOptions(max_rounded_paths=1)
    graph, start, _, goal, _ = along_a_line()
    graph.add_continuity_constraints(2)
    trajectory, result = graph.solve_path(start, goal, options)
    assert result.cost == pytest.approx(3.0, abs=1e-6)
    assert trajectory.end_time == pytest.approx(3.0, abs=1e-6)
    assert len(searches) == 1
    searches.clear()
    graph, start, free, goal, between = along_a_line()
    for each in between:
        each.add_zero_derivative_constraints(1)
    free.add_nonlinear_derivative_bounds([-1.0], [1.0], 2)
    _, result = graph.solve_path(start, goal, options)
    # 1 s to full speed and 1 s from it cover 1 m, so that 2 m at 1 m/s are left.
    assert result.cost > 4.0
    # Another start ends at the same cost, so that no others follow.
    assert len(searches) == 2

"""Waits, whole turns at which regions meet, and the expressions of one subgraph alone."""

import numpy as np
import pytest

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperrectangle, Point, VPolytope
from scene_graph_ros.planning import GcsTrajectoryOptimization

TURN = 2.0 * np.pi


def line(graph, parts):
    """Add subgraphs, each given as (region, order, options), in a row; return the first and last.

    Regions that move are no faster than 2.
    """
    subgraphs = []
    for region, order, options in parts:
        subgraph = graph.add_regions([region], order, **options)
        if order:
            subgraph.add_velocity_bounds([-2.0], [2.0])
        if subgraphs:
            graph.add_edges(subgraphs[-1], subgraph)
        subgraphs.append(subgraph)
    return subgraphs[0], subgraphs[-1]


@pytest.mark.parametrize(
    ("options", "waited"), [({"h_min": 3.0}, 3.0), ({"h_max": 5.0}, 1e-6), ({}, 0.0)]
)
def test_a_region_of_order_0_is_waited_at_for_its_least_duration(options, waited):
    """From 0 to 4 and on to 10, no faster than 2: 2 s, the wait and 3 s."""
    graph = GcsTrajectoryOptimization(1)
    start, goal = line(
        graph,
        [
            (Point([0.0]), 0, {}),
            (Hyperrectangle([0.0], [4.0]), 1, {}),
            (Point([4.0]), 0, options),
            (Hyperrectangle([4.0], [10.0]), 1, {}),
            (Point([10.0]), 0, {}),
        ],
    )
    graph.add_time_cost()
    trajectory, result = graph.solve_path(start, goal)
    assert result.cost == pytest.approx(5.0 + waited, abs=1e-7)
    assert trajectory.end_time == pytest.approx(5.0 + waited, abs=1e-7)
    at = trajectory.value(np.linspace(2.0, 2.0 + waited, 5))
    np.testing.assert_allclose(at, 4.0, atol=1e-6)


def test_a_trajectory_may_be_a_wait_alone():
    """Two regions of order 0 at one place, one of them with a duration."""
    graph = GcsTrajectoryOptimization(1)
    start, goal = line(graph, [(Point([1.0]), 0, {}), (Point([1.0]), 0, {"h_min": 2.0})])
    graph.add_time_cost()
    trajectory, result = graph.solve_path(start, goal)
    assert trajectory.end_time == pytest.approx(2.0, abs=1e-8)
    assert result.cost == pytest.approx(2.0, abs=1e-8)
    np.testing.assert_array_equal(trajectory.value(1.0), [1.0])


@pytest.mark.parametrize("turns", [-2, -1, 0, 3])
def test_offsets_of_edges_given_by_hand_are_found(turns):
    """The second region is the first one's neighbour after whole turns of joint 1."""
    graph = GcsTrajectoryOptimization(2, [1])
    here = graph.add_regions([Hyperrectangle([0.0, 0.0], [1.0, 2.0])], 1)
    there = graph.add_regions(
        [Hyperrectangle([0.5, 1.5 + turns * TURN], [1.0, 3.0 + turns * TURN])],
        1,
        edges_between_regions=[],
    )
    between = graph.add_edges(here, there, edges_between_regions=[(0, 0)])
    start = graph.add_regions([Point([0.0, 0.5])], 0)
    goal = graph.add_regions([Point([1.0, 2.5 + turns * TURN])], 0)
    graph.add_edges(start, here)
    graph.add_edges(there, goal)
    graph.add_path_length_cost()
    np.testing.assert_array_equal(between.offset_of(between.edges[0]), [0.0, turns * TURN])
    trajectory, result = graph.solve_path(start, goal)
    assert result.is_success
    assert result.cost == pytest.approx(np.hypot(1.0, 2.0), rel=1e-6)
    assert trajectory is not None


def test_regions_inside_of_a_subgraph_find_their_offsets_too():
    """One direction is given, so one edge is there; its offset is minus a turn."""
    graph = GcsTrajectoryOptimization(1, [0])
    regions = [Hyperrectangle([TURN], [TURN + 1.0]), Hyperrectangle([0.5], [2.0])]
    subgraph = graph.add_regions(regions, 1, edges_between_regions=[(0, 1)])
    (edge,) = subgraph.edges
    np.testing.assert_array_equal(subgraph.offset_of(edge), [-TURN])


def test_an_edge_given_between_regions_that_never_meet_leads_nowhere():
    """It is there, as asked, and no path leads along it."""
    graph = GcsTrajectoryOptimization(1, [0])
    start = graph.add_regions([Point([0.0])], 0)
    goal = graph.add_regions([Hyperrectangle([1.0], [2.0])], 1)
    assert len(graph.add_edges(start, goal, edges_between_regions=[(0, 0)]).edges) == 1
    trajectory, result = graph.solve_path(start, goal)
    assert trajectory is None
    assert not result.is_success


@pytest.mark.parametrize(
    ("subspace", "at"),
    [
        (Point([2.75 + 3 * TURN]), 2.75),
        (Hyperrectangle([2.6 - TURN], [2.7 - TURN]), 2.6),
        (HPolyhedron([[1.0], [-1.0]], [2.7 - 2 * TURN, -2.6 + 2 * TURN]), 2.6),
        (HPolyhedron([[-1.0]], [-2.8]), 2.8),
    ],
)
def test_a_subspace_is_met_after_whole_turns(subspace, at):
    """Regions [0, 3] and [2.5, 5.5] meet in it; the first point of the second one is there."""
    graph = GcsTrajectoryOptimization(1, [0])
    first = graph.add_regions([Hyperrectangle([0.0], [3.0])], 1)
    second = graph.add_regions([Hyperrectangle([2.5], [5.5])], 1)
    assert len(graph.add_edges(first, second, subspace).edges) == 1
    start, goal = graph.add_regions([Point([0.0])], 0), graph.add_regions([Point([2.5])], 0)
    graph.add_edges(start, first)
    graph.add_edges(second, goal)
    graph.add_path_length_cost()
    trajectory, _ = graph.solve_path(start, goal)
    met = trajectory.segments[1].initial_value[0]
    assert met == pytest.approx(at, abs=1e-6)


def test_a_subspace_in_which_regions_do_not_meet_joins_nothing():
    """At no turn is 4 in both."""
    graph = GcsTrajectoryOptimization(1, [0])
    first = graph.add_regions([Hyperrectangle([0.0], [3.0])], 1)
    second = graph.add_regions([Hyperrectangle([2.5], [5.5])], 1)
    assert not graph.add_edges(first, second, Point([4.0 + TURN])).edges


def test_regions_as_wide_as_half_a_turn_are_refused_with_edges_given():
    """As they are without, of both subgraphs and with offsets, too."""
    graph = GcsTrajectoryOptimization(2, [1])
    wide = Hyperrectangle([0.0, 0.0], [1.0, 3.2])
    tilted = VPolytope([[0.0, 0.0], [1.0, 4.0]])
    narrow = graph.add_regions([Hyperrectangle([0.0, 0.0], [9.0, 3.1])], 1)
    for region in (wide, tilted):
        with pytest.raises(ConvexSetError, match=r"wide along joint 1.*narrower than pi"):
            graph.add_regions([region], 1, edges_between_regions=[])
    assert graph.get_subgraphs() == [narrow]
    assert len(graph.graph_of_convex_sets.vertices) == 1


def test_expressions_of_another_subgraph_are_refused():
    """Of other regions, of edges, of another object: each would be read as something else."""
    graph, other = GcsTrajectoryOptimization(1), GcsTrajectoryOptimization(1)
    box = Hyperrectangle([0.0], [1.0])
    mine, next_ = graph.add_regions([box], 2), graph.add_regions([box], 2)
    between = graph.add_edges(mine, next_)
    foreign = other.add_regions([box], 2)
    for expression in (next_.vertex_duration(), foreign.vertex_duration()):
        with pytest.raises(ConvexSetError, match="of another subgraph or its edges"):
            mine.add_vertex_cost(expression)
        with pytest.raises(ConvexSetError, match="of another subgraph or its edges"):
            mine.add_vertex_constraint(expression <= 1.0)
    before, after = between.edge_constituent_vertex_durations()
    with pytest.raises(ConvexSetError, match="of another subgraph or its edges"):
        mine.add_edge_cost(before + after)
    with pytest.raises(ConvexSetError, match="of another subgraph or its edges"):
        between.add_edge_constraint(mine.vertex_duration() <= 1.0)
    mine.add_vertex_cost(mine.vertex_duration())
    between.add_edge_constraint(before == after)


@pytest.mark.parametrize("h_max", [20.0, 1e-3])
def test_a_way_that_may_take_no_time_is_refused(h_max):
    """Its duration is zero up to what the solver is off by, so q(t) would jump."""
    graph = GcsTrajectoryOptimization(1)
    start = graph.add_regions([Point([0.0])], 0)
    way = graph.add_regions([Hyperrectangle([0.0], [1.0])], 1, 0.0, h_max)
    goal = graph.add_regions([Point([1.0])], 0)
    graph.add_edges(start, way)
    graph.add_edges(way, goal)
    graph.add_time_cost()
    with pytest.raises(SolverError, match="takes no time; give add_regions an h_min above 0"):
        graph.solve_path(start, goal)


def test_a_short_way_at_a_bounded_speed_takes_the_time_that_it_takes():
    """1e-9 at a speed of 2 are 0.5 ns, with a least duration of zero."""
    graph = GcsTrajectoryOptimization(1)
    start, goal = line(
        graph,
        [
            (Point([0.0]), 0, {}),
            (Hyperrectangle([0.0], [1.0]), 1, {"h_min": 0.0}),
            (Point([1e-9]), 0, {}),
        ],
    )
    graph.add_time_cost()
    trajectory, _ = graph.solve_path(start, goal)
    assert trajectory is None or 0.0 < trajectory.end_time < 1e-7

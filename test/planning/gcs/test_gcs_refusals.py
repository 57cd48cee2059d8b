"""What trajectories through regions cannot be, and how that is said."""

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    Point,
)
from scene_graph_ros.planning import GcsTrajectoryOptimization
from scene_graph_ros.planning.trajectories import (
    BezierCurve,
    CompositeTrajectory,
    PiecewisePolynomial,
    TrajectoryError,
)

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


def test_what_can_not_be_is_said_with_its_reason():
    """No way at all, one that would be too slow, one that has to be through nothing."""
    apart = boxes([([0, 0], [1, 1]), ([2, 0], [3, 1])])
    graph, begin, _, end = through(apart, (0.5, 0.5), (2.5, 0.5))
    trajectory, result = graph.solve_path(begin, end)
    assert trajectory is None
    assert not result.is_success
    assert (result.cost, result.gap) == (np.inf, np.inf)
    assert result.reason == "no edges lead from 'start[0]' to 'goal[0]'"
    slow, begin, _, end = through(boxes(L_SHAPE), (0.0, 0.5), (2.5, 2.5), h_max=1.0)
    slow.add_velocity_bounds([-1.0, -1.0], [1.0, 1.0])
    slow.add_time_cost()
    trajectory, result = slow.solve_path(begin, end)
    assert trajectory is None
    assert result.reason == "no path keeps the constraints of its edges, which is proven"


def test_where_no_region_takes_time_there_is_a_path_and_no_trajectory():
    """Regions of order 0 alone are points that follow one another."""
    graph = GcsTrajectoryOptimization(1)
    both = [graph.add_regions([Hyperrectangle([k], [k + 1.0])], 0) for k in (0.0, 1.0)]
    graph.add_edges(*both)
    trajectory, result = graph.solve_path(*both)
    assert result.is_success
    assert trajectory is None
    assert len(result.vertices) == 2


def test_what_makes_no_sense_is_refused_by_name():
    """The message has the argument and its value, and nothing is left in the graph."""
    graph = GcsTrajectoryOptimization(2, [1])
    box, wide = Hyperrectangle([0, 0], [1, 1]), Hyperrectangle([0, 0], [1, 4])
    free = graph.add_regions([box], 2, name="free")
    still = graph.add_regions([box], 0, name="still")
    change = graph.add_edges(still, free)
    other = GcsTrajectoryOptimization(2).add_regions([box], 1)
    count = graph.graph_of_convex_sets.num_vertices
    for call, words in [
        (lambda: GcsTrajectoryOptimization(0), "num_positions must be a whole number, at least 1"),
        (lambda: GcsTrajectoryOptimization(2, [2]), "different whole numbers from 0 to 1"),
        (lambda: GcsTrajectoryOptimization(2, [1, 1]), r"not \[1, 1\]"),
        (lambda: graph.add_regions([], 1), "regions must be one set or more, not empty"),
        (lambda: graph.add_regions([3], 1), r"regions\[0\] must be a ConvexSet, not 3"),
        (lambda: graph.add_regions([Point([0.0])], 1), r"regions\[0\] has 1 dimensions"),
        (lambda: graph.add_regions([box], 1.5), "order must be a whole number, .* not 1.5"),
        (lambda: graph.add_regions([box], -1), "order must be a whole number, .* not -1"),
        (lambda: graph.add_regions([box], 1, np.nan), "h_min must be a finite number, .* nan"),
        (lambda: graph.add_regions([box], 1, 2.0, 1.0), "h_min = 2.0 must not be above h_max"),
        (lambda: graph.add_regions([wide], 1), "is 4 wide along joint 1, .* narrower than pi"),
        (
            lambda: graph.add_regions([HPolyhedron([[1.0, 0.0]], [1.0])], 1, name="half"),
            r"set of 'half\[0\]', .* is unbounded",
        ),
        (
            lambda: graph.add_regions([box], 1, edges_between_regions=[(0, 1)]),
            r"edges_between_regions\[0\]\[1\] must be below 1",
        ),
        (
            lambda: graph.add_regions([box], 1, edges_between_regions=[], edge_offsets=[[0, 0]]),
            "edge_offsets must be as many as edges_between_regions, 0, not 1",
        ),
        (lambda: graph.add_edges(other, free), "from_subgraph must be a subgraph of this object"),
        (lambda: graph.add_edges(free, free), "to_subgraph must be another one"),
        (
            lambda: graph.add_edges(free, still, Hyperellipsoid.make_unit_ball(2)),
            "subspace must be a Point, Hyperrectangle or HPolyhedron",
        ),
        (lambda: graph.add_edges(free, still, Point([1.0])), "subspace has 1 dimensions"),
        (lambda: graph.add_time_cost(np.nan), "weight must be a finite number, .* not nan"),
        (lambda: graph.add_path_length_cost(np.eye(3)), "weight must have the shape"),
        (lambda: free.add_path_energy_cost([[1.0, 0.0]]), r"the shape \(2, 2\), not \(1, 2\)"),
        (
            lambda: graph.add_velocity_bounds([0.0], [1.0, 1.0]),
            r"lb must have the shape \(2,\), not \(1,\)",
        ),
        (
            lambda: graph.add_velocity_bounds([0.0, np.nan], [1.0, 1.0]),
            r"lb\[1\] must bound something, not nan",
        ),
        (
            lambda: free.add_velocity_bounds([0.0, 2.0], [1.0, 1.0]),
            r"lb\[1\] = 2.0 must not be above ub\[1\] = 1.0",
        ),
        (lambda: still.add_velocity_bounds([0, 0], [1, 1]), "take no time"),
        (still.add_path_length_cost, "stood in, not moved through"),
        (lambda: graph.add_path_continuity_constraints(0), "continuity_order must be a whole"),
        (lambda: free.add_path_continuity_constraints(3), "above the order of both, 2, not 3"),
        (lambda: change.add_zero_derivative_constraints(3), "none of segments of order 2"),
        (lambda: graph.solve_path(other, free), "source must be a subgraph of this object"),
        (lambda: graph.remove_subgraph(other), "subgraph must be a subgraph of this object"),
    ]:
        with pytest.raises(ConvexSetError, match=words):
            call()
    assert graph.graph_of_convex_sets.num_vertices == count


def test_what_can_not_be_unwrapped_is_refused():
    """A jump that is no whole turn, rounds that are none, curves of another kind."""
    unwrap = GcsTrajectoryOptimization.unwrap_to_continuous_trajectory
    first = BezierCurve(0.0, 1.0, [[0.0], [1.0]])
    chain = CompositeTrajectory((first, BezierCurve(1.0, 2.0, [[1.5], [2.0]])))
    with pytest.raises(TrajectoryError, match=r"entry 0 begins segment 1 at 1\.5, which is 0\.5"):
        unwrap(chain, [0])
    assert unwrap(chain, [0], tol=0.6).num_segments == 2
    with pytest.raises(TrajectoryError, match=r"starting_rounds must be 1 whole numbers"):
        unwrap(chain, [0], [0.5])
    with pytest.raises(ConvexSetError, match="different whole numbers from 0 to 0"):
        unwrap(chain, [1])
    hold = PiecewisePolynomial.first_order_hold([0.0, 1.0], [[0.0], [1.0]])
    with pytest.raises(TrajectoryError, match=r"segments\[0\] must be a BezierCurve"):
        GcsTrajectoryOptimization.normalize_segment_times(CompositeTrajectory((hold,)))

"""Stops where segments meet: choices whose convex part costs too much are not made smooth."""

import numpy as np
import pytest

from scene_graph_ros.convex.graphs.search.with_slack import solve_restriction
from scene_graph_ros.convex.solve.interior_point import InteriorPoint
from scene_graph_ros.convex.solve.smooth_program import SmoothProgram
from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperrectangle, Point
from scene_graph_ros.planning import GcsTrajectoryOptimization

CORRIDOR = [
    ([-0.59, -0.34], [1.83, 0.34]),
    ([0.48, -0.77], [2.0, 2.15]),
    ([0.85, 0.7], [3.06, 2.07]),
    ([2.26, 0.75], [6.91, 2.02]),
]
ENDS = [[0.0, 0.0], [6.5, 1.39]]


def along_a_corridor():
    """Return a problem with bounded velocities and accelerations, and its start and goal."""
    c, s = np.cos(0.5), np.sin(0.5)
    turned = np.array([[c, -s], [s, c]])
    rows = np.concatenate([turned.T, -turned.T])
    sets = [HPolyhedron(rows, np.append(high, np.negative(low))) for low, high in CORRIDOR]
    graph = GcsTrajectoryOptimization(2)
    free = graph.add_regions(sets, 6, h_min=0.01)
    start, goal = (graph.add_regions([Point(turned @ at)], 0) for at in ENDS)
    graph.add_edges(start, free)
    graph.add_edges(free, goal)
    graph.add_time_cost()
    graph.add_path_length_cost(0.1)
    graph.add_velocity_bounds([-1.0, -1.0], [1.0, 1.0])
    graph.add_path_continuity_constraints(1)
    graph.add_continuity_constraints(1)
    graph.add_nonlinear_derivative_bounds([-2.0, -2.0], [2.0, 2.0], 2)
    return graph, start, goal


def test_few_choices_of_stops_are_made_smooth(monkeypatch):
    """The cost is that of trying all: with equal durations, untied, and with the best stop."""
    pytest.importorskip("casadi")
    graph, start, goal = along_a_corridor()
    made, solve = [], SmoothProgram.solve

    def counted(self, *arguments, **options):
        made.append(id(self))
        return solve(self, *arguments, **options)

    monkeypatch.setattr(SmoothProgram, "solve", counted)
    trajectory, result = graph.solve_path(start, goal)
    assert result.is_success
    assert abs(trajectory.jumps(1)).max() <= 1e-9
    # Where all stops are made smooth, there are six, of a cost of 6.75752.
    assert len(made) <= 4
    assert result.cost <= 6.7576
    assert result.lower_bound <= result.cost


def test_bounded_accelerations_do_not_need_ipopt(monkeypatch):
    """Its answer and that of the interior-point method before it are the same."""
    pytest.importorskip("casadi")
    graph, start, goal = along_a_corridor()
    with monkeypatch.context() as without:
        without.setattr(SmoothProgram, "_run", None)
        ours = graph.solve_path(start, goal)[1]
    monkeypatch.setattr(InteriorPoint, "solve", lambda self, *_: (self._y, False))
    theirs = graph.solve_path(start, goal)[1]
    assert ours.cost == pytest.approx(theirs.cost, rel=1e-6)
    assert ours.lower_bound == theirs.lower_bound


def test_a_path_that_costs_a_limit_has_its_bound_alone():
    """And one that costs less is as without a limit."""
    pytest.importorskip("casadi")
    graph, start, goal = along_a_corridor()
    result = graph.solve_path(start, goal)[1]
    edges = {edge.id: edge for edge in graph.graph_of_convex_sets.edges}
    way = [edges[number] for number in result.graph_result.path]
    way = [edge for edge in way if edge.u.ambient_dimension and edge.v.ambient_dimension]
    free = solve_restriction(way, None, None, None)
    for limit, is_success in ((free.lower_bound * 0.99, False), (free.cost * 1.01, True)):
        found = solve_restriction(way, None, None, None, limit)
        assert found.is_success is is_success
        assert found.lower_bound == free.lower_bound
        assert found.cost == (free.cost if is_success else np.inf)


FAR_OFF = {
    "accelerations": (
        [([-0.8, -0.3], [0.5, 3.9]), ([-0.3, 2.9], [2.9, 4.4]), ([-0.1, 2.8], [2.9, 4.7]),
         ([0.2, 3.3], [3.2, 4.8])],
        [[0.0, 0.0], [2.9, 3.7]], 4, 0.1, 0),
    "stops": (
        [([-0.4, -0.6], [3.5, 0.4]), ([2.6, -0.1], [4.1, 3.6]), ([3.0, 2.7], [8.0, 3.6]),
         ([3.6, 2.5], [8.2, 3.4])],
        [[0.0, 0.0], [4.2, 3.1]], 5, 0.1, 1),
    "times": (
        [([-0.8, -0.3], [0.5, 4.9]), ([-1.9, 3.3], [0.5, 4.3])],
        [[0.0, 0.0], [-1.4, 4.0]], 5, 0.0, 1),
}  # fmt: skip
"""Boxes, start and goal, the order, the weight of lengths, and the path's continuity."""


@pytest.mark.parametrize("kind", FAR_OFF)
def test_starts_that_break_bounds_do_not_need_ipopt(kind, monkeypatch):
    """From rest to rest with continuous accelerations of at most 1 m/s2, at most 1 m/s.

    Convex starts are too fast by far. Limits hold at all times, whatever the durations are.
    """
    pytest.importorskip("casadi")
    boxes, ends, order, weight, continuity = FAR_OFF[kind]
    graph = GcsTrajectoryOptimization(2)
    free = graph.add_regions([Hyperrectangle(*box) for box in boxes], order, h_min=0.01)
    start, goal = (graph.add_regions([Point(at)], 0) for at in ends)
    for edges in (graph.add_edges(start, free), graph.add_edges(free, goal)):
        edges.add_zero_derivative_constraints(1)
    graph.add_time_cost()
    if weight:
        graph.add_path_length_cost(weight)
    graph.add_velocity_bounds([-1.0, -1.0], [1.0, 1.0])
    if continuity:
        graph.add_path_continuity_constraints(continuity)
    for k in (1, 2):
        graph.add_continuity_constraints(k)
    graph.add_nonlinear_derivative_bounds([-1.0, -1.0], [1.0, 1.0], 2)
    monkeypatch.setattr(SmoothProgram, "_run", None)
    trajectory, result = graph.solve_path(start, goal)
    assert result.is_success
    assert 0.0 < result.lower_bound <= result.cost
    at = np.linspace(0.0, trajectory.end_time, 500)
    for k in (1, 2):
        assert abs(trajectory.derivative(k).value(at)).max() <= 1.0 + 1e-8
        assert abs(trajectory.jumps(k)).max() <= 1e-7

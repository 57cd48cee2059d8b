"""Copies of trajectory optimizations, whose changes leave the original alone."""

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    GraphOfConvexSetsOptions,
    Hyperrectangle,
    Point,
)
from scene_graph_ros.planning import GcsTrajectoryOptimization


def along_a_line():
    """Return two boxes in a row from 0 to 3, at most 1 m/s, and start and goal."""
    graph = GcsTrajectoryOptimization(1)
    boxes = [Hyperrectangle([0.0], [2.0]), Hyperrectangle([1.0], [3.0])]
    free = graph.add_regions(boxes, 3, h_min=0.1, name="free")
    start, goal = (graph.add_regions([Point([x])], 0) for x in (0.0, 3.0))
    graph.add_edges(start, free)
    graph.add_edges(free, goal)
    graph.add_time_cost()
    graph.add_velocity_bounds([-1.0], [1.0])
    graph.add_continuity_constraints(1)
    return graph, start, goal


def test_a_clone_has_the_same_answer_and_changes_alone():
    """3 m at 1 m/s; at half the speed, which only the clone is told, 6 s."""
    graph, start, goal = along_a_line()
    options = GraphOfConvexSetsOptions(max_rounded_paths=1)
    clone = graph.clone()
    own = clone.get_subgraphs()
    assert [each.name for each in own] == [each.name for each in graph.get_subgraphs()]
    assert own[0].regions[0] is graph.get_subgraphs()[0].regions[0]
    trajectory, result = clone.solve_path(own[1], own[2], options)
    expected, _ = graph.solve_path(start, goal, options)
    assert result.is_success
    times = np.linspace(0.0, 3.0, 7)
    np.testing.assert_allclose(trajectory.value(times), expected.value(times), atol=1e-6)
    own[0].add_velocity_bounds([-0.5], [0.5])
    assert clone.solve_path(own[1], own[2], options)[0].end_time == pytest.approx(6.0, abs=1e-4)
    assert graph.solve_path(start, goal, options)[0].end_time == pytest.approx(3.0, abs=1e-4)
    clone.remove_subgraph(own[0])
    assert len(graph.get_subgraphs()) == 3
    with pytest.raises(ConvexSetError, match="source must be a subgraph of this object"):
        clone.solve_path(start, goal, options)

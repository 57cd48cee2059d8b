"""Answers block by block: the same rows, and no more of them than were asked for."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.query.blocks import (
    apart_from_context,
    joined,
    point_distance_blocks,
    signed_distance_blocks,
    widening_distances,
)
from scene_graph_ros.geometry.query.candidates.rows import pair_memory

COUNT = 12


@pytest.fixture
def query():
    """Ask about balls in a row, at 0, 1, 2, ... m."""
    graph = SceneGraph()
    source = graph.register_source("s")
    for i in range(COUNT):
        frame = graph.register_frame(source, GeometryFrame(f"f{i}"))
        instance = GeometryInstance(np.eye(4), Sphere(0.1), f"b{i}")
        ball = graph.register_geometry(source, frame, instance)
        graph.assign_role(source, ball, ProximityProperties())
    context = graph.create_default_context()
    X_WF = np.tile(np.eye(4), (COUNT, 1, 1))
    X_WF[:, 0, 3] = np.arange(COUNT)
    context.set_frame_poses(source, X_WF)
    return graph.query_object(context)


def assert_same(one, other):
    """Assert that two tables have the same columns, to the last bit."""
    assert set(one.columns) == set(other.columns)
    for name, column in one.columns.items():
        np.testing.assert_array_equal(column, other.columns[name])


@pytest.mark.parametrize("rows", [1, 12, 30, 1000])
@pytest.mark.parametrize("threshold", [-1.0, 2.5, 1e6, np.inf])
def test_points_block_by_block(query, rows, threshold):
    """Each block keeps within its rows, and all together are what one question answers."""
    points = np.random.default_rng(1).uniform(0.0, COUNT, (40, 3))
    blocks = list(point_distance_blocks(query, points, threshold, rows=rows))
    assert max(map(len, blocks)) <= max(rows, COUNT)
    assert_same(joined(blocks), query.compute_signed_distance_to_points(points, threshold))


def test_no_points_are_one_empty_block(query):
    """Where nothing is asked the table is there, and empty."""
    blocks = list(point_distance_blocks(query, np.zeros((0, 3)), 1.0, rows=10))
    assert [len(block) for block in blocks] == [0]


@pytest.mark.parametrize("rows", [1, 7, 1000])
@pytest.mark.parametrize("max_distance", [-1.0, 2.5, 1e6, np.inf])
def test_pairs_block_by_block(query, rows, max_distance):
    """The same for pairs."""
    blocks = list(signed_distance_blocks(query, max_distance, rows=rows))
    assert max(map(len, blocks)) <= rows
    whole = query.compute_signed_distance_pairwise_closest_points(max_distance)
    assert_same(joined(blocks), whole)


def test_distances_widen_up_to_the_one_asked_for(query):
    """They double up to the scene's extent, 11 m here, and stay below what is asked for."""
    expected = [11.0 * 0.5**k for k in range(6, -1, -1)]
    assert list(widening_distances(query, 1e6)) == pytest.approx(expected)
    assert list(widening_distances(query, 1.0)) == pytest.approx(expected[:3])
    assert list(widening_distances(query, 0.0)) == []


def test_searches_apart_do_not_disturb_the_context(query):
    """What the context remembers of its own search is there afterwards."""
    query.find_collision_candidates()
    memory = pair_memory(query.snapshot)
    list(signed_distance_blocks(apart_from_context(query), 3.0, rows=5))
    assert pair_memory(query.snapshot) is memory
    assert list(memory._trackers) == [0.0]

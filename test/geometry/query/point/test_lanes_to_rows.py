"""Numbers in lanes become rows of columns, and poses become lanes."""

import numpy as np
import pytest

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.compiled.streams import finish_streams
from scene_graph_ros.geometry.query.point.answers import LARGE, new_answers
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.query.point.lanes import take_poses
from scene_graph_ros.geometry.query.point.lanes_to_rows import (
    ANSWER,
    put_square,
    SQUARE,
    stream_square,
)

STRIDE = 40


@lean_kernel
def put(answers, columns, at, is_streamed):
    """Put all lanes' answers into columns."""
    for lane in range(0, LANES, SQUARE):
        if is_streamed:
            stream_square(answers, lane, columns, at + lane * STRIDE, STRIDE)
        else:
            put_square(answers, lane, columns, at + lane * STRIDE, STRIDE)
    finish_streams()


@lean_kernel
def take(X_WG, rows, poses):
    """Take the poses of the second tile."""
    take_poses(X_WG, rows, 1, poses)


@pytest.mark.parametrize("is_streamed", [False, True])
@pytest.mark.parametrize("other", [[], [(0, 0)], [(7, 31), (3, 12), (3, 13)]])
def test_squares(is_streamed, other):
    """Each number has its place, also where some answers are not unique, and nothing else has."""
    rng = np.random.default_rng(5)
    answers = rng.uniform(1, 2, (SQUARE, 8, LANES))
    answers[:, 7] = 1.0
    for row, lane in other:
        answers[row, 7, lane] = 0.0
    columns = new_answers(LARGE)
    for column in columns:
        column[:] = 0
    put(answers.reshape(SQUARE * ANSWER), columns, 16, is_streamed)
    phi, p_GN, grad_W, unique = (column.reshape(LARGE, -1).squeeze() for column in columns)
    for lane in range(LANES):
        to = slice(16 + lane * STRIDE, 16 + lane * STRIDE + SQUARE)
        np.testing.assert_array_equal(phi[to], answers[:, 0, lane])
        np.testing.assert_array_equal(p_GN[to], answers[:, 1:4, lane])
        np.testing.assert_array_equal(grad_W[to], answers[:, 4:7, lane])
        np.testing.assert_array_equal(unique[to], answers[:, 7, lane] != 0.0)
    assert np.count_nonzero(phi) == SQUARE * LANES
    assert np.count_nonzero(unique) == SQUARE * LANES - len(other)


def test_poses_of_a_tile():
    """The first three rows of each pose are there, number by number, in the order of the tile."""
    rng = np.random.default_rng(6)
    X_WG = rng.normal(size=(100, 4, 4))
    rows = rng.integers(0, 100, (3, LANES))
    poses = np.zeros(22 * LANES)
    take(X_WG, rows, poses)
    np.testing.assert_array_equal(
        poses.reshape(-1, LANES)[:12].T, X_WG[rows[1], :3].reshape(LANES, 12)
    )

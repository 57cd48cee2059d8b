"""States of a map in a grid elsewhere: against points in each voxel."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Voxel
from scene_graph_ros.sensing.voxel_resampling import resampled_states


def states_at(states, cells, p_Ms):
    """Return the states at points of a map, unknown outside."""
    at = np.floor(p_Ms / np.array(cells)).astype(np.int64)
    inside = ((at >= 0) & (at < states.shape)).all(axis=-1)
    result = np.full(inside.shape, int(Voxel.UNKNOWN))
    result[inside] = states[tuple(at[inside].T)]
    return result


def seen_by_points(states, cells, X_MG, counts, voxel, samples):
    """Return the states that a grid's voxels have at points inside of them, ``(..., samples)``."""
    middles = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1)
    p_Gs = (middles[..., np.newaxis, :] + samples) * voxel
    return states_at(states, cells, p_Gs @ X_MG[:3, :3].T + X_MG[:3, 3])


@pytest.mark.parametrize("is_turned", [False, True])
@pytest.mark.parametrize("edge", [0.05, 0.1, 0.23])
def test_no_voxel_is_free_of_which_a_part_is_not(is_turned, edge):
    """Nor unknown where a part is occupied; of parallel axes it is not more than that either."""
    rng = np.random.default_rng(4)
    states = rng.choice([0, 1, 2], (12, 9, 10), p=[0.9, 0.05, 0.05]).astype(np.uint8)
    counts, cells = (7, 8, 6), (0.1, 0.1, 0.1)
    along = np.array([1e-5, 0.25, 0.5, 0.75, 1.0 - 1e-5])
    samples = np.stack(np.meshgrid(along, along, along), axis=-1).reshape(-1, 3)
    for _ in range(3):
        X = np.eye(4)
        if is_turned:
            X[:3, :3] = Rotation.random(rng=rng).as_matrix()
        X[:3, 3] = rng.uniform(-0.2, 0.6, 3)
        got = resampled_states(states, cells, X, counts, edge)
        seen = seen_by_points(states, cells, X, counts, edge, samples)
        has_occupied = (seen == 1).any(axis=-1)
        assert (got[has_occupied] == 1).all()
        assert (got[(seen == 2).any(axis=-1)] != 0).all()
        if not is_turned and edge >= 0.1:
            few = (got == 0) != (seen == 0).all(axis=-1)
            assert few.mean() < 0.02  # a sliver that no sample hit


def test_voxels_that_coincide_are_copied_wherever_the_grid_begins():
    """To the bit, with rounding of the offset; what is outside is unknown."""
    rng = np.random.default_rng(5)
    states = rng.integers(0, 3, (20, 30, 10)).astype(np.uint8)
    X = np.eye(4)
    X[:3, 3] = np.array([3, -4, 2]) * 0.05 + 1e-9
    got = resampled_states(states, (0.05,) * 3, X, (25, 30, 10), 0.05)
    assert (got[:17, 4:, :8] == states[3:, :26, 2:]).all()
    assert (got[17:] == 2).all()
    assert (got[:, :4] == 2).all()
    assert (got[:, :, 8:] == 2).all()
    twice = resampled_states(states, (0.05,) * 3, np.eye(4), (10, 15, 5), 0.1)
    eight = states.reshape(10, 2, 15, 2, 5, 2).transpose(0, 2, 4, 1, 3, 5).reshape(10, 15, 5, 8)
    expected = np.where((eight == 1).any(-1), 1, np.where((eight == 2).any(-1), 2, 0))
    assert (twice == expected).all()


def test_a_flat_map_holds_at_all_heights():
    """Below and above, and for a grid that is far away or below the map's plane."""
    states = np.array([[0, 1], [2, 0]], np.uint8)[:, :, np.newaxis]
    for height in (0.0, -7.0, 1e6):
        X = np.eye(4)
        X[2, 3] = height
        got = resampled_states(states, (1.0, 1.0, np.inf), X, (2, 2, 3), 1.0)
        assert (got == states).all()


def test_a_grid_that_is_nowhere_near_is_unknown():
    """Nor does a map of nothing, or a grid of nothing, cost more than an answer."""
    far = np.eye(4)
    far[0, 3] = 1e15
    states = np.zeros((3, 3, 3), np.uint8)
    assert (resampled_states(states, (0.3,) * 3, far, (2, 2, 2), 0.1) == 2).all()
    assert (resampled_states(states, (0.1,) * 3, far, (2, 2, 2), 0.1) == 2).all()
    none = np.zeros((0, 3, 3), np.uint8)
    assert (resampled_states(none, (0.3,) * 3, np.eye(4), (2, 2, 2), 0.1) == 2).all()
    assert resampled_states(states, (0.3,) * 3, far, (0, 2, 2), 0.1).shape == (0, 2, 2)


def test_maps_of_parallel_axes_are_those_of_a_map_that_is_hardly_turned():
    """Axis by axis, or voxel by voxel; with a flat map, and grids that reach beyond it."""
    rng = np.random.default_rng(6)
    tiny = Rotation.from_rotvec([0.0, 0.0, 3e-9]).as_matrix()
    for cells in ((0.1, 0.1, 0.1), (0.03, 0.03, np.inf), (0.5, 0.5, 0.2)):
        states = rng.choice([0, 1, 2], (21, 17, 1 if cells[2] == np.inf else 9), p=[0.8, 0.1, 0.1])
        for _ in range(5):
            X = np.eye(4)
            X[:3, 3] = rng.uniform(-0.4, 0.4, 3)
            turned = X.copy()
            turned[:3, :3] = tiny
            one, other = (
                resampled_states(states.astype(np.uint8), cells, pose, (15, 12, 11), 0.077)
                for pose in (X, turned)
            )
            assert (one == other).all()
            assert (one != 2).any()

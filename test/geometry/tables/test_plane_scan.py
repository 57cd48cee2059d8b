"""The highest of many planes, and the next, are those of numpy, also among equal ones."""

import numba
import numpy as np
import pytest

from scene_graph_ros.geometry.tables.plane_scan import highest_of_planes, PLANE_STRIDE
from scene_graph_ros.geometry.tables.vertex_scan import GROUP

START = 3
"""Where the groups begin: not at the start of a line of the cache."""


@numba.njit
def highest(blocks, groups, p):
    """Call the kernel, which only kernels can."""
    return highest_of_planes(blocks, START, groups, p)


def groups_of(normals, offsets):
    """Return planes in groups, filled up as those of hulls are."""
    missing = -len(normals) % GROUP
    normals = np.concatenate([normals, np.repeat(normals[-1:], missing, axis=0)])
    rows = np.column_stack([normals, np.append(offsets, np.full(missing, np.inf))])
    rows = np.column_stack([rows, np.full(len(rows), np.nan)])
    numbers = rows.reshape(-1, GROUP, 5).swapaxes(1, 2).ravel()
    return np.concatenate([np.full(START, 1e9), numbers]), len(rows) // GROUP


def number_of(place):
    """Return the number of the plane at a place."""
    group, lane = divmod(place - START, PLANE_STRIDE)
    assert 0 <= lane < GROUP
    return GROUP * group + lane


@pytest.mark.parametrize("count", [1, 2, 7, 8, 9, 20, 500])
def test_they_are_the_highest_and_the_next(count):
    """Random planes about random points; of one plane there is no next."""
    rng = np.random.default_rng(count)
    for _ in range(50):
        normals, offsets, p = (
            rng.normal(size=(count, 3)),
            rng.normal(size=count),
            rng.normal(size=3),
        )
        heights = (normals[:, 0] * p[0] + normals[:, 1] * p[1] + normals[:, 2] * p[2]) - offsets
        blocks, groups = groups_of(normals, offsets)
        place, height, second = highest(blocks, groups, tuple(p))
        assert number_of(place) == np.argmax(heights)
        assert height == heights.max()
        assert second == (np.sort(heights)[-2] if count > 1 else -np.inf)


@pytest.mark.parametrize("count", [6, 12, 30])
def test_of_equal_ones_it_is_the_first(count):
    """Faces of a cube that come again and again: the next is as high."""
    rng = np.random.default_rng(count)
    for _ in range(50):
        normals = np.tile(np.concatenate([np.eye(3), -np.eye(3)]), (count // 6, 1))
        p = rng.choice([-2.0, -1.0, 1.0, 2.0], size=3)
        heights = np.sort(normals @ p - 1.0)
        blocks, groups = groups_of(normals, np.ones(count))
        place, height, second = highest(blocks, groups, tuple(p))
        assert number_of(place) == np.argmax(normals @ p)
        assert (height, second) == (heights[-1], heights[-2])

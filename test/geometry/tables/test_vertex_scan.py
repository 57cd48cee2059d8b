"""The furthest of many points is that of numpy, also among points that lie as far."""

import numba
import numpy as np
import pytest

from scene_graph_ros.geometry.compiled.lanes import load_lanes
from scene_graph_ros.geometry.tables.vertex_scan import (
    furthest_of_few_groups,
    furthest_of_groups,
    GROUP,
    lane_of_largest,
)

START = 3
"""Where the groups begin: not at the start of a line of the cache."""


@numba.njit
def furthest(blocks, groups, d):
    """Call both, which only kernels can, and return -1 where they differ."""
    place = furthest_of_groups(blocks, START, groups, d, 4 * GROUP)
    same = furthest_of_few_groups(blocks, START, groups, d, 4 * GROUP) == place
    return place if same else -1


@numba.njit
def largest(numbers):
    """Return which of eight numbers is the largest."""
    return lane_of_largest(load_lanes(numbers, 0))


def scan(points, d):
    """Return the number of the point furthest along d."""
    groups = len(points) // GROUP
    rows = np.column_stack([points, np.full(len(points), np.nan)])
    numbers = rows.reshape(groups, GROUP, 4).swapaxes(1, 2).ravel()
    place = furthest(np.concatenate([np.full(START, 1e9), numbers]), groups, tuple(d)) - START
    group, lane = divmod(place, 4 * GROUP)
    assert 0 <= lane < GROUP
    return GROUP * group + lane


@pytest.mark.parametrize("groups", [1, 2, 3, 63])
def test_it_is_the_furthest(groups):
    """Random points along random directions."""
    rng = np.random.default_rng(groups)
    for _ in range(50):
        points, d = rng.normal(size=(GROUP * groups, 3)), rng.normal(size=3)
        assert scan(points, d) == np.argmax(points @ d)


@pytest.mark.parametrize("groups", [1, 4])
def test_of_equal_ones_it_is_the_first(groups):
    """Corners of a cube that come again and again, along its axes."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        points = rng.choice([-1.0, 1.0], size=(GROUP * groups, 3))
        d = rng.permutation(np.eye(3))[0] * rng.choice([-1.0, 1.0])
        assert scan(points, d) == np.argmax(points @ d)


def test_huge_and_tiny_numbers():
    """Whatever the scale, the heights are those of plain sums of products."""
    points = np.random.default_rng(5).normal(size=(GROUP, 3))
    for size in (1e-150, 1e150):
        assert scan(size * points, np.array([0.3, 0.4, 0.5])) == np.argmax(
            points @ [0.3, 0.4, 0.5]
        )


def test_the_lane_of_the_largest_number_is_the_first_of_several():
    """Also of infinite ones."""
    rng = np.random.default_rng(7)
    for _ in range(100):
        numbers = rng.choice([-np.inf, -1.0, 0.0, 0.5, np.inf], size=GROUP)
        assert largest(numbers) == np.argmax(numbers)

"""Four triangles at a time: none is left out that crosses, or lies on, another one."""

import itertools

from constructed_solids import rotation
import numpy as np
import pytest

from scene_graph_ros.geometry.meshes.solids.crossings import first_crossing


def triangles_of_whole_numbers(rng):
    """Return corners and some triangles over them, some without area, none with a corner twice."""
    points = rng.integers(-3, 4, (int(rng.integers(4, 16)), 3)).astype(float)
    rows = [rng.permutation(len(points))[:3] for _ in range(int(rng.integers(2, 9)))]
    return points, np.array(rows)


@pytest.mark.parametrize("away", [0.0, 1e6])
def test_triangles_cross_as_they_do_in_pairs(away):
    """Turned, scaled, and far from the origin, where heights above planes are rounded more."""
    found = np.zeros(2, dtype=int)
    for seed in range(150):
        rng = np.random.default_rng((9, seed))
        points, triangles = triangles_of_whole_numbers(rng)
        scale = 10.0 ** rng.uniform(-4, 4)
        points = scale * (points @ rotation(rng).T + away * rng.normal(size=3))
        # By pairs the size is another one, and with it what is too little to count.
        in_pairs = [
            first_crossing(points, triangles[[i, j]])
            for i, j in itertools.combinations(range(len(triangles)), 2)
        ]
        crosses = any(at is not None for at in in_pairs)
        assert (first_crossing(points, triangles) is not None) == crosses, seed
        found[int(crosses)] += 1
    assert found.min() > 10

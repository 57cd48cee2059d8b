"""What is told of bodies among clouds without measuring: the rounded boxes inside of hulls."""

import numpy as np

from benchmarks.clouds import checker_of, points_on_faces
from scene_graph_ros.planning.pairs.cloud_pairs import split_of


def test_rounded_boxes_are_in_their_bodies():
    """In the hulls of a Panda and the boxes of its fingers, and of some size in each."""
    plan = checker_of(points_on_faces(100)).plan
    table, bodies = split_of(plan).table, plan.bodies
    signs = np.stack(np.meshgrid(*3 * [[-1.0, 1.0]]), axis=-1).reshape(-1, 3)
    assert len(table.inner) == len(plan.carried) == 17
    for a, (*half, radius) in enumerate(table.inner):
        planes = table.planes[table.plane_starts[a] : table.plane_starts[a + 1]]
        corners = bodies.centers[a] + signs * half
        farthest = (planes[:, :3] @ corners.T).max(axis=1) + radius
        assert (farthest <= planes[:, 3] + 1e-15).all()
        # It touches a face, and in one direction it is not much smaller than the body's box.
        assert (farthest >= planes[:, 3] - 1e-9).any()
        assert ((half + radius) >= 0.5 * 0.5 * (bodies.upper[a] - bodies.lower[a])).any()

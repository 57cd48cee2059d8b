"""Boxes with common edges and faces, in one mesh with common vertices, are the union of them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from winding_truth import solid_angles

from scene_graph_ros.geometry.meshes.solids.resolve import resolved
from scene_graph_ros.geometry.meshes.solids.solid import solid_of

QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
"""Of the corners of a box in the order of x, y, z; outwards."""

# Corners are whole numbers, so that they are the same vertices wherever boxes meet.
APART = {
    "an edge": [((0, 0, 0), (1, 1, 1)), ((1, 1, 0), (3, 2, 1))],
    "a face": [((0, 0, 0), (1, 3, 2)), ((0, 0, 2), (1, 3, 3))],
    "a face, in a row": [((2, 2, 1), (3, 3, 2)), ((0, 2, 1), (2, 3, 2)), ((2, 2, 0), (3, 3, 1))],
    "three around an edge": [
        ((0, 0, 0), (1, 1, 2)),
        ((1, 1, 0), (2, 3, 2)),
        ((0, 1, 0), (1, 2, 2)),
    ],
    "a face and an edge": [
        ((1, 2, 2), (2, 3, 3)),
        ((2, 1, 0), (3, 3, 1)),
        ((2, 2, 2), (3, 3, 3)),
    ],
    "a ring of edges": [
        ((0, 0, 0), (1, 1, 1)),
        ((1, 1, 0), (2, 2, 1)),
        ((0, 1, 1), (1, 2, 2)),
        ((1, 0, 1), (2, 1, 2)),
    ],
}
NESTED = {
    "a face": [((2, 1, 0), (3, 2, 3)), ((0, 1, 0), (3, 2, 3))],
    "a face, of three": [((2, 1, 0), (3, 2, 3)), ((0, 1, 0), (3, 2, 3)), ((1, 1, 0), (3, 2, 3))],
    "two edges": [((0, 0, 0), (1, 1, 3)), ((0, 0, 0), (2, 2, 3))],
    "a face of each other": [((0, 0, 0), (2, 2, 2)), ((1, 0, 0), (3, 2, 2))],
    "a face, and one beside": [
        ((2, 1, 0), (3, 2, 3)),
        ((0, 1, 0), (3, 2, 3)),
        ((3, 1, 0), (4, 2, 3)),
    ],
}
PLACES = {
    "as they are": (np.eye(3), 1.0, (0.0, 0.0, 0.0)),
    "turned": (Rotation.from_rotvec((0.3, -0.5, 0.7)).as_matrix(), 1.0 / 3.0, (0.0, 0.0, 0.0)),
    "small": (Rotation.from_rotvec((-1.1, 0.2, 0.4)).as_matrix(), 1e-6, (0.3, -0.2, 0.5)),
    "large": (Rotation.from_rotvec((0.9, 0.8, -0.1)).as_matrix(), 1e6, (-0.7, 0.1, 0.2)),
    "far": (Rotation.from_rotvec((0.1, 2.0, -0.6)).as_matrix(), 1.0, (40.0, -70.0, 30.0)),
}


def in_one_mesh(boxes, seed):
    """Return vertices (v, 3) and triangles (m, 3) in any order, each side cut in either way."""
    rng = np.random.default_rng(seed)
    points, faces = [], []
    for k, (lower, upper) in enumerate(boxes):
        axes = list(zip(lower, upper, strict=True))
        points += [(x, y, z) for x in axes[0] for y in axes[1] for z in axes[2]]
        for quad in QUADS:
            a, b, c, d = np.roll(quad, rng.integers(2)) + 8 * k
            faces += [(a, b, c), (a, c, d)]
    vertices, rows = np.unique(np.array(points, dtype=float), axis=0, return_inverse=True)
    return vertices, rows.reshape(-1)[rng.permutation(faces)]


def union_of(boxes, x):
    """Tell of (n, 3) points whether they are in any box."""
    return np.any([((x > lower) & (x < upper)).all(axis=1) for lower, upper in boxes], axis=0)


def placed(place, x):
    """Return points (n, 3) elsewhere: turned, of another size."""
    R, scale, origin = PLACES[place]
    return ((x + np.array(origin)) @ R.T) * scale


def check(boxes, place, vertices, faces):
    """Hold a mesh of boxes to the union of these."""
    solid = solid_of(placed(place, vertices), faces, 1e-6)
    assert solid.report.is_closed, str(solid.report)
    asked = np.random.default_rng(1).uniform(
        vertices.min(0) - 0.2, vertices.max(0) + 0.2, (300, 3)
    )
    numbers = solid_angles(placed(place, asked), solid.vertices, solid.triangles)
    np.testing.assert_allclose(numbers, union_of(boxes, asked), atol=1e-6)
    return solid


@pytest.mark.parametrize("place", list(PLACES))
@pytest.mark.parametrize("name", list(APART))
def test_boxes_that_touch_are_solid_whatever_way_their_triangles_run(name, place):
    """Each triangle may be turned: no way around an edge is to be trusted."""
    boxes = APART[name]
    for seed in range(3):
        vertices, faces = in_one_mesh(boxes, seed)
        rng = np.random.default_rng(seed + 100)
        is_turned = rng.random(len(faces)) < (0.0, 0.5, 1.0)[seed % 3]
        check(boxes, place, vertices, np.where(is_turned[:, None], faces[:, ::-1], faces))


@pytest.mark.parametrize("place", list(PLACES))
@pytest.mark.parametrize("name", list(NESTED))
def test_boxes_nested_along_common_edges_leave_no_walls_inside(name, place):
    """Their triangles run outwards, or all of them inwards; common faces are cut in either way."""
    boxes = NESTED[name]
    for seed in range(3):
        vertices, faces = in_one_mesh(boxes, seed)
        solid = check(boxes, place, vertices, faces[:, ::-1] if seed % 2 else faces)
        assert len(boxes) > 2 or solid.report.parts == 2


@pytest.mark.parametrize("name", list(NESTED))
def test_surfaces_with_triangles_on_the_same_vertices_are_cut_apart(name):
    """No random step separates such triangles; those that run opposite ways bound nothing."""
    boxes = NESTED[name]
    for seed in range(3):
        vertices, faces = in_one_mesh(boxes, seed)
        points = placed("turned", vertices)
        found = resolved(points, faces)
        assert found is not None
        asked = np.random.default_rng(2).uniform((-0.2, -0.2, -0.2), (4.2, 2.2, 3.2), (300, 3))
        numbers = solid_angles(placed("turned", asked), *found[:2])
        np.testing.assert_allclose(numbers, union_of(boxes, asked), atol=1e-6)
    nothing = resolved(points, np.concatenate([faces, faces[:, ::-1]]))
    assert len(nothing[1]) == 0

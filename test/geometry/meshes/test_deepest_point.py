"""The centre of the largest ball inside a convex polytope."""

import numpy as np
import pytest
from scipy.optimize import linprog

from scene_graph_ros.geometry.meshes.deepest_point import deepest_point
from scene_graph_ros.geometry.meshes.hull import convex_hull
from scene_graph_ros.geometry.tolerances import DEEPEST_POINT


def _deepest(hull):
    return deepest_point(hull.normals, hull.offsets, hull.vertices.mean(axis=0), DEEPEST_POINT)


def _box(half):
    return np.array(np.meshgrid(*([-h, h] for h in half))).reshape(3, -1).T


@pytest.mark.parametrize("seed", range(12))
def test_depth_is_that_of_the_linear_programme(seed):
    """An independent solver finds nothing deeper, to the stated tolerance; the depth is exact."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(4 + 7 * seed, 3)) * rng.uniform(0.1, 3.0, 3) + rng.normal(size=3)
    hull = convex_hull(points)
    centre, depth = _deepest(hull)
    assert depth == (hull.offsets - hull.normals @ centre).min()
    rows = np.column_stack([hull.normals, np.ones(len(hull.normals))])
    best = linprog([0, 0, 0, -1], A_ub=rows, b_ub=hull.offsets, bounds=(None, None)).x[3]
    assert (1.0 - DEEPEST_POINT) * best <= depth <= (1.0 + 1e-9) * best


@pytest.mark.parametrize("half", [(1, 1, 1), (1, 2, 30), (1e-3, 1e-3, 1), (1, 1, 1e-3)])
@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_centre_is_in_the_middle_of_all_deepest_points(half, scale):
    """In a box with a whole rectangle of deepest points it is the box's centre."""
    half = scale * np.array(half)
    offset = np.array([3.0, -2.0, 1.0]) * scale
    centre, depth = _deepest(convex_hull(_box(half) + offset))
    assert depth == pytest.approx(half.min(), rel=1e-10)
    assert np.abs(centre - offset).max() <= 1e-6 * half.max()


def test_centroid_of_a_flat_pyramid_is_not_its_deepest_point():
    """A pyramid of base 2 x 2 and height h: the ball touches base and sides, not the centroid."""
    height = 4.0
    points = [[-1, -1, 0], [1, -1, 0], [-1, 1, 0], [1, 1, 0], [0, 0, height]]
    centre, depth = _deepest(convex_hull(np.array(points, dtype=float)))
    # In the plane y = 0 it is the incircle of a triangle of base 2 and height h.
    inradius = height / (1.0 + np.hypot(1.0, height))
    assert depth == pytest.approx(inradius, rel=DEEPEST_POINT)
    assert depth <= inradius * (1.0 + 1e-12)
    assert centre == pytest.approx([0.0, 0.0, inradius], abs=2e-3)

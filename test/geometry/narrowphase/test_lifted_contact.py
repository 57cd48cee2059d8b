"""Contacts by lifting one core off the other: what is proven in short, and what is left open."""

from convex_bodies import plain_core, rounded_hull
import numpy as np
from overlapping_pairs import is_found
import pytest

from scene_graph_ros.geometry import Box, Cylinder, Ellipsoid
from scene_graph_ros.geometry.narrowphase.convex_distance import new_workspace
from scene_graph_ros.geometry.narrowphase.cores.kinds import BOX, IDENTITY, ORIGIN, TRIANGLE
from scene_graph_ros.geometry.narrowphase.lifted_contact import lifted_contact
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.pair import Pair
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

BALL = Ellipsoid(0.1, 0.12, 0.15)


def lifted(shape_A, shape_B, p, limit=np.inf):
    """Return the lifted contact of shapes with parallel axes, B at p."""
    table = build_shape_table([shape_A, shape_B], [False, False])
    cores = plain_core(table, 0), plain_core(table, 1)
    pair = Pair(*cores, IDENTITY, tuple(float(x) for x in p), table.hulls.blocks)
    return lifted_contact(pair, float(limit), new_workspace())


@pytest.mark.parametrize("distance", [0.3, 0.01, 1e-6, -1e-6, -0.01, -0.05])
@pytest.mark.parametrize("other", [Box(0.5, 0.6, 0.2), Cylinder(0.4, 0.2)], ids=repr)
def test_ellipsoid_over_a_face(other, distance):
    """The lowest point of the ellipsoid is ``distance`` above the middle of a flat side."""
    decided_by, found, a, b, n, error = lifted(other, BALL, (0.01, -0.02, 0.1 + 0.15 + distance))
    assert is_found(decided_by)
    assert found == pytest.approx(distance, abs=1e-15)
    assert np.allclose(a, (0.01, -0.02, 0.1), atol=1e-15)
    assert np.allclose(b, (0.01, -0.02, 0.1 + distance), atol=1e-15)
    assert np.allclose(n, (0.0, 0.0, -1.0), atol=1e-15)
    assert error <= 1e-14


def test_beyond_the_limit_one_direction_is_enough():
    """Nothing but a direction is told about cores further apart than was asked for."""
    decided_by, found, _, _, n, _ = lifted(BALL, Cylinder(0.1, 0.2), (0.0, 0.0, 1.0), limit=0.1)
    assert decided_by == Mechanism.SEPARATED
    assert found == pytest.approx(1.0 - 0.15 - 0.1, abs=1e-15)
    assert np.allclose(n, (0.0, 0.0, -1.0), atol=1e-15)


def test_least_depth_that_no_ball_proves_is_not_found():
    """Deep inside of each other, a depth may be stationary, but another direction may be best.

    Of two equal upright cylinders 1 cm aside, the way out is up or down (0.2 m) or to the side
    (0.39 m); no ball of 0.2 m is in either of them.
    """
    assert lifted(Cylinder(0.2, 0.2), Cylinder(0.2, 0.2), (0.01, 0.0, 0.0))[0] == Mechanism.OPEN


def test_many_features_are_not_guessed():
    """Large hulls are left to GJK and EPA."""
    assert lifted(rounded_hull(0.3, 300), BALL, (0.2, 0.0, 0.0))[0] == Mechanism.OPEN


def _least_depth(corners, half):
    """Return how deep a triangle and a box overlap: by all axes that may separate them."""
    edges = np.roll(corners, -1, axis=0) - corners
    axes = [*np.eye(3), np.cross(edges[0], edges[1])]
    axes += [np.cross(edge, axis) for edge in edges for axis in np.eye(3)]
    least = np.inf
    for axis in axes:
        length = np.linalg.norm(axis)
        if length > 1e-9:
            along = corners @ axis / length
            reach = np.abs(axis / length) @ half
            least = min(least, reach - along.min(), reach + along.max())
    return least


def test_what_is_proven_of_a_triangle_in_a_box_is_least():
    """Depths of random triangles that overlap a box: each found one is that of all axes."""
    half = np.array([0.1, 0.15, 0.07])
    box = (BOX, -1, 0.0, (*half, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    rng = np.random.default_rng(11)
    found = 0
    for _ in range(200):
        corners = rng.uniform(-0.2, 0.2, (3, 3))
        triangle = (TRIANGLE, -1, 0.0, tuple(corners.ravel()))
        pair = Pair(triangle, box, IDENTITY, ORIGIN, np.zeros(8))
        decided_by, distance, *_ = lifted_contact(pair, np.inf, new_workspace())
        if is_found(decided_by) and distance < 0.0:
            found += 1
            assert -distance == pytest.approx(_least_depth(corners, half), abs=1e-14)
    assert found > 20

"""Nearest points of corners, lines and rims that are apart, and of rims seen from above."""

import numpy as np
import pytest

from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY, ORIGIN, POINT
from scene_graph_ros.geometry.narrowphase.features import LINE, RIM, VERTEX
from scene_graph_ros.geometry.narrowphase.multistart.nearest_places import nearest_places
from scene_graph_ros.geometry.narrowphase.pair import Features

CORE = (POINT, -1, 0.0, (0.0,) * 9)
UP = (0.0, 0.0, 1.0)


def _found(feature_A, feature_B, a, b, n=UP):
    found = nearest_places(Features(feature_A, feature_B, CORE, CORE, IDENTITY), n, a, b, 1.0)
    return tuple(np.array(x) for x in found)


@pytest.mark.parametrize("beyond", [1e-3, 1e-8, 1e-12, 0.0])
def test_corner_next_to_above_a_rim(beyond):
    """The nearest point of a circle is the corner's projection to its plane, scaled to it."""
    corner = (0.6 * (1.0 + beyond), 0.8 * (1.0 + beyond), 0.5)
    rim = RIM, ORIGIN, UP, 1.0, 0.0, 0.0
    start = (0.8, 0.6, 0.0)
    n, a, b = _found((VERTEX, corner, ORIGIN, 0.0, 0.0, 0.0), rim, corner, start)
    assert np.array_equal(a, corner)
    assert np.allclose(b, [0.6, 0.8, 0.0], rtol=0.0, atol=2e-16)
    offset = np.array([0.6 * beyond, 0.8 * beyond, 0.5])
    assert np.allclose(n, offset / np.linalg.norm(offset), rtol=0.0, atol=4e-16)


def test_sides_of_cylinders():
    """Lines with radii have their nearest points on their sides, opposite each other."""
    first = LINE, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.3, -1.0, 1.0
    second = LINE, (0.2, 0.0, 0.0), (0.0, 1.0, 0.0), 0.1, -1.0, 1.0
    n, a, b = _found(first, second, (0.1, 0.0, 0.7), (0.2, -0.3, 0.1))
    assert np.allclose(n, UP, rtol=0.0, atol=1e-16)
    assert np.allclose(a, [0.2, 0.0, 0.7], rtol=0.0, atol=2e-16)
    assert np.allclose(b, [0.2, 0.0, 0.1], rtol=0.0, atol=2e-16)


@pytest.mark.parametrize("tilt", [0.1, 1e-4, 3e-9])
def test_rims_of_discs_at_an_angle(tilt):
    """Both points are on their circles, and the way between them is at a right angle to both."""
    axis = np.array([0.0, np.sin(tilt), np.cos(tilt)])
    center = np.array([1.0, 0.1, 0.4])
    upper = RIM, tuple(center), tuple(axis), 1.0, 0.0, 0.0
    start = (0.5, np.sqrt(0.75), 0.0)
    n, a, b = _found(upper, (RIM, ORIGIN, UP, 1.0, 0.0, 0.0), start, start)
    assert abs(np.linalg.norm(a - center) - 1.0) < 4e-16
    assert abs(axis @ (a - center)) < 4e-16
    assert abs(np.linalg.norm(b) - 1.0) < 4e-16
    assert b[2] == 0.0
    assert abs(n @ np.cross(UP, b)) < 4e-16
    assert abs(n @ np.cross(axis, a - center)) < 4e-16
    assert np.allclose(a - b, ((a - b) @ n) * n, rtol=0.0, atol=1e-15)

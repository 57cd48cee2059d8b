"""Witness points slid along their features until they face each other."""

import numpy as np
import pytest

from scene_graph_ros.geometry.narrowphase.contact.slide import slide
from scene_graph_ros.geometry.narrowphase.cores.kinds import ELLIPSOID, IDENTITY, ORIGIN, POINT
from scene_graph_ros.geometry.narrowphase.features import LINE, RIM, SMOOTH, VERTEX
from scene_graph_ros.geometry.narrowphase.pair import Features

ENOUGH = 1e-16
NO_CORE = (POINT, -1, 0.0, (0.0,) * 9)


def _slid(feature_A, feature_B, n, a, b, core_B=NO_CORE):
    a, b = slide(Features(feature_A, feature_B, NO_CORE, core_B, IDENTITY), n, a, b, ENOUGH)
    return np.array(a), np.array(b)


def _rim(center, radius):
    return RIM, center, (0.0, 0.0, 1.0), radius, 0.0, 0.0


@pytest.mark.parametrize("off", [1e-3, 1e-6, 1e-9])
def test_rim_below_a_corner(off):
    """A point of a rim that was turned by a small angle comes back below the corner."""
    corner = (0.6, 0.8, 0.5)
    turned = (0.6 * np.cos(off) - 0.8 * np.sin(off), 0.8 * np.cos(off) + 0.6 * np.sin(off), 0.0)
    feature = VERTEX, corner, ORIGIN, 0.0, 0.0, 0.0
    a, b = _slid(feature, _rim(ORIGIN, 1.0), (0.0, 0.0, 1.0), corner, turned)
    assert np.array_equal(a, corner)
    assert np.allclose(b, [0.6, 0.8, 0.0], rtol=0.0, atol=4e-16)


def test_lines_that_cross():
    """Points of two lines at a right angle, each off its place, meet on the common normal."""
    along_x = LINE, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), 0.0, -1.0, 1.0
    along_y = LINE, (0.2, 0.0, 0.0), (0.0, 1.0, 0.0), 0.0, -1.0, 1.0
    n = (0.0, 0.0, 1.0)
    a, b = _slid(along_x, along_y, n, (0.1, 0.0, 1.0), (0.2, -0.3, 0.0))
    assert np.allclose(a, [0.2, 0.0, 1.0], rtol=0.0, atol=1e-15)
    assert np.allclose(b, [0.2, 0.0, 0.0], rtol=0.0, atol=1e-15)


def test_rims_that_cross():
    """Two rims one above the other meet where the circles of both cross, seen along the normal."""
    n = (0.0, 0.0, 1.0)
    off = 1e-5
    above = (0.5 + 0.0, np.sqrt(0.75) + off, 0.3)
    a, b = _slid(
        _rim((0.0, 0.0, 0.3), 1.0), _rim((1.0, 0.0, 0.0), 1.0), n, above, (0.5, np.sqrt(0.75), 0.0)
    )
    assert np.allclose(a, [0.5, np.sqrt(0.75), 0.3], rtol=0.0, atol=1e-15)
    assert np.allclose(b, [0.5, np.sqrt(0.75), 0.0], rtol=0.0, atol=1e-15)


def test_point_of_an_ellipsoid_below_a_corner():
    """A point of a smooth surface moves below the corner and stays on the surface."""
    axes = np.array([1.0, 2.0, 0.5])
    core = (ELLIPSOID, -1, 0.0, (*axes, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    corner = (1e-7, -2e-7, 0.8)
    _, b = _slid(
        (VERTEX, corner, ORIGIN, 0.0, 0.0, 0.0),
        (SMOOTH, ORIGIN, ORIGIN, 0.0, 0.0, 0.0),
        (0.0, 0.0, 1.0),
        corner,
        (0.0, 0.0, 0.5),
        core,
    )
    assert np.allclose(b[:2], corner[:2], rtol=0.0, atol=1e-15)
    assert abs(np.linalg.norm(b / axes) - 1.0) < 4e-16

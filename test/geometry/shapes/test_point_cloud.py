"""Clouds of points as shapes: what they take, and what they refuse."""

import pickle

import numpy as np
import pytest

from scene_graph_ros.geometry import PointCloud
from scene_graph_ros.geometry.errors import InvalidShapeError

POINTS = np.array([[1 / 3, 0.0, -2.0], [0.0, 1e-9, 1e9], [0.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    "points",
    [
        POINTS,
        POINTS.tolist(),
        POINTS.astype(">f8"),
        np.asfortranarray(POINTS),
        np.repeat(POINTS, 2, axis=0)[::2],
        POINTS.astype(object),
    ],
)
def test_numbers_of_any_form_are_points(points):
    """Layout, byte order and type do not matter; they are copied."""
    cloud = PointCloud(points, 0.25)
    assert (cloud.points == POINTS).all()
    assert cloud.radius == 0.25
    assert not cloud.has_radii
    with pytest.raises(ValueError, match="read-only"):
        cloud.points[0, 0] = 1.0


def test_a_cloud_may_have_no_points():
    """Also as an empty list, and with a radius for each of none."""
    assert PointCloud([], 0.1).points.shape == (0, 3)
    assert PointCloud(np.zeros((0, 3)), np.zeros(0)).has_radii


def test_each_ball_may_have_its_own_radius():
    """As many as there are points."""
    cloud = PointCloud(POINTS, [0.1, 0.0, 3])
    assert cloud.radius.tolist() == [0.1, 0.0, 3.0]
    assert repr(cloud) == "PointCloud(3 points, 3 radii)"
    assert repr(PointCloud(POINTS[:1], 0.5)) == "PointCloud(1 point, radius=0.5)"


@pytest.mark.parametrize("radius", [0.1, [0.1, 0.2, 0.3]])
def test_equal_numbers_are_equal_clouds(radius):
    """So is a copy that was pickled."""
    cloud = PointCloud(POINTS, radius)
    assert cloud == pickle.loads(pickle.dumps(cloud)) == PointCloud(POINTS.copy(), radius)
    assert hash(cloud) == hash(PointCloud(POINTS, radius))
    assert cloud != PointCloud(POINTS + 1.0, radius)
    assert cloud != POINTS.tolist()


@pytest.mark.parametrize(
    ("points", "radius", "told"),
    [
        ([[0, 0, 0], [0, np.nan, 0]], 0.1, "point 1 must be finite"),
        ([[0, 0, np.inf]], 0.1, "point 0 must be finite"),
        ([[0, 0, 0], [0, 0, 2e12]], 0.1, "point 1 .* within 1e.12 m"),
        (np.zeros((2, 4)), 0.1, r"\(n, 3\), not \(2, 4\)"),
        (np.zeros(3), 0.1, r"\(n, 3\), not \(3,\)"),
        ("points", 0.1, "points must be numbers"),
        (np.zeros((1, 3), complex), 0.1, "points must be numbers"),
        (np.ma.masked_invalid([[0.0, np.nan, 0.0]]), 0.1, "masked"),
        ([[0, 0], [0]], 0.1, "points must be numbers"),
        (POINTS, -0.1, "radius must be finite, from 0"),
        (POINTS, np.nan, "radius must be finite"),
        (POINTS, np.inf, "radius must be finite"),
        (POINTS, "wide", "radius must be numbers"),
        (POINTS, [0.1, 0.2], r"\(3,\), one for each point, not \(2,\)"),
        (POINTS, [[0.1, 0.2, 0.3]], r"not \(1, 3\)"),
        (POINTS, [0.1, 0.2, -0.3], "of point 2 must be finite, from 0"),
    ],
)
def test_what_is_no_cloud_is_refused_by_name(points, radius, told):
    """The index says which point."""
    with pytest.raises(InvalidShapeError, match=told):
        PointCloud(points, radius)

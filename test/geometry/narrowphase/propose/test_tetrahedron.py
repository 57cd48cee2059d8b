"""How thick the tetrahedron is that EPA starts from."""

import numpy as np
import pytest

from scene_graph_ros.geometry.narrowphase.propose.tetrahedron import thickness


def rows(corners):
    """Return a workspace with these corners of the Minkowski difference, and no other points."""
    S = np.zeros((4, 9))
    S[:, :3] = corners
    return S


def test_thickness_is_the_least_height_over_the_size():
    """An edge of 2, a height of 0.5 over it, one of 3 over both: the least is the middle one."""
    found, size = thickness(rows([[0, 0, 0], [2, 0, 0], [1, 0.5, 0], [7, -4, 3]]))
    assert size == 7.0
    assert found == pytest.approx(0.5 / 7.0, rel=1e-15)
    found, _ = thickness(rows([[0, 0, 0], [2, 0, 0], [1, 0.5, 0], [7, -4, -0.2]]))
    assert found == pytest.approx(0.2 / 7.0, rel=1e-15)


@pytest.mark.parametrize("far", [0.0, 1.0], ids=["point", "line"])
def test_flat_tetrahedra_have_none(far):
    """Corners on a line, or all in one place, have no thickness."""
    found, _ = thickness(rows([[0, 0, 1], [0, 0, 1], [0, far, 1], [0, 2 * far, 1]]))
    assert found == 0.0


def test_size_is_that_of_the_bodies_too():
    """Bodies far from their frame's origin are as large as their coordinates."""
    S = rows([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    S[:, 3:9] = 50.0
    assert thickness(S) == pytest.approx((1.0 / 50.0, 50.0))

"""Products and small systems in one order of sums, against the library of linear algebra."""

import numpy as np
import pytest

from scene_graph_ros.geometry.spatial.sums import (
    determinant,
    least_squares,
    length,
    moved,
    product,
)

_SHAPES = [((3,), (3,)), ((5, 3), (3,)), ((3,), (3, 4)), ((5, 3), (3, 4)), ((7, 4, 4), (4, 4))]


@pytest.mark.parametrize("shapes", _SHAPES)
def test_a_product_is_that_of_the_library(shapes):
    """Of vectors, matrices and stacks, to rounding."""
    generator = np.random.default_rng(0)
    A, B = (generator.uniform(-1.0, 1.0, shape) for shape in shapes)
    np.testing.assert_allclose(product(A, B), A @ B, rtol=0.0, atol=1e-15)


def test_lengths_determinants_and_moved_points():
    """Of a box of 2 x 3 x 6, whose diagonal is 7; a quarter turn has the determinant 1."""
    assert length(np.array([2.0, 3.0, -6.0])) == 7.0
    X = np.array([[0.0, -1.0, 0.0, 1.0], [1.0, 0.0, 0.0, 2.0], [0.0, 0.0, 1.0, 3.0], [0, 0, 0, 1]])
    assert determinant(X[:3, :3]) == 1.0
    assert determinant(np.diag([2.0, 3.0, -4.0])) == -24.0
    np.testing.assert_array_equal(moved(np.array([[1.0, 0.0, 5.0]]), X), [[1.0, 3.0, 8.0]])


@pytest.mark.parametrize("size", [(1, 3), (2, 3), (3, 3), (9, 3), (4, 6), (12, 6)])
@pytest.mark.parametrize("is_flat", [False, True])
def test_least_squares_are_the_shortest(size, is_flat):
    """Also where columns are equal, so that many are as good."""
    generator = np.random.default_rng(1)
    for _ in range(20):
        rows, sides = generator.uniform(-1.0, 1.0, size), generator.uniform(-1.0, 1.0, size[0])
        if is_flat:
            rows[:, -1] = rows[:, 0]
        truth = np.linalg.lstsq(rows, sides, rcond=1e-3)[0]
        error = np.abs(least_squares(rows, sides, 1e-3) - truth).max()
        assert error <= 1e-11 * (1.0 + np.abs(truth).max())


def test_a_plane_is_reached_along_its_normal():
    """Normals that are equal but for rounding count as one: the step is as long as asked for."""
    normal = np.array([1.0, 2.0, 2.0]) / 3.0
    rows = np.array([normal, normal * (1.0 + 1e-9), normal])
    np.testing.assert_allclose(
        least_squares(rows, np.full(3, 0.3), 0.1), 0.3 * normal, rtol=0.0, atol=1e-9
    )

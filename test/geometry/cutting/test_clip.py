"""Cutting tetrahedra and polygons: orientation, completeness, and the rule for ties."""

import itertools

from contact_bodies import slab
import numpy as np
import pytest

from scene_graph_ros.geometry.cutting.clip import (
    clip_by_tetrahedron,
    drop_short_edges,
    measure,
    planes_that_cut,
    side_mask,
    slice_tetrahedron,
)

SLACK = 1e-13


def _planes(corners):
    """Planes of a tetrahedron's faces as the kernels take them."""
    result = np.empty((4, 4))
    for k in range(4):
        a, b, c = np.delete(corners, k, axis=0)
        n = np.cross(b - a, c - a)
        n /= np.linalg.norm(n) * np.sign(n @ (corners[k] - a))
        result[k] = *n, -n @ a
    return np.ascontiguousarray(result.T).reshape(-1)


def _clipped_area(polygon, normal, corners):
    """Area of the part of a polygon in a tetrahedron."""
    buffer = np.zeros((2, 8, 3))
    buffer[0, : len(polygon)] = polygon
    planes = _planes(corners)
    n = tuple(float(x) for x in normal)
    cutting = planes_that_cut(buffer[0], len(polygon), n, planes, SLACK)
    if cutting < 0:
        return 0.0
    side, count = clip_by_tetrahedron(buffer, len(polygon), n, planes, cutting, SLACK, np.empty(8))
    return measure(buffer[side], count, n)[0] if count >= 3 else 0.0


def _area(triangle):
    return 0.5 * np.linalg.norm(np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0]))


def _normal(triangle):
    n = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    return n / np.linalg.norm(n)


def _cube():
    """The six tetrahedra of the cube [-1, 1]^3."""
    body = slab(np.ones(3), 1.0)
    return body.vertices[body.elements]


@pytest.mark.parametrize("signs", list(itertools.product((-1, 1), repeat=4)))
def test_slice_is_counter_clockwise_about_the_gradient(signs):
    """For each set of negative corners the cut lies on f = 0 and runs about grad f."""
    corners = np.array([[0.1, 0.2, 0.0], [1.3, 0.0, 0.1], [0.2, 1.1, -0.1], [0.3, 0.1, 0.9]])
    f = np.array(signs) * np.array([0.7, 1.1, 0.4, 0.9])
    gradient = np.linalg.solve(np.hstack([corners, np.ones((4, 1))]), f)
    polygon = np.zeros((8, 3))
    mask = side_mask(tuple(f))
    assert mask == sum(2**i for i in range(4) if signs[i] < 0)
    count = slice_tetrahedron(corners.T.reshape(-1).copy(), tuple(f), mask, polygon)
    negative = signs.count(-1)
    assert count == {0: 0, 1: 3, 2: 4, 3: 3, 4: 0}[negative]
    if count:
        assert polygon[:count] @ gradient[:3] + gradient[3] == pytest.approx(0.0, abs=1e-15)
        n = gradient[:3] / np.linalg.norm(gradient[:3])
        for a, b, c in itertools.combinations(polygon[:count], 3):
            assert np.cross(b - a, c - a) @ n > 0.0  # convex, and about n


def test_neighbours_cut_along_their_face_count_it_once():
    """Of the elements at a face with f = 0 only those on the negative side are cut."""
    # The level x = y contains a diagonal face of the cube, of area 2 * 2 sqrt(2).
    for sign in (1.0, -1.0):
        total = 0.0
        for corners in _cube():
            f = tuple(sign * (corners[:, 0] - corners[:, 1]))
            polygon = np.zeros((8, 3))
            count = slice_tetrahedron(corners.T.reshape(-1).copy(), f, side_mask(f), polygon)
            n = (sign * np.sqrt(0.5), -sign * np.sqrt(0.5), 0.0)
            if drop_short_edges(polygon, count, SLACK):
                total += measure(polygon, count, n)[0]
        assert total == pytest.approx(4.0 * np.sqrt(2.0), rel=1e-14)


def test_parts_of_a_triangle_in_elements_add_up():
    """The parts of triangles inside a cube, in its six tetrahedra, have the triangles' area."""
    rng = np.random.default_rng(3)
    for triangle in rng.uniform(-1.0, 1.0, (40, 3, 3)):
        parts = [_clipped_area(triangle, _normal(triangle), corners) for corners in _cube()]
        assert sum(parts) == pytest.approx(_area(triangle), rel=1e-12)


@pytest.mark.parametrize("flip", [False, True])
def test_triangle_in_a_shared_face_counts_once(flip):
    """A triangle in the diagonal x = y counts in the elements on its negative side only."""
    triangle = np.array([[-0.5, -0.5, -0.3], [0.4, 0.4, -0.2], [0.1, 0.1, 0.6]])
    if flip:
        triangle = triangle[::-1]
    n = _normal(triangle)
    total = 0.0
    for corners in _cube():
        part = _clipped_area(triangle, n, corners)
        if part > 0.0:
            assert (corners.mean(axis=0) - triangle[0]) @ n < 0.0
        total += part
    assert total == pytest.approx(_area(triangle), rel=1e-13)


def test_triangle_in_the_boundary_counts_from_inside():
    """A triangle in the top face counts if it looks outwards, else it touches from outside."""
    triangle = np.array([[-0.5, -0.5, 1.0], [0.6, -0.4, 1.0], [0.1, 0.7, 1.0]])
    outwards = sum(_clipped_area(triangle, (0.0, 0.0, 1.0), corners) for corners in _cube())
    reverse = triangle[::-1]
    inwards = sum(_clipped_area(reverse, (0.0, 0.0, -1.0), corners) for corners in _cube())
    assert outwards == pytest.approx(_area(triangle), rel=1e-13)
    assert inwards == 0.0


def test_rounding_decides_no_tie():
    """A triangle off the shared face by rounding counts once, with all of its area."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        along, z = rng.uniform(-0.9, 0.9, (2, 3))
        triangle = np.stack([along, along, z], axis=1)
        triangle += rng.uniform(-1e-15, 1e-15, (3, 3))
        n = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
        if np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0]) @ n < 0.0:
            triangle = triangle[::-1]
        total = sum(_clipped_area(triangle, n, corners) for corners in _cube())
        assert total == pytest.approx(_area(triangle), rel=1e-11)


def test_short_edges_go_and_slivers_are_none():
    """Corners nearer than the limit to their neighbours go, also the last beside the first."""
    polygon = np.zeros((8, 3))
    polygon[:5, :2] = [[0, 0], [1e-6, 0], [1, 0], [0, 1], [0, 1e-6]]
    assert drop_short_edges(polygon, 5, 1e-5) == 3
    assert polygon[:3, :2] == pytest.approx(np.array([[0, 0], [1, 0], [0, 1]]))
    polygon[:3, :2] = [[0, 0], [1, 0], [1, 1e-7]]
    assert drop_short_edges(polygon, 3, 1e-5) == 0


def test_measure_is_signed():
    """A square has its area and centroid; its order about the normal gives the sign."""
    square = np.zeros((8, 3))
    square[:4] = [[1, 1, 2], [4, 1, 2], [4, 3, 2], [1, 3, 2]]
    area, centroid = measure(square, 4, (0.0, 0.0, 1.0))
    assert area == pytest.approx(6.0)
    assert centroid == pytest.approx((2.5, 2.0, 2.0))
    assert measure(square, 4, (0.0, 0.0, -1.0))[0] == pytest.approx(-6.0)

"""Points against convex hulls: solid, large, flat and thin, by construction and by brute force."""

from hypothesis import given, settings
from hypothesis import strategies as st
from measuring import measure_point, measure_points, nearest_on_triangle, pose
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from scene_graph_ros.geometry import Box, Convex

CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


def brute_force(vertices, p):
    """Return the signed distance of p to a hull, over all its triangles."""
    hull = ConvexHull(vertices)
    heights = hull.equations[:, :3] @ p + hull.equations[:, 3]
    if heights.max() <= 0.0:
        return heights.max()
    return min(
        np.linalg.norm(p - nearest_on_triangle(p, *vertices[simplex]))
        for simplex in hull.simplices
    )


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(4, 60), st.sampled_from([1e-4, 1 / 3, 1e4]))
def test_random_hulls(seed, count, scale):
    """Random hulls agree with the nearest of all triangles, at every scale."""
    rng = np.random.default_rng(seed)
    vertices = scale * rng.normal(size=(count, 3))
    p = scale * rng.normal(size=3) * rng.choice([0.2, 1.0, 4.0])
    answer = measure_point(Convex(vertices=vertices), p)
    assert answer.distance == pytest.approx(brute_force(vertices, p), abs=1e-13 * 6 * scale)


@pytest.mark.parametrize("count", [4, 12, 33, 300])
@pytest.mark.parametrize("away", [1.0, 3.0, 30.0, 3e3])
def test_no_corner_is_beyond_the_nearest_point(count, away):
    """Around a hull, the plane through the nearest point, across the way to it, supports it.

    That proves the distance. The hull is off its frame's origin, also a needle and a plate.
    """
    rng = np.random.default_rng(count)
    for stretch in ((1.0, 1.0, 1.0), (1.0, 1e-3, 1e-3), (1.0, 1.0, 1e-3)):
        vertices = rng.normal(size=(count, 3)) / 3 * stretch + (0.7, -0.4, 0.2)
        size = np.ptp(vertices, axis=0).max()
        points = vertices[0] + away * size * rng.normal(size=(200, 3))
        hull = ConvexHull(vertices)
        for p, answer in zip(
            points, measure_points(Convex(vertices=vertices), points), strict=True
        ):
            if answer.distance < 0.1 * size:
                continue
            assert ((vertices - answer.p_GN) @ answer.grad_W).max() <= 4e-15 * size
            heights = hull.equations[:, :3] @ answer.p_GN + hull.equations[:, 3]
            assert heights.max() <= 4e-15 * size
            offset = p - answer.p_GN
            assert answer.distance == pytest.approx(np.linalg.norm(offset), rel=4e-16)
            np.testing.assert_allclose(offset / answer.distance, answer.grad_W, atol=1e-15)
            assert answer.unique


def test_hull_of_a_box_is_the_box():
    """A box as a hull gives the box's answers, everywhere but in ties."""
    half = np.array([0.5, 1 / 3, 2 / 7])
    rng = np.random.default_rng(3)
    points = rng.uniform(-1.0, 1.0, (300, 3))
    X_WG = pose((0.3, 0.2, -0.1), (0.5, 0.1, -0.3))
    hull = measure_points(Convex(vertices=CORNERS * half), points, X_WG)
    box = measure_points(Box(*(2 * half)), points, X_WG)
    for a, b in zip(hull, box, strict=True):
        assert a.distance == pytest.approx(b.distance, abs=4e-15)
        np.testing.assert_allclose(a.p_GN, b.p_GN, atol=1e-14)
        np.testing.assert_allclose(a.grad_W, b.grad_W, atol=1e-13)
        assert a.unique and b.unique


def test_large_hull_bounds_the_sphere():
    """A hull of 2000 points of a sphere is inside it, by less than its facets' height."""
    rng = np.random.default_rng(1)
    vertices = rng.normal(size=(2000, 3))
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    for answer, p in zip(
        measure_points(Convex(vertices=vertices), 1.5 * vertices[:20]), vertices[:20], strict=True
    ):
        assert answer.distance == pytest.approx(0.5, abs=1e-14)
        np.testing.assert_allclose(answer.p_GN, p, atol=1e-14)


def test_centre_of_a_cube_is_a_choice():
    """At a cube's centre one face is chosen, and said to be a choice."""
    answer = measure_point(Convex(vertices=CORNERS / 3), np.zeros(3))
    assert answer.distance == pytest.approx(-1 / 3, abs=1e-15)
    assert not answer.unique


def test_flat_hull_has_two_sides():
    """A flat polygon is all surface: distance from both sides, a choice of side on it."""
    square = Convex(vertices=np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) / 3)
    for z in (0.2, -0.2):
        answer = measure_point(square, np.array([0.1, 0.05, z]))
        assert answer.distance == pytest.approx(0.2, abs=1e-15)
        np.testing.assert_allclose(answer.grad_W, (0, 0, np.sign(z)), atol=1e-15)
        assert answer.unique
    on_it = measure_point(square, np.array([0.1, 0.05, 0.0]))
    assert on_it.distance == pytest.approx(0.0, abs=1e-15)
    assert not on_it.unique
    beside = measure_point(square, np.array([1 / 3 + 0.3, 1 / 3 + 0.4, 0.0]))
    assert beside.distance == pytest.approx(0.5, abs=1e-15)
    np.testing.assert_allclose(beside.grad_W, (0.6, 0.8, 0.0), atol=1e-14)


def test_segment_and_point_as_hulls():
    """Collinear vertices make a segment, equal ones a point, both with an answer everywhere."""
    segment = Convex(vertices=np.array([(0, 0, -1), (0, 0, 0), (0, 0, 1)]) / 3)
    answer = measure_point(segment, np.array([0.3, 0.4, 0.1]))
    assert answer.distance == pytest.approx(0.5, abs=1e-15)
    np.testing.assert_allclose(answer.p_GN, (0, 0, 0.1), atol=1e-15)
    on_it = measure_point(segment, np.array([0.0, 0.0, 0.1]))
    assert on_it.distance == pytest.approx(0.0, abs=1e-15)
    assert on_it.grad_W[2] == pytest.approx(0.0, abs=1e-15)
    assert not on_it.unique
    point = Convex(vertices=np.full((3, 3), 1 / 3))
    answer = measure_point(point, np.array([1 / 3, 1 / 3 + 0.5, 1 / 3]))
    assert answer.distance == pytest.approx(0.5, abs=1e-15)
    assert not measure_point(point, np.full(3, 1 / 3)).unique


def test_needle_beyond_its_tip():
    """Beyond the tip of a needle the distance is to the tip, though all planes are near."""
    needle = np.array([(0, 0, 1), (1e-4, 0, 0), (-1e-4, 1e-4, 0), (-1e-4, -1e-4, 0)])
    answer = measure_point(Convex(vertices=needle), np.array([0.0, 0.0, 1.0 + 1e-10]))
    assert answer.distance == pytest.approx(1e-10, rel=1e-5)
    np.testing.assert_allclose(answer.p_GN, (0, 0, 1), atol=1e-15)

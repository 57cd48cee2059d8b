"""Sets of corners meet or don't, exactly, against programs in fractions and by construction."""

from fractions import Fraction

import numpy as np
import pytest

from scene_graph_ros.convex.solve.exact.corners import with_unit
from scene_graph_ros.convex.solve.exact.nearest_exactly import corners_meet, corners_meet_ball
from scene_graph_ros.geometry.optimization import (
    ConvexHull,
    Hyperellipsoid,
    Hyperrectangle,
    MinkowskiSum,
    Point,
    VPolytope,
)


def grid_set(rng, n):
    """Return a set of small whole coordinates, of one of five kinds; such often touch."""
    kind = rng.integers(5)
    if kind == 0:
        return Point(rng.integers(-3, 4, n).astype(float))
    if kind == 1:
        low = rng.integers(-3, 3, n).astype(float)
        return Hyperrectangle(low, low + rng.integers(0, 3, n))
    if kind == 2:
        return VPolytope(rng.integers(-3, 4, (rng.integers(1, n + 3), n)).astype(float))
    terms = [VPolytope(rng.integers(-1, 2, (2, n)).astype(float)) for _ in range(3)]
    return MinkowskiSum(terms) if kind == 3 else ConvexHull(terms)


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_answers_are_those_of_proven_ones(n):
    """Of sets that touch, overlap and are apart, flat ones and points among them."""
    rng, said = np.random.default_rng(n), []
    for _ in range(60):
        one, other = grid_set(rng, n), grid_set(rng, n)
        decision = one.intersects_with(other, certificate=True)
        assert decision.certificate.verify(one, other)
        assert corners_meet(one.corners, other.corners) == decision.value
        assert one.intersects_with(other) == decision.value
        said.append(decision.value)
    assert 5 < sum(said) < 55


def segments(rng, n, count=60):
    """Return segments of random numbers."""
    middle, way = rng.normal(size=(2, count, n))
    return [VPolytope(np.stack([m - w, m + w])) for m, w in zip(middle, way, strict=True)]


@pytest.mark.parametrize("kind", [MinkowskiSum, ConvexHull])
@pytest.mark.parametrize("n", [3, 7])
def test_many_members_touch_to_the_last_digit(kind, n):
    """A corner is on the set; the next double along a direction that it is furthest in is not."""
    rng = np.random.default_rng(n)
    body = kind(segments(rng, n))
    d = np.zeros(n)
    d[0] = 1.0
    unit = with_unit(body.corners)
    exact = [
        Fraction(int(v), unit) for v in body.corners.along(d.astype(int).astype(object), unit)[1]
    ]
    corner = np.array([float(v) for v in exact])
    # The corner may be no double: what is below it along d, and in a box about it, is met.
    inside, beyond = np.nextafter(corner[0], -np.inf), np.nextafter(corner[0], np.inf)
    low, high = corner - 1e-9, corner + 1e-9
    low[0] = high[0] = inside
    assert body.intersects_with(Hyperrectangle(low, high))
    low[0] = high[0] = beyond
    assert not body.intersects_with(Hyperrectangle(low, high))
    assert body.intersects_with(MinkowskiSum(segments(rng, n)))


def test_balls_touch_exactly():
    """A ball of radius 1/2 about (2, 0, 0) touches the cube of half width 3/2."""
    cube = MinkowskiSum([Hyperrectangle([-0.5] * 3, [0.5] * 3)] * 3)
    for center, meets in (
        ([2.0, 0.0, 0.0], True),
        ([np.nextafter(2.0, 3.0), 0.0, 0.0], False),
        ([1.8, 1.9, 0.0], Fraction(1.8 - 1.5) ** 2 + Fraction(1.9 - 1.5) ** 2 <= Fraction(1, 4)),
        ([1.0, 1.0, 1.0], True),
        ([9.0, 9.0, 9.0], False),
    ):
        ball = Hyperellipsoid(2.0 * np.eye(3), center)
        way = [max(Fraction(abs(c)) - Fraction(3, 2), 0) for c in center]
        assert (sum(w * w for w in way) <= Fraction(1, 4)) is meets
        assert corners_meet_ball(cube.corners, *ball.form) is meets
        assert cube.intersects_with(ball) is meets and ball.intersects_with(cube) is meets


def test_ellipsoids_of_any_axes():
    """A turned, thin one touches a point where the form is 1, of numbers that are exact."""
    A = np.array([[4.0, 4.0], [-0.25, 0.25]])
    for x, meets in (([0.125, 0.125], True), ([0.125, 0.1250001], False), ([-2.0, 2.0], True)):
        found = corners_meet_ball(Point(x).corners, A, np.zeros(2))
        assert found is meets


@pytest.mark.parametrize("size", [1e-300, 1e-12, 1.0, 1e9, 1e134])
def test_any_size_and_distance_from_the_origin(size):
    """Two boxes that share a corner, and two that are one double apart."""
    one = Hyperrectangle([-size, -size], [size, size]).corners
    other = Hyperrectangle([size, size], [2.0 * size, 3.0 * size]).corners
    assert corners_meet(one, other)
    near = np.nextafter(size, np.inf)
    assert not corners_meet(one, Hyperrectangle([near, size], [2.0 * size, 3.0 * size]).corners)
    far = Hyperrectangle([1e15 * size, 1e15 * size], [1.1e15 * size, 3e15 * size]).corners
    assert not corners_meet(one, far)

"""Pairs of sets with many curved members that touch, nearly touch or overlap by little.

Members of one set are put below a plane in any direction, those of the other above it; some of
both touch the plane, such that the hulls of these points have one point in common. So the sets
touch there, and moved along the normal they overlap or are apart by as much.
"""

import numpy as np
import pytest

from scene_graph_ros.convex.questions.touching import meet_by_plane
from scene_graph_ros.geometry.optimization import (
    AffineBall,
    ConvexHull,
    Hyperellipsoid,
    Hyperrectangle,
    MinkowskiSum,
    Point,
    VPolytope,
)


def ellipsoid(rng, u, touched):
    """Return an ellipsoid that reaches furthest along u at a point."""
    n = len(u)
    axes, _ = np.linalg.qr(rng.normal(size=(n, n)))
    B = axes * rng.uniform(0.2, 1.0, n)
    return AffineBall(B, touched - B @ (B.T @ u) / np.linalg.norm(B.T @ u))


def members_below(rng, u, touched, count):
    """Return ellipsoids below the plane through points ``(k, n)``, the first k touch it there."""
    some = [ellipsoid(rng, u, each) for each in touched]
    while len(some) < count:
        beside = rng.normal(size=len(u))
        depth = rng.uniform(0.01, 2.0)
        level = float(touched[0] @ u) - depth
        some.append(ellipsoid(rng, u, beside + (level - float(beside @ u)) * u))
    return some


def touching_hulls(n, seed, overlap, count=60):
    """Return two hulls; how many members of each touch the plane between is by chance."""
    rng = np.random.default_rng((n, seed))
    u = rng.normal(size=n)
    u /= np.linalg.norm(u)
    flat = np.eye(n) - np.outer(u, u)
    shared = flat @ rng.normal(size=n)
    first = int(rng.integers(1, n + 1))
    second = int(rng.integers(1, n + 2 - first))

    def contact(k):
        points, shares = rng.normal(size=(k, n)) @ flat, rng.dirichlet(np.ones(k))
        return points - shares @ points + shared

    below = members_below(rng, u, contact(first), count)
    above = members_below(rng, -u, contact(second) - overlap * u, count)
    return ConvexHull(below), ConvexHull(above)


@pytest.mark.parametrize("n", [2, 3, 5, 7])
@pytest.mark.parametrize("overlap", [1e-2, 1e-6, 1e-9, 0.0, -1e-9, -1e-6, -1e-2])
def test_hulls_of_60_ellipsoids_that_touch_by_corners_and_faces(n, overlap):
    """The sign of the overlap is the answer, also the other way round; touching counts."""
    for seed in range(3):
        one, other = touching_hulls(n, seed, overlap)
        assert meet_by_plane(one, other) is (overlap >= 0.0), seed
        assert one.intersects_with(other) is (overlap >= 0.0), seed
        assert other.intersects_with(one) is (overlap >= 0.0), seed


@pytest.mark.parametrize("n", [2, 3, 7])
@pytest.mark.parametrize("overlap", [1e-2, 1e-9, 0.0, -1e-9, -1e-2])
@pytest.mark.parametrize("away", [0.0, 100.0])
def test_sums_of_60_members_that_touch(n, overlap, away):
    """Where the supports' points along a direction are put upon each other, or off by little."""
    rng = np.random.default_rng((n, 8))
    u = rng.normal(size=n)
    u /= np.linalg.norm(u)

    def terms():
        balls = [Hyperellipsoid.make_axis_aligned(rng.uniform(0.2, 1.0, n), np.zeros(n))]
        balls += [ellipsoid(rng, u, rng.normal(size=n)) for _ in range(57)]
        corners = VPolytope(rng.normal(size=(8, n)))
        return [*balls, corners, Hyperrectangle(-np.ones(n), np.ones(n))]

    one, other = terms(), terms()
    top, bottom = MinkowskiSum(one).support(u).point, MinkowskiSum(other).support(-u).point
    first = MinkowskiSum([*one, Point(np.full(n, away))])
    second = MinkowskiSum([*other, Point(top - bottom - overlap * u + away)])
    assert meet_by_plane(first, second) is (overlap >= 0.0)
    assert first.intersects_with(second) is (overlap >= 0.0)
    assert second.intersects_with(first) is (overlap >= 0.0)


def test_a_ball_touches_a_hull_of_balls_by_its_edge():
    """Balls of radius 1 at (-1, 0), (1, 0), one of radius r above: it touches the edge y = 1."""
    hull = ConvexHull([AffineBall(np.eye(2), [x, 0.0]) for x in (-1.0, 1.0)])
    for radius in (0.1, 1.0, 30.0):
        for gap in (1e-9, 0.0, -1e-9):
            ball = AffineBall(radius * np.eye(2), [0.3, 1.0 + radius + gap])
            sum_of_one = MinkowskiSum([ball])
            assert meet_by_plane(hull, ball) is (gap <= 0.0)
            assert hull.intersects_with(sum_of_one) is (gap <= 0.0)


def test_few_points_of_60_members_are_asked_for(monkeypatch):
    """Some tens for a touching pair, where planes and hulls of points took thousands."""
    count = 0
    support = ConvexHull._support

    def counted(self, d):
        nonlocal count
        count += 1
        return support(self, d)

    monkeypatch.setattr(ConvexHull, "_support", counted)
    for seed in range(3):
        one, other = touching_hulls(7, seed, 0.0)
        assert one.intersects_with(other)
    assert 0 < count <= 3 * 100


def test_what_planes_leave_open_is_decided_elsewhere():
    """Members that are flat, too thin, or sets of members, are asked one by one."""
    flat = AffineBall(np.diag([1.0, 0.0]), [0.0, 0.0])
    thin = Hyperellipsoid(np.diag([1.0, 1e9]), [0.0, 0.0])
    nested = ConvexHull([AffineBall(np.eye(2), [0.0, 0.0])])
    for member in (flat, thin, nested):
        hull = ConvexHull([member, AffineBall(0.1 * np.eye(2), [-3.0, 0.0])])
        for gap in (0.5, -0.05):
            # Along x each member ends at 1.
            ball = MinkowskiSum([AffineBall(0.25 * np.eye(2), [1.25 + gap, 0.0])])
            assert meet_by_plane(hull, ball) is None
            assert hull.intersects_with(ball) is (gap < 0.0)


def test_forms_are_off_by_more_than_balls():
    """Thin forms that are apart by less than their axes are known for count as touching."""
    form = Hyperellipsoid(np.diag([1.0, 1e5]), [0.0, 0.0])
    hull = ConvexHull([form, Point([-2.0, 0.0])])
    for gap, meets in ((1e-7, False), (1e-15, True), (-1e-7, True)):
        ball = MinkowskiSum([AffineBall(np.eye(2), [2.0 + gap, 0.0])])
        assert hull.intersects_with(ball) is meets

"""Ellipsoids that touch, the largest in a set and the smallest around points, with bounds."""

from fractions import Fraction
import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.convex.questions.ellipsoids import circumscribed, inscribed
from scene_graph_ros.geometry.optimization import (
    AffineBall,
    ConvexSetError,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    Intersection,
    SolverError,
    VPolytope,
)

seeds = st.integers(0, 2**32 - 1)


def test_scaling_to_touch():
    """From the origin, radii 1 and 2 along x and y, the box x >= 3 is met at 3 times the size."""
    ellipse = Hyperellipsoid.make_axis_aligned([1.0, 2.0], [0.0, 0.0])
    factor, x = ellipse.minimum_uniform_scaling_to_touch(Hyperrectangle([3.0, -1.0], [4.0, 1.0]))
    assert factor == pytest.approx(3.0, abs=1e-9)
    np.testing.assert_allclose(x, [3.0, 0.0], atol=1e-4)
    inside, _ = ellipse.minimum_uniform_scaling_to_touch(Hyperrectangle([-1.0, -1.0], [1.0, 1.0]))
    assert inside == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_scaling_to_touch_what_is_built_to_touch(n, size):
    """A half space, a wedge and a hull beyond a plane that touches the ellipsoid at one point."""
    rng = np.random.default_rng(n)
    turn, _ = np.linalg.qr(rng.normal(size=(n, n)))
    radii = size * 10.0 ** rng.uniform(-2.0, 1.0, n)
    center = 10.0 * size * rng.normal(size=n)
    ellipsoid = Hyperellipsoid((turn / radii).T, center)
    factor = 3.7
    u = rng.normal(size=n)
    u /= np.linalg.norm(u)
    x = center + factor * turn @ (radii * u)  # on the surface of the scaled one
    outward = turn @ (u / radii)
    outward /= np.linalg.norm(outward)
    side = outward @ x
    others = rng.normal(size=(2 * n, n)) + 2.0 * outward
    beyond = x + size * rng.uniform(0.1, 1.0, (12, 1)) * (others[rng.integers(0, 2 * n, 12)])
    beyond += np.maximum(side - beyond @ outward, 0.0)[:, None] * 1.5 * outward
    wedge = HPolyhedron(np.vstack([-outward, -others]), np.append(-side, -others @ x))
    sets = [HPolyhedron(-outward[None], [-side]), wedge, VPolytope(np.vstack([x, beyond]))]
    for other in sets:
        found, touching = ellipsoid.minimum_uniform_scaling_to_touch(other)
        assert found == pytest.approx(factor, rel=1e-9)
        np.testing.assert_allclose(touching, x, atol=1e-4 * radii.max())
        assert other.point_in_set(touching, tol=1e-9 * size)
    curved = Intersection(wedge, Hyperellipsoid.make_hypersphere(1e3 * size, x))
    assert ellipsoid.minimum_uniform_scaling_to_touch(curved)[0] == pytest.approx(factor, rel=1e-6)


def exactly_inside(found, A, b):
    """Tell in fractions whether ``a.c + |B' a| <= b`` for all rows."""
    for row, side in zip(A, b, strict=True):
        a = [Fraction(float(v)) for v in row]
        slack = Fraction(float(side)) - sum(
            x * Fraction(float(c)) for x, c in zip(a, found.center, strict=True)
        )
        along = [
            sum(x * Fraction(float(v)) for x, v in zip(a, column, strict=True))
            for column in found.B.T
        ]
        if slack < 0 or sum(v * v for v in along) > slack**2:
            return False
    return True


@pytest.mark.parametrize("size", [1e-8, 1e-4, 1.0, 1e6, 1e8])
@pytest.mark.parametrize("thin", [1.0, 1e-5, 1e-9])
def test_largest_ellipsoid_in_a_box(size, thin):
    """Its half widths are the radii, at any size and thinness, with rows of any length."""
    half = size * np.array([1.0, 2.0, thin])
    factors = np.array([1e-6, 1.0, 1e6, 1.0, 3.0, 1e3])
    box = HPolyhedron.make_box(-half, half)
    odd = HPolyhedron(box.A * factors[:, None], box.b * factors)
    found = inscribed(odd)
    radii = np.sort(np.linalg.svd(found.B)[1])
    np.testing.assert_allclose(radii, np.sort(half), rtol=1e-9)
    assert found.gap < 1e-9
    assert exactly_inside(found, odd.A, odd.b)


@pytest.mark.parametrize("size", [1e-8, 1.0, 1e8])
@pytest.mark.parametrize("thin", [1e-2, 1e-4, 1e-6])
def test_largest_ellipsoid_in_a_turned_thin_box(size, thin):
    """As far as turning leaves its rows at right angles, which is 1e-16 beside its thinness."""
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    half = size * np.array([1.0, 1.0, thin])
    A, b = np.concatenate([turn, -turn]), np.tile(half, 2)
    found = inscribed(HPolyhedron(A, b))
    error = abs(np.linalg.slogdet(found.B)[1] - np.log(half).sum())
    assert error < 1e-9 + 1e-14 / thin
    assert exactly_inside(found, A, b)


def test_no_ellipsoid_is_told_of_what_is_thinner_than_rounding():
    """But an error that says so, and no other."""
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    for thin in (1e-10, 1e-12, 1e-14, 1e-16):
        box = HPolyhedron(np.concatenate([turn, -turn]), np.tile([1.0, 1.0, thin], 2))
        try:
            found = inscribed(box)
        except (ConvexSetError, SolverError):
            continue
        error = abs(np.linalg.slogdet(found.B)[1] - math.log(thin))
        assert error < 1e-14 / thin


@pytest.mark.parametrize("n", [1, 2, 3, 7])
def test_largest_ellipsoid_in_a_simplex(n):
    """In ``x >= 0, sum x <= 1``: the image of the ball in the regular one.

    Of a regular simplex with edge s the inner ball has the radius s / sqrt(2 n (n + 1)), and the
    volume sqrt(n + 1) / (n! 2^(n/2)) s^n; shares of volume are affine invariants.
    """
    simplex = HPolyhedron(np.vstack([-np.eye(n), np.ones(n)]), np.append(np.zeros(n), 1.0))
    radius = 1.0 / math.sqrt(2 * n * (n + 1))
    share = radius**n / (math.sqrt(n + 1) / (math.factorial(n) * 2 ** (n / 2)))
    found = inscribed(simplex)
    truth = math.log(share / math.factorial(n))
    assert np.linalg.slogdet(found.B)[1] == pytest.approx(truth, abs=1e-9)
    assert found.gap < 1e-9
    np.testing.assert_allclose(found.center, np.full(n, 1 / (n + 1)), atol=1e-9)
    assert exactly_inside(found, simplex.A, simplex.b)
    ellipsoid = simplex.maximum_volume_inscribed_ellipsoid()
    assert ellipsoid.point_in_set(np.full(n, 1 / (n + 1)))


@pytest.mark.parametrize(("n", "m"), [(2, 24), (3, 36), (7, 64)])
def test_largest_ellipsoids_reach_their_bound(n, m):
    """In a box cut by random planes, of which many touch: to some digits of rounding."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        normals = rng.normal(size=(m - 2 * n, n))
        A = np.concatenate([np.eye(n), -np.eye(n), normals])
        b = np.append(np.ones(2 * n), 0.5 * np.linalg.norm(normals, axis=1))
        found = inscribed(HPolyhedron(A, b))
        assert found.gap < 1e-11
        assert exactly_inside(found, A, b)


@pytest.mark.parametrize("near", [1e-1, 1e-3, 1e-5, 1e-8])
@pytest.mark.parametrize("n", [2, 3, 7])
def test_largest_ellipsoid_beside_rows_that_nearly_touch(n, near):
    """A cube's largest ellipsoid is the ball, whatever planes come near to it (John 1948)."""
    rng = np.random.default_rng(n)
    planes = rng.normal(size=(8 * n, n))
    planes /= np.linalg.norm(planes, axis=1)[:, None]
    A = np.concatenate([np.eye(n), -np.eye(n), planes])
    b = np.append(np.ones(2 * n), 1.0 + near * rng.random(8 * n))
    found = inscribed(HPolyhedron(A, b))
    assert abs(np.linalg.slogdet(found.B)[1]) < 1e-9 * n
    assert found.gap < 1e-9 * n
    assert exactly_inside(found, A, b)


def test_no_largest_ellipsoid():
    """In flat, empty and unbounded sets."""
    flat = HPolyhedron([[1.0, 0], [-1.0, 0], [0, 1.0], [0, -1.0]], [1.0, -1.0, 1.0, 1.0])
    with pytest.raises(ConvexSetError, match="AffineSubspace"):
        flat.maximum_volume_inscribed_ellipsoid()
    with pytest.raises(ConvexSetError, match="bounded"):
        HPolyhedron([[1.0]], [1.0]).maximum_volume_inscribed_ellipsoid()


@given(seeds)
@settings(deadline=None, derandomize=True, max_examples=20)
def test_smallest_ellipsoid_around_points(seed):
    """Around a moved, turned and stretched cube: the image of its ball of radius sqrt(n)."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    map_, shift = rng.normal(size=(n, n)) + 2.0 * np.eye(n), 100.0 * rng.normal(size=n)
    map_ *= 10.0 ** rng.integers(-8, 9)
    corners = VPolytope.make_unit_box(n).vertices @ map_.T + shift * np.abs(map_).max()
    inner = rng.uniform(-0.9, 0.9, size=(5, n)) @ map_.T + shift * np.abs(map_).max()
    points = np.vstack([corners, inner])
    found, rank = circumscribed(points, 1e-9, "test")
    truth = np.linalg.slogdet(map_)[1] + 0.5 * n * math.log(n)
    assert rank == n
    assert np.linalg.slogdet(found.B)[1] == pytest.approx(truth, abs=1e-7)
    assert found.gap < 1e-7 * n
    local = np.linalg.solve(found.B, (points - found.center).T)
    assert np.linalg.norm(local, axis=0).max() <= 1.0
    assert (
        AffineBall.minimum_volume_circumscribed_ellipsoid(points, 1e-9).point_in_set(points).all()
    )


def test_smallest_ellipsoid_around_flat_points():
    """In the points' plane, where a Hyperellipsoid is refused with the rank."""
    square = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    ball = AffineBall.minimum_volume_circumscribed_ellipsoid(square)
    np.testing.assert_allclose(np.sort(np.linalg.svd(ball.B)[1]), [0.0, 1.0, 1.0], atol=1e-7)
    with pytest.raises(ConvexSetError, match="rank 2 in 3 dimensions; use AffineBall"):
        Hyperellipsoid.minimum_volume_circumscribed_ellipsoid(square)
    one = AffineBall.minimum_volume_circumscribed_ellipsoid([[1.0, 2.0]])
    np.testing.assert_array_equal(one.maybe_get_point(), [1.0, 2.0])

"""Curved sets: closed forms, proofs, agreement with each other; ellipsoids with their bounds."""

from fractions import Fraction
import math

from hypothesis import example, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Capsule,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.optimization import (
    AffineBall,
    AffineSubspace,
    CartesianProduct,
    ConvexHull,
    ConvexSetError,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    Intersection,
    MinkowskiSum,
    Point,
    SolverError,
    VPolytope,
)
from scene_graph_ros.geometry.optimization.sets.ellipsoids import circumscribed, inscribed
from scene_graph_ros.geometry.optimization.solve.rows import is_inside

seeds = st.integers(0, 2**32 - 1)
SIZES = [1e-8, 1.0, 1e8]
LINE = Hyperellipsoid([[1.0, 0.0], [0.0, 1.0]], [0.0, 0.0])


def members(n):
    """Two balls, a box and a hull in n dimensions, each about another point."""
    return [
        Hyperellipsoid.make_hypersphere(1.0, np.full(n, 0.25)),
        AffineBall.make_axis_aligned(1.0 + np.arange(n), np.arange(n) - 0.5),
        Hyperrectangle(-np.ones(n), 2.0 * np.ones(n)),
        VPolytope(np.vstack([np.zeros(n), 3.0 * np.eye(n)])),
    ]


def curved(n):
    """Return a set of each curved kind."""
    ball, flat, box, hull = members(n)
    return [
        ball,
        flat,
        MinkowskiSum([ball, hull]),
        CartesianProduct([ball], A=2.0 * np.eye(n), b=np.ones(n)),
        Intersection([ball, box, flat]),
        ConvexHull([ball, hull, VPolytope(np.zeros((0, n)))]),
    ]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, -1e-9, -1e-6, -1e-3])
def test_balls_beside_each_other(size, gap):
    """Radii 1 and 2, centres 3 + gap apart along (2, 3, 6)/7: proven either way down to 1e-9."""
    way = np.array([2.0, 3.0, 6.0]) / 7.0
    one = Hyperellipsoid.make_hypersphere(size, np.zeros(3))
    for other in (
        Hyperellipsoid.make_hypersphere(2.0 * size, way * (3.0 + gap) * size),
        AffineBall.make_hypersphere(2.0 * size, way * (3.0 + gap) * size),
        MinkowskiSum(
            [Point(way * (3.0 + gap) * size), AffineBall(2 * size * np.eye(3), [0, 0, 0])]
        ),
    ):
        decision = one.intersects_with(other, certificate=True)
        assert decision.value == (gap < 0.0)
        assert decision.certificate.kind == ("point" if gap < 0.0 else "farkas")
        assert decision.certificate.verify(one, other)


@pytest.mark.parametrize("size", SIZES)
def test_touching_is_undecided_with_a_gap(size):
    """The unit ball and a point on it, or another ball that touches: at most 1e-9 is left open."""
    ball = Hyperellipsoid.make_hypersphere(size, np.zeros(3))
    on_it = np.array([2.0, 3.0, 6.0]) / 7.0 * size
    for other in (Point(on_it), Hyperellipsoid.make_hypersphere(size, 2.0 * on_it)):
        decision = ball.intersects_with(other, certificate=True)
        if decision.certificate.kind == "undecided":
            assert decision.value
            assert decision.certificate.gap <= 1e-9
            assert not decision.certificate.verify()
        else:
            assert decision.certificate.verify()


@pytest.mark.parametrize("n", [1, 2, 3])
def test_every_kind_has_its_proofs(n):
    """Not empty, bounded, and whether it meets boxes near and far."""
    near = Hyperrectangle(np.full(n, 0.1), np.full(n, 0.3))
    far = Hyperrectangle(np.full(n, 50.0), np.full(n, 60.0))
    for each in curved(n):
        for decision, value in (
            (each.is_empty(certificate=True), False),
            (each.is_bounded(certificate=True), True),
            (each.intersects_with(near, certificate=True), not isinstance(each, CartesianProduct)),
            (each.intersects_with(far, certificate=True), False),
        ):
            if not (n > 1 and isinstance(each, CartesianProduct)):
                assert decision.certificate.verify()
            if not isinstance(each, CartesianProduct):
                assert decision.value == value


NEARLY_PARALLEL_CUTS = 511
"""Seed of an intersection where the cuts near an optimum are so nearly parallel that a corner of
them, reached by walking along edges in floats, is outside another one by 1e-9."""


@example(NEARLY_PARALLEL_CUTS)
@given(seeds)
@settings(deadline=None, derandomize=True, max_examples=3)
def test_projections_and_supports_bound_each_other(seed):
    """The plane through the nearest point, square to the way there, has the set behind it.

    Nearest points are inside; along the way back the set reaches as far as they are.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    points = 4.0 * rng.normal(size=(1, n))
    for each in curved(n):
        distances, nearest, gaps = each.projection(points)
        assert gaps.max() < 1e-8
        assert each.point_in_set(nearest, 1e-7).all()
        for k in np.flatnonzero(distances > 1e-3):
            way = (points[k] - nearest[k]) / distances[k]
            reach = each.support(way)
            assert reach.value == pytest.approx(way @ nearest[k], abs=1e-7)
            assert reach.gap < 1e-8


def test_distances_of_sums_and_hulls():
    """A capsule by a sum and by a hull: distance to its segment less the radius."""
    ends = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    ball = Hyperellipsoid.make_hypersphere(0.5, np.zeros(3))
    tips = [Hyperellipsoid.make_hypersphere(0.5, end) for end in ends]
    points = np.array([[2.0, 0.0, 0.3], [0.0, 3.0, 5.0], [0.1, 0.1, 0.0]])
    to_segment = [2.0, 5.0, math.hypot(0.1, 0.1)]
    for capsule in (MinkowskiSum(ball, VPolytope(ends)), ConvexHull(tips)):
        found = capsule.projection(points)
        np.testing.assert_allclose(
            found.distances, np.maximum(np.subtract(to_segment, 0.5), 0), atol=1e-9
        )
        np.testing.assert_allclose(found.points[0], [0.5, 0.0, 0.3], atol=1e-6)
        assert capsule.support([0.0, 0.6, 0.8]).value == pytest.approx(0.8 + 0.5, abs=1e-14)


@pytest.mark.parametrize("size", [1e-8, 1.0, 1e8])
def test_supports_of_intersections(size):
    """A lens of two balls of radius 5, centres 6 apart: its tips are 4 from the axis, its ends 2.

    Three, four, five; moved by ten sizes.
    """
    shift = np.array([10.0, 20.0, -5.0])
    balls = [
        Hyperellipsoid.make_hypersphere(5.0 * size, size * (shift + np.array([x, 0.0, 0.0])))
        for x in (-3.0, 3.0)
    ]
    lens = Intersection(balls)
    for direction, truth in (([1.0, 0.0, 0.0], 12.0), ([0.0, 0.6, 0.8], 12.0)):
        found = lens.support(direction)
        assert found.gap < 1e-9 * size
        assert found.value == pytest.approx(truth * size, abs=1e-9 * size)


def test_registered_shapes():
    """A ball, an ellipsoid, a capsule and a cylinder, turned; surface points lie on their sets."""
    graph = SceneGraph()
    source = graph.register_source("s")
    frame = graph.register_frame(source, GeometryFrame("f"))
    shapes = [Sphere(0.5), Ellipsoid(0.5, 1.0, 1.5), Capsule(0.25, 1.0), Cylinder(0.25, 1.0)]
    ids = [
        graph.register_geometry(source, frame, GeometryInstance(np.eye(4), shape, f"g{k}"))
        for k, shape in enumerate(shapes)
    ]
    X_WF = np.eye(4)
    X_WF[:3] = [[0.0, 0.0, 1.0, 1.0], [1.0, 0.0, 0.0, 2.0], [0.0, 1.0, 0.0, 3.0]]
    context = graph.create_default_context()
    context.set_frame_poses(source, {frame: X_WF})
    query = graph.query_object(context)
    # In F, the set reaches this far along x, y and z.
    reach = [[0.5] * 3, [0.5, 1.0, 1.5], [0.25, 0.25, 0.75], [0.25, 0.25, 0.5]]
    kinds = [Hyperellipsoid, Hyperellipsoid, MinkowskiSum, CartesianProduct]
    for kind, geometry, ends in zip(kinds, ids, reach, strict=True):
        made, local = kind(query, geometry), kind(query, geometry, frame)
        for axis in range(3):
            along = X_WF[:3, axis]
            value = made.support(along).value - along @ X_WF[:3, 3]
            assert value == pytest.approx(ends[axis], abs=1e-9)
            assert local.support(np.eye(3)[axis]).value == pytest.approx(ends[axis], abs=1e-9)
        with pytest.raises(ConvexSetError, match=r"must be an? "):
            kind(query, ids[3] if kind is not CartesianProduct else ids[0])
    corner = np.array([0.25 * 0.6, 0.25 * 0.8, 0.5])
    cylinder = CartesianProduct(query, ids[3])
    assert cylinder.point_in_set(X_WF[:3, :3] @ corner * 0.999 + X_WF[:3, 3])
    assert not cylinder.point_in_set(X_WF[:3, :3] @ corner * 1.001 + X_WF[:3, 3])


def test_unbounded_and_empty_members():
    """A strip, a cylinder without ends, what they add up to; empty ones of sums, none of hulls."""
    strip = Hyperellipsoid([[1.0, 0.0, 0.0]], [5.0, 0.0, 0.0])
    ball = Hyperellipsoid.make_unit_ball(3)
    nothing = VPolytope(np.zeros((0, 3)))
    for each in (strip, MinkowskiSum(strip, ball), ConvexHull([strip, ball])):
        decision = each.is_bounded(certificate=True)
        assert not decision.value
        assert decision.certificate.kind == "recession"
        assert decision.certificate.verify()
        assert each.support([0.0, 1.0, 0.0]).value == np.inf
    assert Intersection(strip, Hyperellipsoid.make_hypersphere(3.0, [5.0, 0, 0])).is_bounded()
    assert MinkowskiSum(ball, nothing).is_empty()
    assert MinkowskiSum(strip, nothing).is_bounded()
    assert not ConvexHull([ball, nothing]).is_empty()
    assert ConvexHull([nothing]).is_empty()
    assert CartesianProduct(ball, nothing).is_empty()
    assert Intersection(ball, Hyperellipsoid.make_hypersphere(1.0, [5.0, 0, 0])).is_empty()


def test_nothing_to_put_together():
    """Without members there is {0}; a hull of nothing is empty."""
    for zero in (
        MinkowskiSum(),
        CartesianProduct(),
        Intersection(),
        Hyperellipsoid(),
        AffineBall(),
    ):
        assert zero.ambient_dimension == 0
        assert not zero.is_empty()
        assert zero.is_bounded()
        assert zero.point_in_set([])
    assert ConvexHull([]).is_empty()


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_volumes_and_conversions(n):
    """The unit ball's are 2, pi, 4/3 pi, pi^2/2, times the product of radii; there and back."""
    unit = [2.0, math.pi, 4.0 / 3.0 * math.pi, 0.5 * math.pi**2][n - 1]
    radii = 1.0 + np.arange(n)
    ellipsoid = Hyperellipsoid.make_axis_aligned(radii, np.ones(n))
    assert ellipsoid.calc_volume() == pytest.approx(unit * np.prod(radii))
    ball = AffineBall(ellipsoid)
    assert ball.calc_volume() == pytest.approx(unit * np.prod(radii))
    np.testing.assert_allclose(Hyperellipsoid(ball).A, ellipsoid.A, atol=1e-15)
    assert AffineSubspace(ball).affine_dimension() == n
    flat = AffineBall.make_axis_aligned(np.append(radii[1:], 0.0), np.zeros(n))
    assert flat.calc_volume() == 0.0
    assert AffineSubspace(flat).affine_dimension() == n - 1


def test_volumes_by_sampling():
    """The disc's pi to four standard errors, a cut disc's half; an empty set's 0."""
    disc = Hyperellipsoid.make_unit_ball(2)
    half = Intersection(disc, HPolyhedron([[1.0, 0.0]], [0.0]))
    for each, truth in ((disc, math.pi), (half, 0.5 * math.pi)):
        found = each.calc_volume_via_sampling(np.random.default_rng(1), 0.01)
        assert 0.005 < found.rel_accuracy <= 0.01
        assert found.volume == pytest.approx(truth, rel=4.0 * found.rel_accuracy)
        assert found.num_samples < 10_000
    nothing = Intersection(disc, Point([2.0, 0.0]))
    assert nothing.calc_volume_via_sampling(np.random.default_rng(1)).volume == 0.0
    with pytest.raises(ConvexSetError, match="is unbounded"):
        HPolyhedron([[1.0]], [0.0]).calc_volume_via_sampling(np.random.default_rng(1))
    with pytest.raises(ConvexSetError, match="desired_rel_accuracy must be at most 1"):
        disc.calc_volume_via_sampling(np.random.default_rng(1), 2.0)


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


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: AffineBall(np.ones((2, 3)), [0.0, 0.0]), r"B must be square, not \(2, 3\)"),
        (lambda: Hyperellipsoid(AffineBall(np.zeros((2, 2)), [0.0, 0.0])), "set is flat"),
        (lambda: AffineBall(Hyperellipsoid([[1.0, 0.0]], [0.0, 0.0])), "is unbounded"),
        (lambda: Hyperellipsoid.make_axis_aligned([1.0, 0.0], [0, 0]), "radius must be positive"),
        (lambda: AffineBall.make_hypersphere(-1.0, [0.0]), "radius must be at least 0"),
        (lambda: MinkowskiSum([LINE, Point([0.0])]), r"one ambient dimension, not \[2, 1\]"),
        (lambda: Intersection([LINE, 3]), "sets must be ConvexSets, not 3"),
        (lambda: CartesianProduct([LINE], A=np.zeros((2, 2)), b=[0, 0]), "full column rank 2"),
        (lambda: CartesianProduct([LINE], A=np.eye(2)), "A and b belong together"),
        (lambda: AffineBall(np.eye(2), [0.0]), r"center must have the shape \(2,\)"),
        (lambda: ConvexHull([]).support([]), "the set is empty"),
    ],
)
def test_errors_name_argument_value_and_remedy(make, message):
    """What makes no set."""
    with pytest.raises(ConvexSetError, match=message):
        make()


def test_shapes_of_curved_sets():
    """A ball is a Sphere, an ellipsoid an Ellipsoid with its axes."""
    assert AffineBall.make_hypersphere(0.5, [1.0, 2.0, 3.0]).to_shape_with_pose()[0] == Sphere(0.5)
    shape, X_WG = Hyperellipsoid.make_axis_aligned([1.0, 2.0, 3.0], [0, 0, 0]).to_shape_with_pose()
    radii = np.abs(X_WG[:3, :3]) @ [shape.a, shape.b, shape.c]
    np.testing.assert_allclose(radii, [1.0, 2.0, 3.0], atol=1e-15)
    assert np.linalg.det(X_WG[:3, :3]) == pytest.approx(1.0)


def test_flat_sets_put_together_stay_exact():
    """Sums, hulls and products of boxes decide as polyhedra do: touching by the last digit."""
    box = Hyperrectangle([0.0, 0.0], [0.1, 0.1])
    twice = MinkowskiSum(box, box)
    hull = ConvexHull([box, Point([0.2, 0.2])])
    for corner, meets in ((0.2, True), (np.nextafter(0.2, 1.0), False)):
        other = HPolyhedron.make_box([corner, corner], [1.0, 1.0])
        for each in (twice, hull):
            decision = each.intersects_with(other, certificate=True)
            assert decision.value == meets
            assert decision.certificate.verify(each, other)
    assert is_inside(
        HPolyhedron.make_box([0.0, 0.0], [0.2, 0.2]).lift().rows, np.array([0.2, 0.2])
    )

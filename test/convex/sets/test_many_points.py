"""Hulls of many points, hulls and sums of many sets: exact answers by few of them, in time."""

from fractions import Fraction

import numpy as np
import pytest

from scene_graph_ros.convex.solve.exact.feasibility import _find_in_all, find_point
from scene_graph_ros.convex.solve.exact.sifting import weights_of
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
    Spectrahedron,
    VPolytope,
)


def cloud(rng, count, n, center):
    """Return normally distributed points about ``center`` along each axis."""
    return VPolytope(rng.normal(size=(count, n)) + center)


@pytest.mark.parametrize("n", [2, 3, 6])
@pytest.mark.parametrize("gap", [0.0, 30.0])
def test_hulls_of_many_points_meet_or_not_with_proof(n, gap):
    """Two clouds about one place share a point; 30 apart they don't. The record shows it."""
    rng = np.random.default_rng(n)
    one, other = cloud(rng, 150, n, 0.0), cloud(rng, 150, n, gap)
    assert one.intersects_with(other) is (gap == 0.0)
    decision = one.intersects_with(other, certificate=True)
    assert decision.value is (gap == 0.0)
    assert decision.certificate.verify()


@pytest.mark.parametrize("side", [-1.0, 0.0, 1.0])
def test_hulls_that_touch_in_one_corner_are_told_exactly(side):
    """Integer points below 0 and above, and a corner an ulp before, at, or behind the other."""
    rng = np.random.default_rng(0)
    whole = rng.integers(1, 1000, size=(100, 3)).astype(float)
    corner = np.full((1, 3), side * np.spacing(1.0))
    left = VPolytope(np.concatenate([-whole, [[0.0, 0.0, 0.0]]]))
    right = VPolytope(np.concatenate([whole, corner]))
    assert left.intersects_with(right) is (side <= 0.0)


@pytest.mark.parametrize("seed", range(4))
def test_few_weights_say_what_all_of_them_say(seed):
    """The same decision from all weights at once; 40 of them, near to touching."""
    rng = np.random.default_rng(seed)
    points = rng.integers(-3, 4, size=(60, 2)).astype(float)
    for shift in range(8):
        both = Intersection(VPolytope(points), VPolytope(points[:30] + shift))
        rows = both.lifted.rows
        assert weights_of(rows) is not None
        assert find_point(rows).kind == _find_in_all(rows).kind


def test_one_is_not_empty_with_proof():
    """800 points: the certificate is a point of the hull."""
    hull = cloud(np.random.default_rng(1), 400, 3, 0.0)
    assert not hull.is_empty()
    assert hull.is_empty(certificate=True).certificate.verify()
    assert hull.point_in_set(hull.maybe_get_feasible_point(), 0.0)


def test_hulls_meet_rows_and_balls():
    """A cloud about 0 meets a box and a ball there, and none that is far."""
    hull = cloud(np.random.default_rng(2), 300, 3, 0.0)
    for place, meets in ((0.0, True), (40.0, False)):
        box = HPolyhedron.make_box(np.full(3, place - 1.0), np.full(3, place + 1.0))
        ball = Hyperellipsoid.make_hypersphere(1.0, np.full(3, place))
        assert hull.intersects_with(box) is meets
        assert box.intersects_with(hull) is meets
        assert hull.intersects_with(ball) is meets


def test_hulls_and_sums_of_many_sets_ask_their_members():
    """60 boxes and clouds, 40 segments: bounded, not empty, and as far as their members reach."""
    rng = np.random.default_rng(3)
    places = rng.normal(size=(60, 3)) * 3.0
    boxes = [HPolyhedron.make_box(c - 1.0, c + 1.0) for c in places]
    hull = ConvexHull([*boxes, *(VPolytope(c + rng.normal(size=(5, 3))) for c in places)])
    total = MinkowskiSum([VPolytope(rng.normal(size=(2, 3))) for _ in range(40)])
    for of in (hull, total):
        assert of.is_bounded()
        assert not of.is_empty()
        x = of.maybe_get_feasible_point()
        assert of.point_in_set(x)
        far = of.support([1.0, 0.0, 0.0]).value + 2.0
        apart = HPolyhedron.make_box([far, -1e3, -1e3], [far + 1.0, 1e3, 1e3])
        assert not of.intersects_with(apart)
        assert of.projection([[far, 0.0, 0.0]]).distances[0] >= 2.0 - 1e-12
    assert hull.intersects_with(HPolyhedron.make_box(places[0] - 0.1, places[0] + 0.1))


@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_hulls_of_many_balls_meet_what_is_inside(shift):
    """Sixty balls about a sphere: a box, points and other balls within, and ones far outside."""
    rng = np.random.default_rng(0)
    centers = rng.normal(size=(60, 3))
    centers *= 2.0 / np.linalg.norm(centers, axis=1)[:, np.newaxis]
    hull = ConvexHull([Hyperellipsoid.make_hypersphere(0.1, c) for c in centers + shift])
    for away, meets in ((0.0, True), (9.0, False)):
        about = np.full(3, shift + away)
        assert hull.intersects_with(HPolyhedron.make_box(about - 0.1, about + 0.1)) is meets
        assert hull.intersects_with(VPolytope(0.1 * centers + about)) is meets
        small = [Hyperellipsoid.make_hypersphere(0.01, 0.1 * c + about) for c in centers[:9]]
        assert ConvexHull(small).intersects_with(hull) is meets


def test_unbounded_and_empty_members():
    """A half-space makes a hull or a sum unbounded, unless nothing is left of the sum."""
    half = HPolyhedron([[1.0, 0.0]], [0.0])
    nothing = HPolyhedron([[1.0, 0.0], [-1.0, 0.0]], [-1.0, -1.0])
    corner = VPolytope([[1.0, 1.0]])
    assert not ConvexHull([half, corner]).is_bounded()
    assert ConvexHull([nothing, corner]).is_bounded()
    assert not ConvexHull([nothing, corner], remove_empty_sets=False).is_empty()
    assert ConvexHull([nothing]).is_empty()
    assert not MinkowskiSum([half, corner]).is_bounded()
    assert MinkowskiSum([half, nothing]).is_bounded()
    assert MinkowskiSum([half, nothing]).is_empty()
    assert MinkowskiSum([half, nothing]).maybe_get_feasible_point() is None


@pytest.mark.parametrize("n", [1, 3, 8])
@pytest.mark.parametrize("size", [1.0, 1e8])
@pytest.mark.parametrize("offset", [0.0, 1e8])
def test_points_deep_inside_a_hull_are_inside(n, size, offset):
    """Means of all corners, with no tolerance, and at the default one."""
    rng = np.random.default_rng(n)
    corners = size * rng.normal(size=(40, n)) + offset
    means = rng.dirichlet(np.full(40, 5.0), 50) @ corners
    assert VPolytope(corners).point_in_set(means, 0.0).all()
    assert VPolytope(corners).point_in_set(means).all()


WEDGE = [[1.0, 1e-3], [-1.0, 1e-3]]
"""Rows of a wedge with its tip at 0: a point above the tip is 1000 times nearer to each row."""


@pytest.mark.parametrize(
    "wedge",
    [
        HPolyhedron(WEDGE, [0.0, 0.0]),
        Intersection([HPolyhedron(WEDGE[:1], [0.0]), HPolyhedron(WEDGE[1:], [0.0])]),
        CartesianProduct(
            [HPolyhedron(WEDGE, [0.0, 0.0]), Point([0.0])],
            A=np.eye(3)[:, :2],
            b=np.zeros(3),
        ),
    ],
)
def test_the_tolerance_is_a_distance(wedge):
    """9e-6 above the tip each row is 9e-9 away, the set 9e-6."""
    assert not wedge.point_in_set([0.0, 9e-6], 1e-8)
    assert wedge.point_in_set([0.0, 9e-6], 1.0001 * 9e-6)
    assert not wedge.point_in_set([0.0, 9e-6], 0.9999 * 9e-6)
    assert wedge.point_in_set([0.0, -1.0], 0.0)


def test_tolerances_of_boxes_and_of_nothing():
    """A box's corner is a diagonal away, an empty set holds no point, no tolerance is below 0."""
    box = HPolyhedron.make_unit_box(2)
    corner = [1.0 + 3e-9, 1.0 + 4e-9]
    assert box.point_in_set(corner, 5.001e-9)
    assert not box.point_in_set(corner, 4.99e-9)
    nothing = HPolyhedron([[1.0], [-1.0]], [-1e-9, -1e-9])
    assert not nothing.point_in_set([0.0], 1.0)
    with pytest.raises(ValueError, match="tol must be at least 0, not -1"):
        box.point_in_set([0.0, 0.0], -1.0)


def test_a_product_with_more_rows_than_columns_has_its_points_to_a_tolerance():
    """Exactly it is empty: rounding of four rows leaves two columns nothing."""
    x = np.array([1.23, 4.5])
    A = np.array([[1.2, 4.0], [2.0, -1.2], [4.3, -2.0], [7.1, 1.4]])
    b = np.array([0.64, 9.2, 7.2, 1.0])
    y = A @ x + b
    product = CartesianProduct([Point(y[:2]), Point(y[2:])], A=A, b=b)
    assert product.is_empty()
    assert product.point_in_set(x, 1e-9)
    assert not product.point_in_set(x + 1e-6, 1e-9)


def test_projection_does_not_depend_on_the_origin():
    """A lens of two unit balls, asked beyond its rim, which is at the origin or far from it."""
    for place in (np.zeros(3), np.full(3, 5.0)):
        half = np.array([0.6, 0.0, 0.0])
        rim = np.array([0.0, 0.8, 0.0])
        lens = Intersection(
            Hyperellipsoid.make_hypersphere(1.0, place - half - rim),
            Hyperellipsoid.make_hypersphere(1.0, place + half - rim),
        )
        found = lens.projection([place + np.array([0.0, 1e-4, 0.0])])
        assert found.distances[0] == pytest.approx(1e-4, abs=1e-9)


@pytest.mark.parametrize("thin", [1.0, 1e-3, 1e-5])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_no_point_is_outside_of_the_smallest_ellipsoid(thin, offset):
    """In the form's own numbers, whatever their condition."""
    rng = np.random.default_rng(5)
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    points = (rng.normal(size=(40, 3)) * [1.0, 1.0, thin]) @ axes.T + offset
    around = Hyperellipsoid.minimum_volume_circumscribed_ellipsoid(points)
    assert np.linalg.norm((points - around.center) @ around.A.T, axis=1).max() <= 1.0


@pytest.mark.parametrize("n", [2, 3, 5])
@pytest.mark.parametrize("thin", [1e-2, 1e-5])
@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6])
def test_no_point_is_outside_of_the_smallest_ellipsoid_in_fractions(n, thin, offset):
    """Rounding of products hides by how much thin clouds are left out; fractions don't round."""
    for seed in range(3):
        rng = np.random.default_rng((n, seed))
        axes, _ = np.linalg.qr(rng.normal(size=(n, n)))
        points = (rng.normal(size=(30, n)) * [*[1.0] * (n - 1), thin]) @ axes.T + offset
        around = Hyperellipsoid.minimum_volume_circumscribed_ellipsoid(points, 1e-7)
        form = [[Fraction(float(a)) for a in row] for row in around.A]
        for point in points:
            d = [
                Fraction(float(x)) - Fraction(float(c))
                for x, c in zip(point, around.center, strict=True)
            ]
            rows = (sum(a * x for a, x in zip(row, d, strict=True)) for row in form)
            assert sum(value * value for value in rows) <= 1


TOUCHING_ORIGIN = [
    HPolyhedron.make_unit_box(2),
    Hyperrectangle([0.0, 0.0], [1.0, 1.0]),
    VPolytope([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
    Hyperellipsoid.make_unit_ball(2),
    AffineBall(np.eye(2), [0.0, 0.0]),
    AffineSubspace([[1.0], [0.0]], [0.0, 0.0]),
    Point([0.0, 0.0]),
    ConvexHull([Point([0.0, 0.0])]),
    MinkowskiSum([Point([0.0, 0.0])]),
    CartesianProduct([Point([0.0]), Point([0.0])]),
    Intersection([Point([0.0, 0.0])]),
    Spectrahedron([np.eye(2), np.diag([1.0, 0.0]), np.diag([0.0, 1.0])]),
]


@pytest.mark.parametrize("asked", TOUCHING_ORIGIN, ids=lambda each: type(each).__name__)
@pytest.mark.parametrize("tol", [-1e-300, -1e-9, -np.inf, np.nan, "no", None, 1j])
def test_no_kind_takes_a_tolerance_below_zero(asked, tol):
    """It is refused by name and value, and is neither an inset nor an answer."""
    assert asked.point_in_set([0.0, 0.0], 0.0)
    with pytest.raises(ConvexSetError, match="tol must be"):
        asked.point_in_set([0.0, 0.0], tol)


def test_corners_that_rounding_takes_apart_are_one():
    """30 points and the same moved by 1e-14: as many corners as the 30 have."""
    rng = np.random.default_rng(6)
    points = rng.normal(size=(30, 3))
    double = np.concatenate([points, points + 1e-14 * rng.normal(size=points.shape)])
    alone, both = (VPolytope(each).get_minimal_representation() for each in (points, double))
    assert len(both.vertices) == len(alone.vertices)


@pytest.mark.parametrize("n", [3, 20])
def test_rows_that_come_twice_are_left_out_once(n):
    """Rows times a power of two, and looser ones of the same direction."""
    rng = np.random.default_rng(7)
    A, b = rng.normal(size=(3 * n, n)), np.ones(3 * n)
    single = HPolyhedron(A, b).reduce_inequalities(0.0)
    many = HPolyhedron(np.concatenate([A, 4.0 * A, A]), np.concatenate([b, 4.0 * b, b + 1.0]))
    reduced = many.reduce_inequalities(0.0)
    assert len(reduced.b) == len(single.b)
    if n == 3:
        _, shown = many.reduce_inequalities(0.0, certificate=True)
        assert shown.verify(many, 0.0)
        assert set(shown.removed) == many.find_redundant(0.0)

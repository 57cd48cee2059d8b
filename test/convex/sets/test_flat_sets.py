"""Sets with flat faces: closed forms, agreement between kinds, proofs, conventions and errors."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.convex.sets.conversions import _where_rows_meet
from scene_graph_ros.convex.solve.exact.rows import is_inside
from scene_graph_ros.geometry.optimization import (
    AffineSubspace,
    CartesianProduct,
    ConvexSetError,
    HPolyhedron,
    Hyperrectangle,
    Intersection,
    MinkowskiSum,
    Point,
    VPolytope,
)

seeds = st.integers(0, 2**32 - 1)
THIRD = 1.0 / 3.0


def simplex(n):
    """All x >= 0 that add up to at most 1."""
    return HPolyhedron(np.vstack([-np.eye(n), np.ones(n)]), np.append(np.zeros(n), 1.0))


def random_polytope(rng, n):
    """A box cut by planes, so that it is bounded and has the origin inside."""
    cuts = rng.normal(size=(2 * n, n))
    b = np.concatenate([np.ones(2 * n), 0.3 + rng.random(2 * n)])
    return HPolyhedron(np.vstack([np.eye(n), -np.eye(n), cuts]), b)


@pytest.mark.parametrize(
    "make",
    [HPolyhedron, AffineSubspace, Hyperrectangle, Point, lambda: VPolytope(np.zeros((2, 0)))],
)
def test_sets_without_dimensions_are_zero(make):
    """{0} has its point, is bounded, and holds the only point that there is."""
    zero = make()
    assert zero.ambient_dimension == 0
    assert not zero.is_empty()
    assert zero.is_bounded()
    assert zero.point_in_set([])
    assert zero.intersects_with(HPolyhedron())
    assert zero.maybe_get_point().shape == (0,)
    assert zero.maybe_get_feasible_point().shape == (0,)
    distances, points, _ = zero.projection(np.zeros((2, 0)))
    assert distances.tolist() == [0.0, 0.0]
    assert points.shape == (2, 0)
    with pytest.raises(ConvexSetError, match="0 dimensions"):
        zero.calc_volume()


@pytest.mark.parametrize("n", [0, 1, 3])
def test_no_vertices_are_no_points(n):
    """In any dimension, also none."""
    empty = VPolytope(np.zeros((0, n)))
    decision = empty.is_empty(certificate=True)
    assert decision.value
    assert decision.certificate.verify()
    assert empty.is_bounded(certificate=True).certificate.verify()
    assert not empty.point_in_set(np.zeros(n))
    assert empty.maybe_get_feasible_point() is None
    assert empty.projection(np.zeros((1, n))) is None
    assert not empty.intersects_with(HPolyhedron.make_unit_box(n))


@given(seeds)
@settings(deadline=None, derandomize=True, max_examples=25)
def test_kinds_agree_on_a_polytope(seed):
    """By faces and by vertices: the same points, distances, supports, and each in the other."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    by_faces = random_polytope(rng, n)
    by_vertices = VPolytope(by_faces)
    points = 1.5 * rng.normal(size=(20, n))
    one, other = by_faces.projection(points), by_vertices.projection(points)
    np.testing.assert_allclose(one.distances, other.distances, atol=1e-12)
    np.testing.assert_allclose(one.points, other.points, atol=1e-11)
    assert max(one.gaps.max(), other.gaps.max()) < 1e-12
    inside = by_faces.point_in_set(points)
    np.testing.assert_array_equal(inside, by_vertices.point_in_set(points))
    np.testing.assert_array_equal(inside, one.distances < 1e-8)
    for d in rng.normal(size=(4, n)):
        reach = by_faces.support(d)
        assert reach.value == pytest.approx(by_vertices.support(d).value, abs=1e-12)
        assert reach.gap < 1e-12
    again = HPolyhedron(by_vertices)
    assert all(is_inside(again.lift().rows, v) for v in by_vertices.vertices)
    assert again.contained_in(by_faces, 1e-11)
    assert by_faces.contained_in(again, 1e-11)
    assert by_faces.calc_volume() == pytest.approx(again.calc_volume(), rel=1e-11)


@given(seeds)
@settings(deadline=None, derandomize=True, max_examples=25)
def test_answers_have_proofs(seed):
    """Of every question, for sets of every flat kind and pairs of them."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    corner = rng.normal(size=n)
    sets = [
        random_polytope(rng, n),
        VPolytope(corner + rng.normal(size=(n + 2, n))),
        Hyperrectangle(corner, corner + rng.random(n)),
        Point(rng.normal(size=n)),
        AffineSubspace(rng.normal(size=(n, n - 1)), corner),
        HPolyhedron(rng.normal(size=(n + 1, n)), rng.normal(size=n + 1)),
    ]
    for one in sets:
        assert one.is_empty(certificate=True).certificate.verify()
        bounded = one.is_bounded(certificate=True)
        assert bounded.certificate.verify(one)
        for other in sets:
            meets = one.intersects_with(other, certificate=True)
            assert meets.certificate.kind == ("point" if meets.value else "farkas")
            assert meets.certificate.verify(one, other)
            assert meets.value == other.intersects_with(one)
        within = sets[0].contained_in(HPolyhedron.make_unit_box(n), certificate=True)
        assert within.certificate.verify()


def test_certificates_of_others_are_refused():
    """A certificate of one set shows nothing of another."""
    box = HPolyhedron.make_unit_box(2)
    far = HPolyhedron.make_box([5.0, 5.0], [6.0, 6.0])
    assert not box.is_empty(certificate=True).certificate.verify(far)
    apart = box.intersects_with(far, certificate=True)
    assert not apart.value
    assert not apart.certificate.verify(box, HPolyhedron.make_box([0.5, 0.5], [6.0, 6.0]))
    bounded = box.is_bounded(certificate=True).certificate
    assert not bounded.verify(HPolyhedron(box.A[[0, 1, 2, 2]], np.ones(4)))


@pytest.mark.parametrize("n", [1, 2, 3, 4])
@pytest.mark.parametrize("size", [1e-8, 1.0, 1e8])
def test_volumes(n, size):
    """A box, a simplex 1/n! and a cross-polytope 2^n/n!, to 1e-12; moved a million sizes away."""
    cross = HPolyhedron.make_l1_ball(n)
    box = HPolyhedron.make_box(np.full(n, -THIRD), np.full(n, 2 * THIRD))
    for unit, truth in (
        (box, 1.0),
        (simplex(n), 1 / math.factorial(n)),
        (cross, 2**n / math.factorial(n)),
    ):
        scaled = HPolyhedron(unit.A, size * unit.b)
        assert scaled.calc_volume() == pytest.approx(truth * size**n, rel=1e-12)
        assert VPolytope(scaled).calc_volume() == pytest.approx(truth * size**n, rel=1e-12)


def test_sets_made_of_points_are_points():
    """Products, sums and intersections; those of other sets, or of points apart, are none."""
    a, b, box = Point([1.0]), Point([2.0]), Hyperrectangle([0.0], [1.0])
    np.testing.assert_array_equal(CartesianProduct([a, b]).maybe_get_point(), [1.0, 2.0])
    np.testing.assert_array_equal(MinkowskiSum([a, b]).maybe_get_point(), [3.0])
    np.testing.assert_array_equal(Intersection([a, Point([1.0])]).maybe_get_point(), [1.0])
    assert Intersection([a, b]).maybe_get_point() is None
    for kind in (CartesianProduct, MinkowskiSum, Intersection):
        assert kind([a, box]).maybe_get_point() is None
    assert CartesianProduct([a, b], A=np.eye(2), b=np.zeros(2)).maybe_get_point() is None


def test_flat_sets_have_no_volume():
    """A square in space, an endless slab without thickness, a half plane."""
    square = VPolytope([[0, 0, 0], [1, 0, 1], [0, 1, 1], [1, 1, 2]])
    assert square.calc_volume() == 0.0
    assert HPolyhedron([[1.0, 0.0], [-1.0, 0.0]], [1.0, -1.0]).calc_volume() == 0.0
    assert HPolyhedron([[1.0, 0.0]], [1.0]).calc_volume() == np.inf
    with pytest.raises(ConvexSetError, match="use calc_volume_via_sampling"):
        HPolyhedron.make_unit_box(5).calc_volume()


def test_a_vertex_that_only_parallel_rows_are_near_to_stays_on_them():
    """Two rows are one, and what crosses them is out of reach: nothing is raised."""
    unit, sides = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([1.0, 1.0, 1.1])
    found = _where_rows_meet(unit, sides, np.array([[1.0 + 1e-12, 0.5]]), 1e-9)
    np.testing.assert_allclose(found, [[1.0, 0.5]], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_vertices_of_known_polytopes(n):
    """Cross-polytopes have 2 n, each where 2^(n-1) faces meet; boxes 2^n; simplices n + 1."""
    cross = VPolytope(HPolyhedron.make_l1_ball(n)).vertices
    expected = np.vstack([np.eye(n), -np.eye(n)])
    assert cross.shape == expected.shape
    assert np.abs(cross[:, None] - expected).max(axis=2).min(axis=1).max() < 1e-12
    assert VPolytope(HPolyhedron.make_unit_box(n)).vertices.shape == (2**n, n)
    assert VPolytope(simplex(n)).vertices.shape == (n + 1, n)
    assert len(HPolyhedron(VPolytope(cross)).b) == 2**n


def test_corners_in_the_plane_go_around():
    """Counter-clockwise from the one furthest along -x; the middle and repeated ones are gone."""
    points = [[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1], [0, 1], [0.5, 0.5], [0.1, 0.2]]
    corners = VPolytope(points).get_minimal_representation().vertices
    np.testing.assert_array_equal(corners, [[-1, 0], [0, -1], [1, 0], [0, 1]])


@pytest.mark.parametrize("k", [0, 1, 2, 3])
def test_affine_hulls(k):
    """Of hulls of k + 1 points, of the same by faces, in space, at three sizes."""
    rng = np.random.default_rng(k)
    for size in (1e-8, 1.0, 1e8):
        points = size * (rng.normal(size=(k + 1, 3)) + 5.0)
        for each in (VPolytope(points), HPolyhedron(VPolytope(points))):
            hull = AffineSubspace(each)
            assert hull.affine_dimension() == k
            assert hull.point_in_set(points, 1e-12 * size).all()
    assert AffineSubspace(HPolyhedron([[0.0, 1.0]], [1.0])).affine_dimension() == 2
    line = AffineSubspace(HPolyhedron([[0.0, 1.0], [0.0, -1.0]], [1.0, -1.0]))
    np.testing.assert_allclose(np.abs(line.basis), [[1.0], [0.0]])
    with pytest.raises(ConvexSetError, match="empty"):
        AffineSubspace(VPolytope(np.zeros((0, 3))))


def test_affine_subspace():
    """The plane x + y = 1, z free: coordinates there and back, distance 1/sqrt 2 of the origin."""
    plane = AffineSubspace([[1.0, 0.0], [-1.0, 0.0], [0.0, 2.0]], [1.0, 0.0, 0.0])
    assert plane.affine_dimension() == 2
    assert not plane.is_bounded()
    distances, nearest, _ = plane.projection([[0.0, 0.0, 3.0]])
    assert distances[0] == pytest.approx(math.sqrt(0.5))
    np.testing.assert_allclose(nearest, [[0.5, 0.5, 3.0]], atol=1e-15)
    np.testing.assert_allclose(plane.to_local_coordinates([0.0, 1.0, 4.0]), [-1.0, 2.0])
    np.testing.assert_allclose(plane.to_global_coordinates([-1.0, 2.0]), [0.0, 1.0, 4.0])
    same = AffineSubspace([[3.0, 3.0], [-3.0, -3.0], [1.0, 2.0]], [0.0, 1.0, 7.0])
    assert plane.is_nearly_equal_to(same)
    line = AffineSubspace([[0.0], [0.0], [1.0]], [0.5, 0.5, 0.0])
    assert line.contained_in(plane)
    assert not plane.contained_in(line)


def test_arithmetic_of_polyhedra():
    """Products, powers, scaling by volume, differences, intersections, by sides of boxes."""
    box = HPolyhedron.make_box([0.0, 0.0], [1.0, 3.0])
    assert box.cartesian_product(simplex(2)).calc_volume() == pytest.approx(1.5)
    assert HPolyhedron.make_box([0.0], [2.0]).cartesian_power(3).calc_volume() == pytest.approx(
        8.0
    )
    assert box.scale(0.25, [0.0, 0.0]).contained_in(HPolyhedron.make_box([0, 0], [0.5, 1.5]))
    assert box.scale(0.0, [0.5, 1.0]).calc_volume() == 0.0
    shrunk = box.pontryagin_difference(Hyperrectangle([-0.25, 0.0], [0.25, 1.0]))
    truth = HPolyhedron.make_box([0.25, 0.0], [0.75, 2.0])
    assert shrunk.contained_in(truth, 1e-15)
    assert truth.contained_in(shrunk, 1e-15)
    both = box.intersection(HPolyhedron.make_box([-1.0, -1.0], [0.5, 4.0]), True)
    assert len(both.b) == 5
    assert both.calc_volume() == pytest.approx(1.5)


def test_boxes():
    """Centre, corner cases, samples, and the box around a turned square."""
    box = Hyperrectangle([0.0, 1.0], [2.0, 5.0])
    np.testing.assert_array_equal(box.center(), [1.0, 3.0])
    assert box.calc_volume() == 8.0
    touching = box.maybe_get_intersection(Hyperrectangle([2.0, 5.0], [3.0, 6.0]))
    np.testing.assert_array_equal(touching.maybe_get_point(), [2.0, 5.0])
    assert box.maybe_get_intersection(Hyperrectangle([2.1, 0.0], [3.0, 6.0])) is None
    rng = np.random.default_rng(0)
    assert all(box.point_in_set(box.uniform_sample(rng), 0.0) for _ in range(20))
    around = Hyperrectangle.maybe_calc_axis_aligned_bounding_box(HPolyhedron.make_l1_ball(2))
    np.testing.assert_allclose([around.lb, around.ub], [[-1, -1], [1, 1]], atol=1e-15)
    endless = HPolyhedron([[1.0, 0.0]], [0.0])
    assert Hyperrectangle.maybe_calc_axis_aligned_bounding_box(endless) is None
    assert len(box.make_h_polyhedron().b) == 4


def test_samples_are_spread_evenly():
    """In a triangle, the mean is a third along each axis; four standard errors of 400 samples.

    The variance of a coordinate is 1/18; steps of 30 from sample to sample leave them independent
    enough.
    """
    rng, x, triangle = np.random.default_rng(5), None, simplex(2)
    samples = []
    for _ in range(400):
        x = triangle.uniform_sample(rng, x, 30)
        samples.append(x)
    assert triangle.point_in_set(np.array(samples), 1e-15).all()
    assert np.abs(np.mean(samples, axis=0) - THIRD).max() < 4.0 * math.sqrt(1 / 18 / 400)
    along = np.array([[1.0], [0.0]])
    assert triangle.uniform_sample(rng, [0.1, 0.2], subspace=along)[1] == 0.2
    with pytest.raises(ConvexSetError, match=r"previous_sample \[2.0, 2.0\] is outside"):
        triangle.uniform_sample(rng, [2.0, 2.0])
    with pytest.raises(ConvexSetError, match="unbounded"):
        HPolyhedron([[1.0, 0.0]], [1.0]).uniform_sample(rng, [0.0, 0.0])


def test_chebyshev_centers():
    """Of a 3-4-5 triangle the radius is 1 and the centre (1, 1); of a half plane there is none."""
    triangle = HPolyhedron([[-1.0, 0.0], [0.0, -1.0], [4.0, 3.0]], [0.0, 0.0, 12.0])
    np.testing.assert_allclose(triangle.chebyshev_center(), [1.0, 1.0], atol=1e-15)
    with pytest.raises(ConvexSetError, match="intersect the set with a box"):
        HPolyhedron([[1.0, 0.0]], [1.0]).chebyshev_center()
    with pytest.raises(ConvexSetError, match="empty"):
        HPolyhedron([[1.0], [-1.0]], [-1.0, -1.0]).chebyshev_center()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HPolyhedron([[1.0]], [np.nan]), "HPolyhedron: b must hold finite numbers .* nan"),
        (lambda: HPolyhedron([[1.0]], [np.inf]), "leave out rows that bound nothing"),
        (lambda: HPolyhedron([[1.0]], [1.0, 2.0]), r"b must have the shape \(1,\), not \(2,\)"),
        (lambda: HPolyhedron("rows", [1.0]), "A must be an array of numbers: 'rows'"),
        (lambda: Hyperrectangle([1.0], [0.0]), r"lb\[0\] = 1.0 must not be above ub\[0\] = 0.0"),
        (lambda: AffineSubspace([[1.0, 1.0]], [0.0]), "2 columns of basis must be linearly"),
        (lambda: VPolytope(HPolyhedron([[1.0]], [1.0])), "intersect it with a box first"),
        (lambda: HPolyhedron(VPolytope()), "empty VPolytope without dimensions"),
        (lambda: simplex(2).point_in_set([0.0]), r"point \(2,\) or points \(m, 2\)"),
        (lambda: simplex(2).intersects_with(simplex(3)), "has 3 dimensions, this set has 2"),
        (lambda: simplex(2).intersects_with(None), "other must be a ConvexSet, not None"),
        (lambda: simplex(2).scale(-1.0), "scale must be a finite number, at least 0, not -1.0"),
        (lambda: simplex(2).contained_in(simplex(2), np.nan), "tol must be a finite number"),
        (lambda: VPolytope(np.zeros((0, 2))).support([1.0, 0.0]), "the set is empty"),
        (lambda: simplex(2).projection([[0.0, np.nan]]), "projection: points must hold finite"),
    ],
)
def test_errors_name_argument_value_and_remedy(make, message):
    """What makes no set, and questions without an answer."""
    with pytest.raises(ConvexSetError, match=message):
        make()


def test_a_point_on_an_edge_to_rounding_ends_the_way_to_it():
    """The nearest point of a box of 16 corners, whose ways there are rounding; it went on."""
    low = [2.495321807742278e-06, -2.6246789371138185e-06, 1.701229041939728e-07]
    high = [2.6443504201607107e-06, -2.4756503246953858e-06, 3.1915151661240576e-07]
    box = VPolytope.make_box([*low, 1.8970829922617816e-06], [*high, 2.0461116046802144e-06])
    p = [2.4953218077944153e-06, -2.475650324747523e-06, 2.0890610257458187e-07]
    points = np.array([[*p, 1.934521324411663e-06]])
    found = box.projection(points)
    clipped = np.clip(points, box.vertices.min(axis=0), box.vertices.max(axis=0))
    assert np.abs(found.points - clipped).max() < 1e-20

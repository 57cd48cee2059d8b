"""Curved sets: closed forms, proofs, agreement with each other."""

import math

from hypothesis import example, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.convex.solve.exact.rows import is_inside
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
    VPolytope,
)

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


def test_what_sets_are_put_together_of():
    """Members come back in order; an empty one takes part only where nobody looked for it."""
    n = 2
    ball, flat, box, _ = members(n)
    nothing = VPolytope(np.zeros((0, n)))
    hull, all_of_them = ConvexHull([ball, nothing, box]), ConvexHull([ball, box], False)
    assert hull.sets() == (ball, nothing, box) and hull.participating_sets() == (ball, box)
    assert hull.empty_sets_removed() and not all_of_them.empty_sets_removed()
    assert hull.num_elements() == 3 and hull.element(1) is nothing
    together = MinkowskiSum([ball, flat, box])
    assert together.num_terms() == 3 and together.term(1) is flat


def test_a_ball_that_touches_a_face_of_a_box_reaches_as_far():
    """Along the face's normal the optimum is one point, which cuts near slowly."""
    rng = np.random.default_rng(17)
    n, scale = int(rng.integers(2, 6)), 10.0 ** rng.uniform(-6.0, 6.0)
    rng.choice(3)
    center = rng.normal(size=n) * scale * 1001.0
    size = scale * rng.uniform(0.01, 1.0)
    box = Hyperrectangle(center - size, center + 0.4 * size)
    both = Intersection(box, Hyperellipsoid.make_hypersphere(size, center))
    for e in np.eye(n):
        found = both.support(-e)
        truth = -(e @ center) + size
        assert found.value == pytest.approx(truth, abs=1e-9 * size)
        assert found.gap <= 1e-9 * size

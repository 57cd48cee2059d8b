"""Sums of many sets, and of curved ones in many dimensions, where the answers are constructed."""

import itertools

import numpy as np
import pytest

from scene_graph_ros.convex.solve.nearest.nearest_by_ascent import nearest_by_ascent
from scene_graph_ros.geometry.optimization import (
    AffineBall,
    CartesianProduct,
    ConvexHull,
    ConvexSetError,
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Hyperellipsoid,
    MinkowskiSum,
    Point,
    VPolytope,
)


def ellipsoid(rng, n):
    """Return one with semi-axes from 0.5 to 2 along axes of its own."""
    axes = np.linalg.qr(rng.normal(size=(n, n)))[0]
    return Hyperellipsoid(axes * rng.uniform(0.5, 2.0, n)[:, None], rng.normal(size=n))


@pytest.mark.parametrize(("n", "count"), [(20, 4), (10, 12), (3, 5)])
@pytest.mark.parametrize("away", [1e-6, 1e-2])
def test_sums_of_ellipsoids_near_their_surface(n, count, away):
    """From a point of the surface along its normal, that point is the nearest one."""
    rng = np.random.default_rng(n)
    whole = MinkowskiSum([ellipsoid(rng, n) for _ in range(count)])
    d = rng.normal(size=n)
    d /= np.linalg.norm(d)
    x = whole.support(d).point
    found = whole.projection((x + away * d)[None])
    assert found.distances[0] == pytest.approx(away, abs=1e-10)
    # A distance that is off by e leaves the point open by sqrt(2 e) times lengths of some metres.
    np.testing.assert_allclose(found.points[0], x, atol=1e-5)
    assert not whole.point_in_set(x + away * d, 0.5 * away)
    assert whole.point_in_set(x + away * d, 2.0 * away)


def test_the_best_plane_of_a_ball_is_found_from_any_direction():
    """Its distance is that of the centre less the radius; the bound is from below."""
    center, p = np.array([0.1, -0.2, 0.3, 0.4]), np.array([2.0, 1.0, -0.5, 0.7])

    def reach(u):
        return float(u @ center) + 0.5, center + 0.5 * u, 0.0

    u = np.array([-0.6, 0.0, 0.8, 0.0])
    distance, x, gap = nearest_by_ascent(reach, p, u, 1e-13)
    wanted = np.linalg.norm(p - center) - 0.5
    assert distance - gap - 1e-14 <= wanted <= distance + 1e-14
    assert distance == pytest.approx(wanted, abs=1e-12)
    np.testing.assert_allclose(x, center + 0.5 * (p - center) / (wanted + 0.5), atol=1e-6)


def test_many_segments_beside_a_box():
    """A zonotope's furthest corner along a direction has the signs of its generators there."""
    rng = np.random.default_rng(4)
    generators, starts = rng.normal(size=(2, 30, 3))
    whole = MinkowskiSum(
        [VPolytope(np.stack([s, s + g])) for s, g in zip(starts, generators, strict=True)]
    )
    d = np.array([1.0, -2.0, 0.5])
    corner = starts.sum(axis=0) + generators[generators @ d > 0.0].sum(axis=0)
    inside = HPolyhedron.make_box(corner - 0.01, corner + 1.0)
    beyond = d / np.linalg.norm(d) * 1.8 + corner
    assert whole.intersects_with(inside)
    # The box's corners are at most 1.74 from its centre.
    assert not whole.intersects_with(HPolyhedron.make_box(beyond - 1.0, beyond + 1.0))
    # Weights alone: two for each segment, beside the point.
    assert whole.lift().num_variables == 3 + 60
    assert len(whole.lift().f) == 3 + 30


def test_sums_in_sums_have_the_same_points():
    """Weights stand for points through all levels, also beside other kinds of sets."""
    corners = [np.array(c, dtype=float) for c in itertools.product((0, 1), repeat=2)]
    square = MinkowskiSum([VPolytope([[0, 0], [1, 0]]), VPolytope([[0, 0], [0, 1]])])
    whole = MinkowskiSum([square, Point([2.0, 3.0]), HPolyhedron.make_box([0, 0], [1, 1])])
    for c in corners:
        touching = HPolyhedron.make_box(c * 2 + [2, 3], c * 2 + [2, 3])
        assert whole.intersects_with(touching)
    assert not whole.intersects_with(HPolyhedron.make_box([4.0 + 1e-12, 3], [5, 4]))
    assert not MinkowskiSum([square, VPolytope(np.zeros((0, 2)))]).intersects_with(square)


def test_products_take_their_map_by_position():
    """As the reference's constructor: sets, A, b; two sets are sets as before."""
    sets, A, b = [Point([1.0]), HPolyhedron.make_box([0.0], [1.0])], 2.0 * np.eye(2), [0.5, 0.0]
    for made in (
        CartesianProduct(sets, A, b),
        CartesianProduct(sets, A, b=b),
        CartesianProduct(sets, A.tolist(), np.array(b)),
    ):
        np.testing.assert_array_equal(made.A, A)
        np.testing.assert_array_equal(made.b, b)
        assert made.point_in_set([0.25, 0.5])
    assert CartesianProduct(*sets).num_factors() == 2
    with pytest.raises(ConvexSetError, match="A is given twice"):
        CartesianProduct(sets, A, A=A)
    with pytest.raises(ConvexSetError, match="A and b belong together"):
        CartesianProduct(sets, "A")


def test_a_relaxation_without_paths_says_so():
    """Without rounding there is no path, so no success; the relaxation is there."""
    graph = GraphOfConvexSets()
    source, target = graph.add_vertex(Point([0.0])), graph.add_vertex(Point([1.0]))
    edge = graph.add_edge(source, target)
    edge.add_cost(3.0 + 0.0 * edge.xu[0])
    options = GraphOfConvexSetsOptions(convex_relaxation=True, max_rounded_paths=0)
    found = graph.solve_shortest_path(source, target, options)
    assert not found.is_success
    assert found.reason == "no path was drawn: the relaxation alone was solved"
    assert found.relaxation_cost == pytest.approx(3.0, abs=1e-6)


def test_volumes_of_products_are_products_of_volumes():
    """A disc of radius 2 and a rod of 3, turned and stretched by a map; a flat factor has none."""
    disc = Hyperellipsoid.make_hypersphere(2.0, [0.0, 1.0])
    rod = HPolyhedron.make_box([-1.0], [2.0])
    whole = CartesianProduct([disc, rod])
    assert whole.has_exact_volume
    assert whole.calc_volume() == pytest.approx(12.0 * np.pi, rel=1e-12)
    # y = A x + b: x has the volume of y by the determinant, -6.
    A = np.array([[0.0, 2.0, 0.0], [1.0, 0.0, 5.0], [0.0, 0.0, 3.0]])
    mapped = CartesianProduct([disc, rod], A, [1.0, 2.0, 3.0])
    assert mapped.calc_volume() == pytest.approx(2.0 * np.pi, rel=1e-12)
    assert CartesianProduct([disc, Point([1.0])]).calc_volume() == 0.0
    for other in (
        CartesianProduct([disc, ConvexHull([disc])]),
        CartesianProduct([disc, rod], np.eye(3)[:, :2], np.zeros(3)),
    ):
        assert not other.has_exact_volume
        with pytest.raises(ConvexSetError, match="use calc_volume_via_sampling"):
            other.calc_volume()


@pytest.mark.parametrize("n", [1, 2, 5])
def test_a_ball_about_a_segment_has_its_ends_for_tips(n):
    """And a radius of its own across; so its volume is that of these semi-axes."""
    rng = np.random.default_rng(n)
    first, second = rng.normal(size=(2, n))
    ball = AffineBall.make_affine_ball_from_line_segment(first, second, 0.25)
    half = 0.5 * (second - first)
    length = np.linalg.norm(half)
    np.testing.assert_allclose(ball.center, first + half)
    unit = AffineBall.make_unit_ball(n)
    assert ball.calc_volume() == pytest.approx(
        unit.calc_volume() * length * 0.25 ** (n - 1), rel=1e-12
    )
    d = half / length
    np.testing.assert_allclose(ball.support(d).point, second, atol=1e-12)
    np.testing.assert_allclose(ball.support(-d).point, first, atol=1e-12)
    across = np.linalg.svd(half[None])[2][1:]
    for e in across:
        reach = ball.support(e).value - float(e @ ball.center)
        assert reach == pytest.approx(0.25, rel=1e-12)
    with pytest.raises(ConvexSetError, match="x_1 and x_2 must differ"):
        AffineBall.make_affine_ball_from_line_segment(first, first)
    with pytest.raises(ConvexSetError, match="epsilon"):
        AffineBall.make_affine_ball_from_line_segment(first, second, -1.0)

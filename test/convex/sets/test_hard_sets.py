"""Sets that a search at random found hard: of no dimensions, unbounded, far away, without room."""

import numpy as np
import pytest

from scene_graph_ros.convex.solve.cutting import cutting
from scene_graph_ros.geometry.optimization import (
    AffineBall,
    AffineSubspace,
    CartesianProduct,
    compute_pairwise_intersections,
    ConvexHull,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    Intersection,
    iris,
    MinkowskiSum,
    Point,
    SampleError,
    Spectrahedron,
    VPolytope,
)


def test_sets_without_dimensions_meet():
    """The only point that there is belongs to all; the largest image of it is itself."""
    sets = [HPolyhedron(), Point(), Hyperrectangle(), VPolytope(np.zeros((1, 0)))]
    pairs, offsets = compute_pairwise_intersections(sets)
    assert sorted(pairs) == [(i, j) for i in range(4) for j in range(4) if i != j]
    assert all(offset.shape == (0,) for offset in offsets)
    image = HPolyhedron().maximum_volume_inscribed_affine_transformation(HPolyhedron())
    assert image.ambient_dimension == 0 and not image.is_empty()


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_rows_without_variables_take_no_part():
    """Beside a box, ``0 . x <= 0`` changes neither samples nor the largest image."""
    box = HPolyhedron.make_unit_box(2)
    more = HPolyhedron(np.append(box.A, np.zeros((1, 2)), axis=0), np.append(box.b, 0.0))
    for asked in (box, more):
        drawn = asked.uniform_samples(np.random.default_rng(3), 400)
        assert np.abs(drawn.points).max() <= 1.0
        assert drawn.effective_sample_size > 10.0
    image = more.maximum_volume_inscribed_affine_transformation(more)
    assert image.calc_volume() == pytest.approx(4.0, rel=1e-5)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_distances_from_unbounded_sets(size):
    """A plane in 8 dimensions through a map, a line as a hull, a ball's cylinder, a half-space."""
    rng = np.random.default_rng(5)
    normal = rng.normal(size=8)
    normal /= np.linalg.norm(normal)
    basis = np.linalg.svd(normal[None])[2][1:].T
    turn = np.linalg.qr(rng.normal(size=(8, 8)))[0]
    plane = CartesianProduct([AffineSubspace(basis, 2.0 * size * normal)], A=turn, b=np.zeros(8))
    p = size * rng.normal(size=8)
    found = plane.projection(p[None])
    truth = abs(normal @ turn @ p - 2.0 * size)
    assert found.distances[0] == pytest.approx(truth, rel=1e-10)

    line = ConvexHull([AffineSubspace([[3.0], [4.0]], [0.0, 5.0 * size])])
    on_line = size * np.array([3.0, 9.0])
    found = line.projection([on_line, [0.0, 0.0]])
    np.testing.assert_allclose(found.distances, [0.0, 3.0 * size], atol=1e-12 * size)
    assert line.point_in_set(on_line, 1e-12 * size)

    pipe = MinkowskiSum(
        [
            Hyperellipsoid.make_hypersphere(size, np.zeros(3)),
            AffineSubspace([[0.0], [0.0], [1.0]], np.zeros(3)),
        ]
    )
    found = pipe.projection(size * np.array([[3.0, 4.0, 7.0], [0.1, 0.2, 50.0]]))
    np.testing.assert_allclose(found.distances, [4.0 * size, 0.0], rtol=1e-9)

    # A matrix [[x, y], [y, z]] is semidefinite nowhere nearer to -1 than at 0.
    matrices = Spectrahedron(
        [np.zeros((2, 2)), [[1, 0], [0, 0]], [[0, 1], [1, 0]], [[0, 0], [0, 1]]]
    )
    found = matrices.projection(size * np.array([[-1.0, 0.0, -1.0]]))
    assert found.distances[0] == pytest.approx(np.sqrt(2.0) * size, rel=1e-7)


@pytest.mark.parametrize("size", [1e-300, 1e-200, 1e-170])
def test_balls_whose_squares_underflow(size):
    """Cuts of a ball at points whose squares are 0 have a direction."""
    cone = cutting.Cut
    ball = AffineBall(np.eye(2), np.zeros(2)).lift().cones[0]
    x = np.zeros(int(ball.columns.max()) + 1)
    x[ball.columns] = size * np.array([3.0, 4.0])
    (cut,) = cutting.tangent_cuts([ball], x)
    assert isinstance(cut, cone)
    np.testing.assert_allclose(cut.u, [0.6, 0.8], rtol=1e-12)


def test_hulls_without_room_between_their_rows_are_asked_exactly_only_a_few_times(monkeypatch):
    """Far from the origin in 5 dimensions each exact answer took a second, one for each cut."""
    rng = np.random.default_rng(25)
    far = 1e6 * rng.normal(size=5)
    first = ConvexHull(
        [
            AffineBall(rng.normal(size=(5, 5)), far),
            VPolytope(far + rng.normal(size=(10, 5))),
            Hyperrectangle(far, far + rng.random(5)),
        ]
    )
    ellipsoid = Hyperellipsoid(rng.normal(size=(5, 5)), far + rng.normal(size=5))
    second = ConvexHull([ellipsoid, Point(far + 3.0 * rng.normal(size=5))])
    asked = []
    find_point = cutting.find_point
    monkeypatch.setattr(cutting, "find_point", lambda rows: asked.append(rows) or find_point(rows))
    decision = first.intersects_with(second, certificate=True)
    assert len(asked) <= 8
    # Of radii of about 1, at coordinates of 1e6: some 1e-14 of these.
    certificate = decision.certificate
    assert certificate.gap < 1e-8 if certificate.kind == "undecided" else certificate.verify()


def test_a_direction_from_no_known_point_proves_nothing():
    """Two pipes that touch along a line, to rounding: if they do, it goes on for ever."""
    round_ = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    beside = [np.sqrt(2.0), np.sqrt(2.0), 0.0]
    both = Intersection(Hyperellipsoid(round_, np.zeros(3)), Hyperellipsoid(round_, beside))
    assert both.is_empty(certificate=True).certificate.kind == "undecided"
    is_bounded, certificate = both.is_bounded(certificate=True)
    assert not is_bounded
    assert certificate.kind == "undecided"
    assert not certificate.verify()


def test_what_is_bounded_reaches_nowhere_without_an_end():
    """Semidefinite matrices within a ball: the solver's point came without the box around it."""
    matrices = Spectrahedron(
        [np.zeros((2, 2)), [[1, 0], [0, 0]], [[0, 1], [1, 0]], [[0, 0], [0, 1]]]
    )
    both = Intersection(matrices, Hyperellipsoid.make_hypersphere(0.5, [2.0, 0.0, 2.0]))
    assert both.is_bounded()
    for k, high in enumerate((2.5, 0.5, 2.5)):
        reached = both.support(np.eye(3)[k])
        assert reached.value == pytest.approx(high, rel=1e-8)
    box = Hyperrectangle.maybe_calc_axis_aligned_bounding_box(both)
    np.testing.assert_allclose(box.lb, [1.5, -0.5, 1.5], rtol=1e-8)


def test_directions_are_of_the_size_of_1():
    """Their exact entries are determinants, which outgrow floats; only their way counts."""
    rng = np.random.default_rng(4)
    F = rng.normal(size=(5, 3, 3))
    whole = ConvexHull(
        [
            Point(1e3 * rng.normal(size=4)),
            AffineSubspace(rng.normal(size=(4, 4)), 1e3 * rng.normal(size=4)),
        ]
    )
    everything = MinkowskiSum([Spectrahedron(1e3 * (F + F.transpose(0, 2, 1))), whole])
    is_bounded, certificate = everything.is_bounded(certificate=True)
    assert not is_bounded
    assert certificate.verify()
    assert 0.25 < np.abs(certificate.vector).max() < 4.0
    # As an obstacle it is cut by the domain's box, and holds every sample.
    with pytest.raises(SampleError, match=r"is in or at obstacles\[0\] \(MinkowskiSum\)"):
        iris([everything], np.zeros(4), HPolyhedron.make_box(np.full(4, -1e4), np.full(4, 1e4)))

"""Sets with flat faces where answers hang on the last digit, at all sizes, far away, turned.

Every truth is constructed or found in fractions.
"""

from fractions import Fraction

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    AffineSubspace,
    HPolyhedron,
    Hyperrectangle,
    Point,
    VPolytope,
)

SIZES = [1e-8, 1e-3, 1.0, 1e3, 1e8]
GAPS = [10.0**-k for k in range(3, 15)]
seeds = st.integers(0, 2**32 - 1)


def decided(decision):
    """Return an answer whose certificate holds."""
    assert decision.certificate.verify()
    return decision.value


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("gap", [*GAPS, 0.0])
def test_boxes_with_a_gap_between(size, gap):
    """Of both signs, down to 1e-14 of the size, or touching: by faces, corners and bounds."""
    for sign in (-1.0, 1.0):
        left = size * np.array([[-1.0, -1.0, -1.0], [0.0, 1.0, 1.0]])
        right = size * np.array([[sign * gap, -0.5, -0.5], [1.0, 0.5, 0.5]])
        meets = right[0, 0] <= left[1, 0]
        kinds = (HPolyhedron.make_box, VPolytope.make_box, Hyperrectangle)
        for one, other in ((kinds[0], kinds[0]), (kinds[1], kinds[2]), (kinds[1], kinds[0])):
            asked = one(*left).intersects_with(other(*right), certificate=True)
            assert decided(asked) == meets


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("feature", [1, 2, 3])
def test_touching_at_a_face_an_edge_a_corner(size, feature):
    """Boxes that share a corner's coordinates do; by one unit in the last place further, not."""
    at = 0.1 * size  # no power of two
    far = np.where(np.arange(3) < feature, at, 0.0)
    one = HPolyhedron.make_box(np.full(3, -at), np.full(3, at))
    touching = HPolyhedron.make_box(far, far + at)
    assert decided(one.intersects_with(touching, certificate=True))
    apart = far + np.where(np.arange(3) == 0, np.spacing(at), 0.0)
    other = HPolyhedron.make_box(apart, apart + at)
    assert not decided(one.intersects_with(other, certificate=True))


@given(seeds)
@settings(deadline=None, derandomize=True, max_examples=60)
def test_a_corner_on_an_oblique_plane(seed):
    """Whether a . v <= b for floats a, v and b within rounding of equality: fractions know."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    a, v = rng.normal(size=n), rng.normal(size=n) * 10.0 ** rng.integers(-8, 9)
    b = float(a @ v) * (1.0 + int(rng.integers(-2, 3)) * 2.0**-52)
    truth = sum(Fraction(x) * Fraction(y) for x, y in zip(a, v, strict=True)) <= Fraction(b)
    half = HPolyhedron(a[None] * 2.0**20, [b * 2.0**20])
    assert decided(half.intersects_with(Point(v), certificate=True)) == truth
    assert decided(half.intersects_with(VPolytope(v[None]), certificate=True)) == truth


def rows_of_a_body(seed):
    """Return a bounded body's rows and sides, whole numbers over 16, and its dimension."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    A = np.concatenate([np.eye(n), -np.eye(n), rng.integers(-8, 9, size=(6, n)) / 16.0])
    b = np.concatenate([np.ones(2 * n), rng.integers(-8, 17, size=6) / 16.0])
    return A, b, rng


@given(seeds)
@settings(deadline=None, derandomize=True, max_examples=60)
def test_what_changes_no_set_changes_no_answer(seed):
    """Rows scaled by 2^+-33, repeated and permuted, sets scaled by 2^+-27, moved by 2^20.

    Powers of two, and coordinates that are sixteenths, keep the sets exactly what they were.
    """
    A, b, rng = rows_of_a_body(seed)
    n = A.shape[1]
    chosen = np.concatenate([rng.permutation(len(b)), rng.integers(0, len(b), size=10)])
    factors = 2.0 ** rng.integers(-33, 34, size=len(chosen))
    size = 2.0 ** int(rng.integers(-27, 28))
    shift = rng.integers(-(2**20), 2**20, size=n) * 1.0
    moved = size * (b + A @ shift)
    other = HPolyhedron(A[chosen] * factors[:, None], moved[chosen] * factors)
    body = HPolyhedron(A, b)
    assert decided(body.is_empty(certificate=True)) == decided(other.is_empty(certificate=True))
    assert decided(body.is_bounded(certificate=True))
    assert decided(other.is_bounded(certificate=True))
    if not body.is_empty():
        plain = HPolyhedron(A, moved)
        assert decided(other.contained_in(plain, 0.0, certificate=True))
        assert decided(plain.contained_in(other, 0.0, certificate=True))
        one = len(body.reduce_inequalities(0.0).b)
        unrepeated = HPolyhedron(other.A[: len(b)], other.b[: len(b)])
        if AffineSubspace(body).affine_dimension() == n:  # else rows may stand for each other
            assert len(unrepeated.reduce_inequalities(0.0).b) == one
            assert len(other.reduce_inequalities(0.0).b) == one


@pytest.mark.parametrize("scale", [1e-8, 1e-6, 1.0, 1e6, 1e8])
def test_rows_of_different_lengths(scale):
    """A box with some rows longer: six faces, bounded, eight corners, volume 8."""
    box = HPolyhedron.make_unit_box(3)
    factors = np.array([scale, 1.0, 1.0 / scale, 1.0, scale, 1.0])
    odd = HPolyhedron(box.A * factors[:, None], box.b * factors)
    assert len(odd.reduce_inequalities().b) == 6
    assert decided(odd.is_bounded(certificate=True))
    assert len(VPolytope(odd).vertices) == 8
    assert odd.calc_volume() == pytest.approx(8.0, rel=1e-12)
    assert not odd.point_in_set([1.0 + 1e-6, 0.0, 0.0])
    distances, points, gaps = odd.projection([[2.0, 2.0, 0.5]])
    assert distances[0] == pytest.approx(np.sqrt(2.0), abs=1e-15)
    np.testing.assert_allclose(points[0], [1.0, 1.0, 0.5], atol=1e-15)
    assert gaps[0] < 1e-15


@pytest.mark.parametrize("width", [1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 0.0])
def test_slabs(width):
    """A square of any thickness, turned: bounded, not empty, its affine hull flat below 1e-12."""
    turned = np.array([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    A = np.concatenate([turned, -turned])
    slab = HPolyhedron(A, [1.0, 1.0, width, 1.0, 1.0, 0.0])
    assert not decided(slab.is_empty(certificate=True))
    assert decided(slab.is_bounded(certificate=True))
    assert AffineSubspace(slab).affine_dimension() == (3 if width > 1e-11 else 2)
    corners = VPolytope(slab).vertices
    assert len(corners) == (8 if width > 1e-11 else 4)
    assert (A @ corners.T - slab.b[:, None]).max() < 1e-12


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-9, 1e-12])
def test_cones_and_far_bounds(angle):
    """A cone is unbounded at any angle; closed 1e9 away it is bounded, at that distance."""
    cone = HPolyhedron([[-angle, 1.0], [-angle, -1.0]], [0.0, 0.0])
    assert not decided(cone.is_bounded(certificate=True))
    closed = HPolyhedron(np.vstack([cone.A, [[1.0, 0.0]]]), [0.0, 0.0, 1e9])
    assert decided(closed.is_bounded(certificate=True))
    assert closed.support([1.0, 0.0]).value == 1e9
    assert closed.support([0.0, 1.0]).value == pytest.approx(1e9 * angle, rel=1e-12)


@pytest.mark.parametrize("n", [1, 2, 3, 7, 14])
def test_lines_and_rays(n):
    """Half-spaces of every number: a ray until the last one, a simplex with it."""
    rows = np.vstack([-np.eye(n), np.ones(n)])
    for count in range(1, n + 2):
        each = HPolyhedron(rows[:count], np.append(np.zeros(n), 1.0)[:count])
        assert decided(each.is_bounded(certificate=True)) == (count == n + 1)
        assert not decided(each.is_empty(certificate=True))


@pytest.mark.parametrize("n", [2, 3, 5])
def test_fifty_copies_of_each_row(n):
    """Of a box: the reduced set has its 2 n faces."""
    box = HPolyhedron.make_unit_box(n)
    copies = HPolyhedron(np.tile(box.A, (50 // n, 1)), np.tile(box.b, 50 // n))
    assert len(copies.reduce_inequalities(0.0).b) == 2 * n


@pytest.mark.parametrize("tilt", [1e-4, 1e-8, 1e-12, 1e-15])
def test_nearly_parallel_rows(tilt):
    """Two rows through (1, 0) beside x <= 1, of which neither follows from the other two.

    With ``x + t y <= 1`` and ``x - t y <= 1`` the row ``x <= 1`` is half their sum.
    """
    A = np.array([[1.0, tilt], [1.0, -tilt], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    body = HPolyhedron(A, np.ones(6))
    assert body.find_redundant(0.0) == {2}


@pytest.mark.parametrize("size", SIZES)
def test_projection_of_far_and_thin_sets(size):
    """On a needle of 1 x 1e-9 at a million sizes from the origin, of points beside and behind."""
    at = 2.0**20 * size
    lb, ub = np.array([at, at]), np.array([at + size, at + np.spacing(at) * 4])
    needle = HPolyhedron.make_box(lb, ub)
    points = np.array([[at + 0.5 * size, at + size], [at - size, at - size]])
    truth = np.clip(points, lb, ub)
    for each in (needle, VPolytope.make_box(lb, ub)):
        found = each.projection(points)
        np.testing.assert_allclose(found.points, truth, rtol=1e-15)
        assert found.gaps.max() <= 4.0 * np.spacing(at)


@given(seeds)
@settings(deadline=None, derandomize=True, max_examples=30)
def test_corners_come_back_from_faces(seed):
    """Of points on a grid of quarters, many of which share faces: as many as qhull finds corners.

    Also a thousand sizes from the origin, where right sides of faces are rounded.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 5))
    points = np.round(4.0 * rng.normal(size=(int(rng.integers(n + 1, 14)), n))) / 4.0
    for shift in (0.0, 1000.0):
        polytope = VPolytope(points + shift)
        if AffineSubspace(polytope).affine_dimension() < n:
            continue
        again = VPolytope(HPolyhedron(polytope)).vertices
        corners = polytope.get_minimal_representation().vertices
        assert len(again) == len(corners)
        assert np.abs(again[:, None] - corners).max(axis=2).min(axis=1).max() < 1e-9

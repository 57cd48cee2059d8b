"""Sets of many members that meet or not, told by floats alone where that is beyond rounding."""

import numpy as np
import pytest

from scene_graph_ros.convex.questions import decisions
from scene_graph_ros.convex.questions.surrounding import _regular_simplex, surround
from scene_graph_ros.convex.sets import convex_set
from scene_graph_ros.geometry.optimization import (
    AffineBall,
    ConvexHull,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    MinkowskiSum,
    Point,
    VPolytope,
)


def polyhedron(rng, x):
    """Return one about a point whose rows touch a ball of radius 0.3."""
    n = len(x)
    rows = np.concatenate([np.eye(n), -np.eye(n), rng.normal(size=(2 * n, n))])
    return HPolyhedron(rows, rows @ x + 0.3 * np.linalg.norm(rows, axis=1))


KINDS = {
    "boxes": lambda rng, x: Hyperrectangle(x - rng.uniform(0.1, 1, 3), x + rng.uniform(0.1, 1, 3)),
    "balls": lambda rng, x: Hyperellipsoid.make_hypersphere(rng.uniform(0.1, 1), x),
    "images of balls": lambda rng, x: AffineBall(0.3 * rng.normal(size=(3, 3)), x),
    "segments": lambda rng, x: VPolytope(x + rng.normal(size=(2, 3))),
    "polyhedra": polyhedron,
}


@pytest.fixture
def no_fractions(monkeypatch):
    """Let nothing be decided in fractions."""

    def refuse(sets, question):
        raise AssertionError(f"{question} was decided in fractions")

    for module in (convex_set, decisions):
        monkeypatch.setattr(module, "is_empty", refuse)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("of", [ConvexHull, MinkowskiSum])
def test_sixty_members_meet_a_copy_that_is_moved_into_them(of, kind, no_fractions):
    """A copy whose lowest point is put 1e-4 below the highest one, or above it."""
    rng = np.random.default_rng(len(kind))
    members = [KINDS[kind](rng, place) for place in rng.normal(size=(60, 3)) * 2.0]
    whole = of(members)
    d = np.array([2.0, -1.0, 2.0]) / 3.0
    high, low = whole.support(d), whole.support(-d)
    for away in (1e-4, 1.0):
        for sign, meets in ((-1.0, True), (1.0, False)):
            moved = high.point - low.point + sign * away * d
            assert whole.intersects_with(MinkowskiSum(whole, Point(moved))) is meets


@pytest.mark.parametrize("n", [1, 2, 5])
def test_the_simplex_holds_its_ball(n):
    """Of a regular simplex about 0 the nearest facet is as far as a corner, divided by n."""
    corners = _regular_simplex(n)
    np.testing.assert_allclose(np.linalg.norm(corners, axis=1), 1.0, atol=1e-15)
    np.testing.assert_allclose(corners.sum(axis=0), 0.0, atol=1e-14)
    products = corners @ corners.T
    np.testing.assert_allclose(products - np.eye(n + 1) * (1.0 + 1.0 / n), -1.0 / n, atol=1e-14)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_what_is_within_rounding_is_left_open(side):
    """Two boxes one ulp apart, and one ulp over each other: neither is shown by differences."""
    low = Hyperrectangle([0.0, 0.0], [1.0, 1.0])
    high = Hyperrectangle([1.0 + side * 2.0**-52, 0.0], [2.0, 1.0])
    assert not surround(low, high)
    assert ConvexHull([low]).intersects_with(high) is (side < 0.0)


def test_thin_and_flat_sets():
    """A needle's thickness of 1e-9 is as good as another; sets in one plane are left open."""
    rng = np.random.default_rng(1)
    thin = VPolytope(rng.normal(size=(50, 3)) * [1.0, 1.0, 1e-9])
    assert surround(thin, VPolytope(rng.normal(size=(50, 3)) * [1.0, 1.0, 1e-9]))
    flat = VPolytope(rng.normal(size=(50, 3)) * [1.0, 1.0, 0.0])
    assert not surround(flat, flat)
    assert flat.intersects_with(flat)


def test_forms_that_hold_nothing_surely_are_left_out():
    """Of a form with a condition of 1e9 no point of the surface is known to be inside."""
    thin = Hyperellipsoid(np.diag([1.0, 1e9]), [0.0, 0.0])
    assert thin.drawn_in is None
    assert not surround(thin, thin)
    assert ConvexHull([thin]).intersects_with(thin)
    assert Hyperellipsoid(np.zeros((1, 2)), [0.0, 0.0]).drawn_in is None


@pytest.mark.parametrize("kind", [ConvexHull, MinkowskiSum])
@pytest.mark.parametrize("n", [3, 6])
def test_curved_sets_that_overlap_by_little_have_an_answer(kind, n):
    """By 1.8e-9 of some metres, as much apart, and touching to rounding."""
    rng = np.random.default_rng(n)
    forms = [rng.normal(size=(n, n)) + 2.0 * np.eye(n) for _ in range(6)]
    centers = rng.normal(size=(6, n))
    balls = [Hyperellipsoid(A, c) for A, c in zip(forms, centers, strict=True)]
    one, d = kind(balls[:3]), np.eye(n)[0]
    shift = one.support(d).point - kind(balls[3:]).support(-d).point
    moved = range(3, 6 if kind is ConvexHull else 4)
    for overlap, meets in ((1.8e-9, True), (0.0, True), (-1.8e-9, False)):
        away = shift - overlap * d
        others = [
            Hyperellipsoid(forms[k], centers[k] + away if k in moved else centers[k])
            for k in range(3, 6)
        ]
        assert one.intersects_with(kind(others)) is meets

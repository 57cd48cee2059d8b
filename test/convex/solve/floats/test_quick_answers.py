"""What floats prove without a certificate is what fractions prove with one; and most is proven."""

from exact_checks import exact_vertices, largest_of
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.convex.questions.arguments import frozen  # as sets keep their rows
from scene_graph_ros.convex.questions.quick_answers import (
    center_of_rows,
    extents_of_rows,
    is_contained,
    is_row_bounded,
    meet,
    point_of_rows,
    redundant,
    rows_that_follow,
    support_of_rows,
)
from scene_graph_ros.convex.questions.redundancy import reduce_rows
from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperrectangle

seeds = st.integers(0, 2**32 - 1)


def rows_on_a_grid(rng, n):
    """Return rows of small whole numbers: many meet in one point, some follow, some contradict."""
    count = int(rng.integers(n + 1, 4 * n + 6))
    A = rng.integers(-2, 3, size=(count, n)).astype(float)
    A[~A.any(axis=1), 0] = 1.0
    b = rng.integers(-1, 5, size=count).astype(float)
    if rng.random() < 0.7:
        A, b = np.concatenate([A, np.eye(n), -np.eye(n)]), np.append(b, np.full(2 * n, 3.0))
    return A, b


@given(seeds)
@settings(deadline=None, derandomize=True, max_examples=120)
def test_floats_say_what_fractions_say(seed):
    """Of bodies where much is degenerate, with rows of any length, of any size and far away."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    size, shift = 2.0 ** int(rng.integers(-20, 21)), rng.integers(-1000, 1000, size=n)
    bodies = []
    for _ in range(2):
        A, b = rows_on_a_grid(rng, n)
        lengths = 2.0 ** rng.integers(-20, 21, size=len(b))
        bodies.append(HPolyhedron(A * lengths[:, None], size * (b + A @ shift) * lengths))
    one, other = bodies
    for body in bodies:
        empty, _ = point_of_rows(body.A, body.b)
        assert empty in (None, body.is_empty(certificate=True).value)
        assert is_row_bounded(body.A) in (None, body.is_bounded(certificate=True).value)
    assert meet(one, other) in (None, one.intersects_with(other, certificate=True).value)
    for tol in (0.0, 1e-9 * size, 0.25 * size, -0.25 * size):
        truth = one.contained_in(other, tol, certificate=True).value
        assert is_contained(one, other, tol) in (None, truth)
        found = rows_that_follow(one, other, tol)
        if not one.is_empty():
            for i in np.flatnonzero(found):
                alone = HPolyhedron(other.A[[i]], other.b[[i]])
                assert one.contained_in(alone, tol, certificate=True).value == (found[i] == 1)
    left_out = redundant(one.A, one.b, 1e-9 * size)
    if left_out is not None:
        assert set(np.flatnonzero(left_out)) == set(reduce_rows(one, 1e-9 * size).removed)


def generic(rng, n, m, shift=0.0):
    """Return a box and planes around it, some of which follow."""
    A = np.concatenate([np.eye(n), -np.eye(n), rng.normal(size=(m - 2 * n, n))])
    A /= np.linalg.norm(A, axis=1)[:, None]
    b = np.concatenate([np.ones(2 * n), 0.5 + 0.7 * rng.random(m - 2 * n)])
    return HPolyhedron(A, b + A @ np.full(n, shift))


@pytest.mark.parametrize(("n", "m"), [(2, 24), (3, 36), (7, 64)])
def test_floats_leave_little_open(n, m):
    """Of ten bodies in general position nothing, touching ones aside."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        body, near, far = generic(rng, n, m), generic(rng, n, m, 0.4), generic(rng, n, m, 4.0)
        assert point_of_rows(body.A, body.b)[0] is False
        assert is_row_bounded(body.A) is True
        assert meet(body, near) is True
        assert meet(body, far) is False
        assert is_contained(body, near, 1e-9) is False
        assert is_contained(body, body, 1e-9) is True
        assert redundant(body.A, body.b, 1e-9) is not None
        assert rows_that_follow(body, far, 1e-9).all()


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("power", range(3, 16))
def test_gaps_of_any_size(n, power):
    """A simplex cut by a plane that passes its corner on either side, or through it."""
    rows, sides = np.vstack([-np.eye(n), np.ones(n)]), np.append(np.zeros(n), 1.0)
    for gap in (10.0**-power, -(10.0**-power), 0.0):
        cut = HPolyhedron(np.vstack([rows, -np.eye(n)[0]]), np.append(sides, -(1.0 + gap)))
        assert cut.is_empty() == (1.0 + gap > 1.0)
        simplex = HPolyhedron(rows, sides)
        wall = HPolyhedron(np.eye(n)[:1], [1.0 + gap])
        assert simplex.contained_in(wall, 0.0) == (1.0 + gap >= 1.0)
        walled = HPolyhedron(np.vstack([rows, np.eye(n)[:1]]), np.append(sides, 1.0 + gap))
        assert walled.find_redundant(0.0) == (set() if 1.0 + gap < 1.0 else {n + 1})


def test_boxes_are_compared_as_they_are():
    """Flat, touching by a face and apart by one unit in the last place, in both kinds."""
    box = Hyperrectangle([0.0, 0.0], [0.1, 0.0])
    for x, meets in ((0.1, True), (np.nextafter(0.1, 1.0), False)):
        other = HPolyhedron.make_box([x, 0.0], [1.0, 1.0])
        assert meet(box, other) is meets
        assert other.intersects_with(box) is meets
    assert not HPolyhedron.make_box([0.0], [0.0]).is_empty()
    assert HPolyhedron.make_box([1.0], [0.0]).is_empty()


def test_rows_without_length_and_of_extreme_ones():
    """Are left open, and decided in fractions."""
    for rows, sides, empty in (
        ([[0.0]], [-1.0], True),
        ([[0.0]], [0.0], False),
        ([[1e-149], [-1e-149]], [-1.0, -1.0], True),
        ([[1e149, 1e-149], [-1.0, 0.0]], [-1.0, 0.0], False),
    ):
        body = HPolyhedron(rows, sides)
        assert point_of_rows(body.A, body.b)[0] is None
        assert body.is_empty() is empty
        assert body.is_empty(certificate=True).certificate.verify()


@given(seeds)
@settings(deadline=None, derandomize=True, max_examples=60)
def test_boxes_and_supports_of_polytopes(seed):
    """Of all corners in fractions: boxes hold them, gaps bound what supports are too small by."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    size, shift = 2.0 ** int(rng.integers(-20, 21)), rng.integers(-100, 100, size=n)
    A, b = (each[: 2 * n] for each in rows_on_a_grid(rng, n))
    A = np.concatenate([A, np.eye(n), -np.eye(n)])
    b = size * (np.append(b, np.full(2 * n, 3.0)) + A @ shift)
    lengths = 2.0 ** rng.integers(-20, 21, size=len(b))
    A, b = frozen(A * lengths[:, None]), frozen(b * lengths)
    empty, start = point_of_rows(A, b)
    found, corners = extents_of_rows(A, b), exact_vertices(A, b)
    if found is not None:
        for k in range(n):
            high, low = largest_of(corners, np.eye(n)[k]), -largest_of(corners, -np.eye(n)[k])
            assert found[0][k] <= low and high <= found[1][k]
            assert found[0][k] == pytest.approx(float(low), abs=1e-12 * size)
            assert found[1][k] == pytest.approx(float(high), abs=1e-12 * size)
    d = frozen(rng.normal(size=n))
    reached = None if empty is not False else support_of_rows(A, b, start, d)
    if reached is not None:
        truth = float(largest_of(corners, d))
        assert reached.value == pytest.approx(truth, abs=1e-12 * size)
        assert truth <= reached.value + reached.gap + 1e-13 * size
        assert reached.gap < 1e-12 * size


@pytest.mark.parametrize(("n", "m"), [(2, 24), (3, 36), (7, 64)])
def test_floats_find_boxes_and_supports(n, m):
    """Of bodies in general position, unless they have no end."""
    for seed in range(10):
        body = generic(np.random.default_rng(seed), n, m)
        start = point_of_rows(body.A, body.b)[1]
        assert extents_of_rows(body.A, body.b) is not None
        assert support_of_rows(body.A, body.b, start, frozen(np.ones(n))) is not None
        half = frozen(body.A[:n]), frozen(body.b[:n])
        assert extents_of_rows(*half) is None
        assert support_of_rows(*half, start, frozen(-np.ones(n))) is None


@pytest.mark.parametrize("n", [1, 2, 3, 7])
@pytest.mark.parametrize("size", [1e-9, 1.0, 1e7])
def test_the_largest_ball_is_the_one_that_was_put_in(n, size):
    """Rows that touch a ball on all sides of it, others beyond it: it is the only largest one.

    Normals of a simplex and their opposites add up to nothing with positive weights only, so that
    no way leads away from all of them.
    """
    for seed in range(10):
        rng = np.random.default_rng(seed)
        touching = np.vstack([np.eye(n), -np.ones(n)]) @ np.linalg.qr(rng.normal(size=(n, n)))[0]
        touching /= np.linalg.norm(touching, axis=1)[:, None]
        beyond = rng.normal(size=(3 * n, n))
        beyond /= np.linalg.norm(beyond, axis=1)[:, None]
        center, radius = size * rng.normal(size=n), size * (0.1 + rng.random())
        A = np.vstack([touching, beyond])
        b = A @ center + radius * np.append(np.ones(n + 1), 1.01 + rng.random(3 * n))
        factors = 10.0 ** rng.uniform(-8, 8, size=len(b))
        order = rng.permutation(len(b))
        rows, sides = frozen((A * factors[:, None])[order]), frozen((b * factors)[order])
        found = center_of_rows(rows, sides)
        assert found is not None
        assert found == pytest.approx(center, abs=1e-12 * size, rel=0.0)
        assert HPolyhedron(rows, sides).chebyshev_center() == pytest.approx(found, abs=0.0)


@pytest.mark.parametrize("thin", [1.0, 0.5, 1e-3])
@pytest.mark.parametrize("size", [1e-9, 1.0, 1e7])
def test_largest_balls_in_turned_boxes(size, thin):
    """Each ball that touches both near faces is one: found, with their half distance as radius."""
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    half = size * np.array([1.0, 1.0, thin])
    A, b = frozen(np.concatenate([turn, -turn])), frozen(np.tile(half, 2))
    found = center_of_rows(A, b)
    assert found is not None
    assert (b - A @ found).min() == pytest.approx(size * thin, abs=1e-15 * size, rel=1e-12)


def test_balls_that_floats_leave_open():
    """Of empty sets, flat ones and those in which balls have no largest size."""
    box = np.concatenate([np.eye(2), -np.eye(2)])
    for rows, sides in (
        (box, [1.0, 1.0, -2.0, 1.0]),
        (box, [1.0, 1.0, -1.0, 1.0]),
        (np.eye(2), [1.0, 1.0]),
    ):
        assert center_of_rows(frozen(rows), frozen(sides)) is None


@pytest.mark.parametrize("n", [2, 3, 7])
def test_rows_around_a_ball_are_all_needed(n):
    """Planes that touch a ball cut off something each; moved out by its radius they follow."""
    rng = np.random.default_rng(n)
    A = rng.normal(size=(12 * n, n))
    A /= np.linalg.norm(A, axis=1)[:, None]
    box = np.concatenate([np.eye(n), -np.eye(n)])
    far = rng.normal(size=(6, n))
    far *= (1.0 + np.sqrt(n)) / np.linalg.norm(far, axis=1)[:, None]
    rows = np.concatenate([far, A, box])
    sides = np.concatenate([np.full(6, n + np.sqrt(n)), np.ones(12 * n + 2 * n)])
    left_out = redundant(frozen(rows), frozen(sides), 1e-12)
    assert left_out is not None
    assert set(np.flatnonzero(left_out)) == set(range(6))

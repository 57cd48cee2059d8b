"""Sets cut into pieces along joints that turn without an end: how wide, and what they cover."""

import math

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import (
    check_if_satisfies_convexity_radius,
    ConvexSetError,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    partition_convex_set,
    VPolytope,
)

SETS = [
    Hyperrectangle([-4.0, 0.0, 1.0], [6.0, 4.0, 9.0]),
    HPolyhedron.make_box([-4.0, 0.0, 1.0], [6.0, 4.0, 9.0]),
    VPolytope([[-4.0, 0, 0], [6, 4, 1], [0, -3, 2], [1, 1, 9]]),
    Hyperellipsoid(np.diag([0.2, 0.25, 1.0]), [1.0, 2.0, 0.0]),
]


@pytest.mark.parametrize("whole", SETS)
@pytest.mark.parametrize("epsilon", [1e-5, 0.3])
def test_pieces_cover_the_set_overlap_and_are_narrow(whole, epsilon):
    """Along two of three joints: every point of the set is in a piece, and none outside of it."""
    pieces = partition_convex_set(whole, [0, 1], epsilon)
    assert len(pieces) > 3
    widths = np.array(
        [[sum(p.support(s * e).value for s in (-1, 1)) for e in np.eye(3)] for p in pieces]
    )
    assert (widths[:, :2] <= math.pi - epsilon + 1e-9).all()
    assert (widths[:, :2] >= epsilon - 1e-9).all()
    for piece in pieces:
        assert check_if_satisfies_convexity_radius(piece, [0, 1])
    rng = np.random.default_rng(0)
    points = rng.uniform(-5.0, 10.0, (4000, 3))
    covered = np.any([piece.point_in_set(points, 1e-12) for piece in pieces], axis=0)
    np.testing.assert_array_equal(covered, whole.point_in_set(points, 1e-12))
    assert covered.sum() > 10


def test_neighbours_overlap_by_epsilon_and_are_equally_wide():
    """10 rad in pieces of pi - 0.1 at most that overlap by 0.1: 4 of (10 + 3 * 0.1) / 4."""
    pieces = partition_convex_set(Hyperrectangle([-4.0], [6.0]), [0], 0.1)
    assert len(pieces) == 4
    lows, highs = (np.array([getattr(p, name)[0] for p in pieces]) for name in ("lb", "ub"))
    np.testing.assert_allclose(highs - lows, 10.3 / 4, atol=1e-14)
    np.testing.assert_allclose(highs[:-1] - lows[1:], 0.1, atol=1e-14)
    assert (lows[0], highs[-1]) == (-4.0, 6.0)


def test_what_is_narrow_stays_and_several_sets_are_cut_in_turn():
    """A set that is narrow enough is itself among the pieces; other joints don't matter."""
    narrow, wide = Hyperrectangle([0, 0], [1, 9]), Hyperrectangle([0, 0], [4, 1])
    pieces = partition_convex_set([narrow, wide], [0])
    assert pieces[0] is narrow
    assert len(pieces) == 3
    assert partition_convex_set(wide, []) == [wide]


def test_no_sets_are_no_partition():
    """An empty list is more likely a mistake than a wish for no pieces."""
    with pytest.raises(ConvexSetError, match="convex_set must be a set, or sets, one at least"):
        partition_convex_set([], [0])


def test_what_can_not_be_cut_is_named():
    """Empty and unbounded sets, and overlaps that leave nothing."""
    half = HPolyhedron([[1.0, 0.0]], [1.0])
    for call, words in [
        (lambda: partition_convex_set(half, [0]), "unbounded along joint 0"),
        (lambda: partition_convex_set(HPolyhedron([[0.0]], [-1.0]), [0]), "set 0, .* is empty"),
        (lambda: partition_convex_set(half, [2]), "from 0 to 1"),
        (lambda: partition_convex_set(half, [0], 0.0), "between 0 and pi / 2, not 0.0"),
        (lambda: partition_convex_set(half, [0], 2.0), "between 0 and pi / 2, not 2.0"),
        (lambda: partition_convex_set(half, [0], np.nan), "between 0 and pi / 2, not nan"),
        (lambda: partition_convex_set([3], [0]), "set 0 must be a ConvexSet, not 3"),
    ]:
        with pytest.raises(ConvexSetError, match=words):
            call()

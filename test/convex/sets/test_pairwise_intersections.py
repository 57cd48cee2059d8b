"""Which sets meet: beside each pair asked alone, and around joints that turn without an end."""

import itertools
import math

import numpy as np
import pytest

from scene_graph_ros.convex.graphs.model.placed_set import PlacedSet
from scene_graph_ros.geometry.optimization import (
    CartesianProduct,
    check_if_satisfies_convexity_radius,
    compute_pairwise_intersections,
    ConvexSetError,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    Point,
    VPolytope,
)


def random_sets(seed, count=14):
    """Return small sets of four kinds in a box, some of which meet."""
    rng = np.random.default_rng(seed)
    sets = []
    for k in range(count):
        at, half = rng.uniform(-1.5, 1.5, 2), rng.uniform(0.1, 0.6, 2)
        corners = at + half * rng.uniform(-1.0, 1.0, (5, 2))
        sets.append(
            (
                lambda at=at, half=half: Hyperrectangle(at - half, at + half),
                lambda at=at, half=half: Hyperellipsoid(np.diag(1.0 / half), at),
                lambda corners=corners: VPolytope(corners),
                lambda corners=corners: HPolyhedron(VPolytope(corners)),
                lambda at=at: Point(at),
            )[k % 5]()
        )
    return sets


@pytest.mark.parametrize("seed", range(4))
def test_pairs_are_those_that_meet_when_asked_alone(seed):
    """In both orders within one list, and between two."""
    sets = random_sets(seed)
    edges, offsets = compute_pairwise_intersections(sets)
    truth = {
        (i, j)
        for i, j in itertools.permutations(range(len(sets)), 2)
        if sets[i].intersects_with(sets[j])
    }
    assert set(edges) == truth
    assert len(edges) == len(truth) > 3
    assert not np.any(offsets)
    between, _ = compute_pairwise_intersections(sets[:6], sets[6:])
    assert set(between) == {(i, j - 6) for i, j in truth if i < 6 <= j}


def test_what_touches_meets_and_what_is_an_ulp_away_does_not():
    """Boxes as boxes and as half-spaces, by their last digit."""
    third = 1.0 / 3.0
    for kind in (Hyperrectangle, HPolyhedron.make_box):
        first = kind([0.0, 0.0], [third, 1.0])
        for low, expected in ((third, 2), (np.nextafter(third, 1.0), 0)):
            edges, _ = compute_pairwise_intersections([first, kind([low, 0.0], [1.0, 1.0])])
            assert len(edges) == expected


@pytest.mark.parametrize("kind", [Hyperrectangle, HPolyhedron.make_box])
def test_turns_are_found_for_each_joint(kind):
    """A set and itself after some turns of two joints, and of one that has an end."""
    box = kind([0.1, 0.2, 0.3], [1.0, 3.0, 2.0])
    turn = 2.0 * math.pi
    moved = kind([0.1 + 3.0 * turn, 0.2 - turn, 0.3], [1.0 + 3.0 * turn, 3.0 - turn, 2.0])
    edges, offsets = compute_pairwise_intersections([box], [moved], [0, 1])
    assert edges == [(0, 0)]
    np.testing.assert_array_equal(offsets[0], [3.0 * turn, -turn, 0.0])
    assert compute_pairwise_intersections([box], [moved], [0])[0] == []
    edges, offsets = compute_pairwise_intersections([box, moved], None, [0, 1])
    assert edges == [(0, 1), (1, 0)]
    np.testing.assert_array_equal(offsets[0], -offsets[1])


def test_turned_sets_of_other_kinds_are_moved_exactly():
    """Discs, hulls and points that meet only after a turn."""
    turn = 2.0 * math.pi
    disc = Hyperellipsoid.make_hypersphere(1.0, [3.0, 0.0])
    hull = VPolytope([[-3.0, 0.0], [-1.0, 1.0], [-1.0, -1.0]])
    point = Point([3.5 - turn, 0.0])
    edges, offsets = compute_pairwise_intersections([disc, hull, point], None, [0])
    found = dict(zip(edges, offsets, strict=True))
    assert set(found) == {(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)}
    np.testing.assert_array_equal(found[0, 1], [-turn, 0.0])
    np.testing.assert_array_equal(found[0, 2], [-turn, 0.0])
    assert not found[1, 2].any()


def test_given_boxes_are_used_and_what_is_too_wide_is_named():
    """Errors have the list, the number and the joint."""
    sets = [Hyperrectangle([0, 0], [1, 3.2]), HPolyhedron.make_box([0, 0], [1, 1])]
    assert check_if_satisfies_convexity_radius(sets[0], [0])
    assert not check_if_satisfies_convexity_radius(sets[0], [0, 1])
    assert not check_if_satisfies_convexity_radius(HPolyhedron([[1.0, 0.0]], [1.0]), [1])
    away = Hyperrectangle([9, 9], [10, 10])
    given = compute_pairwise_intersections(sets, bboxes_A=[sets[0], away])
    assert given[0] == []
    for call, words in [
        (
            lambda: compute_pairwise_intersections(sets, None, [1]),
            r"convex_sets_A\[0\] is 3.2 wide along joint 1",
        ),
        (lambda: compute_pairwise_intersections([]), "convex_sets_A must be one set or more"),
        (lambda: compute_pairwise_intersections([3]), r"convex_sets_A\[0\] must be a ConvexSet"),
        (
            lambda: compute_pairwise_intersections(sets, [Point([0.0])]),
            "convex_sets_B have 1 dimensions, convex_sets_A 2",
        ),
        (
            lambda: compute_pairwise_intersections([*sets, Point([0.0])]),
            r"convex_sets_A\[2\] has 1 dimensions",
        ),
        (lambda: compute_pairwise_intersections(sets, None, [5]), r"from 0 to 1, not \[5\]"),
        (
            lambda: compute_pairwise_intersections(sets, bboxes_A=[away]),
            "bboxes_A must have 2 boxes, one a set, not 1",
        ),
        (
            lambda: compute_pairwise_intersections([HPolyhedron([[1.0, 0.0]], [1.0])]),
            "set 0, .* is empty or unbounded",
        ),
    ]:
        with pytest.raises(ConvexSetError, match=words):
            call()


def test_products_answer_as_their_sets_do():
    """Empty, bounded and how far they reach: part by part, beside the decision with a proof."""
    half, empty = HPolyhedron([[1.0]], [1.0]), HPolyhedron([[1.0], [-1.0]], [0.0, -1.0])
    disc, box = Hyperellipsoid.make_unit_ball(2), Hyperrectangle([0.0], [2.0])
    for sets in itertools.product((half, empty, disc, box), repeat=2):
        product = CartesianProduct(list(sets))
        assert product.is_empty() == product.is_empty(certificate=True).value
        assert product.is_bounded() == product.is_bounded(certificate=True).value
    hexagon = HPolyhedron(VPolytope([[1, 0], [2, 1], [2, 3], [1, 4], [0, 3], [0, 1]]))
    product = CartesianProduct([hexagon, disc, Point([7.0]), hexagon, box])
    placed = PlacedSet.place(product)
    assert len(placed.parts) == 5
    D = np.random.default_rng(3).normal(size=(20, 8))
    D[5:10, 2:] = 0.0
    reach, rounding = placed.reach(D)
    for d, value, off in zip(D, reach, rounding, strict=True):
        truth = product.support(d).value - d @ placed.center
        assert truth - 1e-12 <= value + off
        assert value <= truth + 1e-9


def test_a_polyhedron_knows_when_its_rows_are_a_box():
    """Where rows are of one coordinate each, bound both sides, and divide without rounding."""
    rows = np.array([[2.0, 0.0], [-0.5, 0.0], [0.0, 1.0], [0.0, -4.0], [1.0, 0.0]])
    sides = [3.0, 0.25, 1.0, 2.0, 9.0]
    low, high = HPolyhedron(rows, sides).own_box
    np.testing.assert_array_equal([low, high], [[-0.5, -0.5], [1.5, 1.0]])
    empty = HPolyhedron(rows[:4], [-3.0, 0.25, 1.0, 2.0])
    assert empty.is_empty()
    assert empty.is_empty(certificate=True).certificate.verify()
    assert not HPolyhedron(rows, sides).is_empty()
    for other_rows, other_sides in [
        (rows[:3], sides[:3]),
        (rows * [[3.0], [1.0], [1.0], [1.0], [1.0]], sides),
        (np.concatenate([rows, [[1.0, 1.0]]]), [*sides, 5.0]),
        (np.concatenate([rows, [[0.0, 0.0]]]), [*sides, 1.0]),
    ]:
        assert HPolyhedron(other_rows, other_sides).own_box is None


@pytest.mark.parametrize("seed", range(4))
def test_without_boxes_the_same_pairs_meet(seed):
    """Only how much is asked changes; sets may go on for ever, or have no point."""
    sets = random_sets(seed)
    with_boxes = compute_pairwise_intersections(sets)
    without = compute_pairwise_intersections(sets, preprocess_bbox=False)
    assert sorted(without[0]) == sorted(with_boxes[0])
    above = HPolyhedron([[0.0, -1.0]], [-0.5])
    nothing = HPolyhedron([[1.0, 0.0], [-1.0, 0.0]], [0.0, -1.0])
    more = [*sets, above, nothing]
    pairs, _ = compute_pairwise_intersections(more, preprocess_bbox=False)
    truth = {k for k, each in enumerate(sets) if each.intersects_with(above)}
    assert {i for i, j in pairs if j == len(sets)} == truth
    assert not any(len(sets) + 1 in pair for pair in pairs)
    with pytest.raises(ConvexSetError, match=r"set 14, .*, is empty or unbounded"):
        compute_pairwise_intersections(more)


def test_without_boxes_turns_are_found_all_the_same():
    """Along a joint that turns without an end it is known how wide sets are; others may be."""
    near = HPolyhedron([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]], [0.5, 0.5, 0.0])
    turned = HPolyhedron([[1.0, 0.0], [-1.0, 0.0]], [4.0 * math.pi + 1.0, -4.0 * math.pi])
    pairs, offsets = compute_pairwise_intersections(
        [near, turned], None, [0], preprocess_bbox=False
    )
    assert pairs == [(0, 1), (1, 0)]
    np.testing.assert_allclose(offsets, [[4.0 * math.pi, 0.0], [-4.0 * math.pi, 0.0]])
    with pytest.raises(ConvexSetError, match="is empty or unbounded"):
        compute_pairwise_intersections([near, turned], None, [1], preprocess_bbox=False)


def test_joints_may_come_second_as_in_the_reference():
    """Whole numbers are joints, and nothing else is; sets beside a full turn meet."""
    sets = [Hyperrectangle([0.0], [1.0]), Hyperrectangle([2.0 * np.pi + 0.5], [2.0 * np.pi + 2])]
    named = compute_pairwise_intersections(sets, continuous_revolute_joints=[0])
    for joints in ([0], (0,), np.array([0])):
        pairs, offsets = compute_pairwise_intersections(sets, joints)
        assert pairs == named[0] == [(0, 1), (1, 0)]
        np.testing.assert_array_equal(offsets, named[1])
    with pytest.raises(ConvexSetError, match="leave it out, as in compute_pairwise_intersections"):
        compute_pairwise_intersections(sets, [])
    with pytest.raises(ConvexSetError, match=r"convex_sets_B\[0\] must be a ConvexSet, not 0"):
        compute_pairwise_intersections(sets, [0], [0])
    with pytest.raises(ConvexSetError, match=r"convex_sets_B\[0\] must be a ConvexSet, not True"):
        compute_pairwise_intersections(sets, [True])

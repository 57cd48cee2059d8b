"""Rows that follow from others: which are left out, and what shows that."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from scene_graph_ros.geometry.optimization import HPolyhedron


def test_reduction_keeps_the_set_and_says_why():
    """A box with each face twice, in rows of other lengths, and a plane through a corner."""
    box = HPolyhedron.make_unit_box(3)
    A = np.vstack([box.A, 2.0 * box.A, np.ones((1, 3))])
    b = np.concatenate([box.b, 2.0 * box.b, [3.0]])
    whole = HPolyhedron(A, b)
    reduced, why = whole.reduce_inequalities(0.0, certificate=True)
    assert len(reduced.b) == 6
    assert reduced.contained_in(whole, 0.0)
    assert set(why.removed) == whole.find_redundant(0.0)
    assert set(why.removed) | set(why.kept) == set(range(13))
    exact = [[Fraction(v) for v in (*row, side)] for row, side in zip(A, b, strict=True)]
    for i, weights in why.removed.items():
        assert all(w >= 0 for w in weights)
        assert not any(weights[k] for k in why.removed)
        sums = [sum(w * row[k] for w, row in zip(weights, exact, strict=True)) for k in range(4)]
        assert sums[:3] == exact[i][:3]
        assert sums[3] <= exact[i][3]
    for i, x in why.kept.items():
        over = [sum(a * v for a, v in zip(row, (*x, -1), strict=True)) for row in exact]
        assert [k for k in why.kept if over[k] > 0] == [i]


def test_reduction_of_an_empty_set_is_empty():
    """Rows that contradict each other stay, those beside them go."""
    empty = HPolyhedron([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]], [-1.0, -1.0, 5.0])
    reduced = empty.reduce_inequalities()
    assert reduced.is_empty(certificate=True).certificate.verify(reduced)
    assert len(reduced.b) == 2


def test_a_tolerance_is_a_distance():
    """A face 1e-3 outside counts at 1e-2 and not at 1e-4, whatever the length of its row."""
    for length in (1e-10, 1.0, 1e10):
        far = HPolyhedron([[1.0], [-1.0], [length]], [1.0, 1.0, length * (1.0 - 1e-3)])
        assert far.find_redundant(1e-2) != set()
        assert 2 not in far.find_redundant(1e-4)
        half_line = HPolyhedron([[length]], [length])
        assert half_line.point_in_set([1.0 + 1e-9])
        assert not half_line.point_in_set([1.0 + 1e-7])
        assert half_line.point_in_set([1.0 + 1e-7], 1e-6)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_what_shows_a_reduction_is_checked(size):
    """What shows it of one polyhedron does not of others, nor when it is changed."""
    box = HPolyhedron.make_unit_box(2)
    A = np.vstack([box.A, [[1.0, 1.0], [1.0, 0.5]]])
    whole = HPolyhedron(A, size * np.array([1.0, 1.0, 1.0, 1.0, 1.5, 2.0]))
    _, why = whole.reduce_inequalities(0.0, certificate=True)
    assert set(why.removed) == {5}
    assert why.verify(whole, 0.0)
    # By now the last row cuts; the one before it no longer does.
    assert not why.verify(HPolyhedron(A, size * np.array([1, 1, 1, 1, 1.5, 1.2])), 0.0)
    assert not why.verify(HPolyhedron(A, size * np.array([1, 1, 1, 1, 2.5, 2.0])), 0.0)
    # It is cut off by 1/2 of a size, a distance of about 0.35: a tolerance above that is more.
    assert why.verify(whole, 0.1 * size) and not why.verify(whole, 0.5 * size)
    weights = why.removed[5]
    assert not replace(why, removed={5: (*weights[:3], Fraction(-1), *weights[4:])}).verify(whole)
    assert not replace(why, removed={5: (*weights[:5], Fraction(1))}).verify(whole, 0.0)
    assert not replace(why, kept={k: x for k, x in why.kept.items() if k}).verify(whole, 0.0)


def test_what_shows_the_reduction_of_an_empty_set_is_checked():
    """Weights whose sum contradicts itself."""
    empty = HPolyhedron([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]], [-1.0, -1.0, 5.0])
    _, why = empty.reduce_inequalities(certificate=True)
    assert why.verify(empty)
    touching = HPolyhedron(empty.A, [1.0, -1.0, 5.0])
    assert not why.verify(touching)


def rows_by_construction(rng, n, needed, redundant):
    """Return rows in a random order and which are redundant: sums of three of the others.

    The others touch ellipsoids about the origin, nearly balls, so that rays along normals meet
    some of them behind others.
    """
    A = np.concatenate([np.eye(n), -np.eye(n), rng.normal(size=(needed - 2 * n, n))])
    b = np.linalg.norm(A * rng.uniform(1.0, 1.2, n), axis=1)
    weights = np.zeros((redundant, needed))
    for row in weights:
        row[rng.choice(needed, 3, replace=False)] = rng.uniform(0.1, 1.0, 3)
    order = rng.permutation(needed + redundant)
    rows = np.concatenate([A, weights @ A])[order]
    sides = np.concatenate([b, 1.01 * (weights @ b)])[order]
    return rows, sides, set(np.flatnonzero(order >= needed).tolist())


@pytest.mark.parametrize(("n", "needed"), [(2, 9), (3, 18), (7, 40), (12, 64)])
@pytest.mark.parametrize("share", [0.0, 0.3, 1.0, 3.0])
def test_redundant_rows_are_those_that_were_made_so(n, needed, share):
    """No needed row among many redundant ones, and no redundant one among many needed."""
    for seed in range(3):
        rng = np.random.default_rng((n, seed))
        A, b, redundant = rows_by_construction(rng, n, needed, int(share * needed))
        assert HPolyhedron(A, b).find_redundant(0.0) == redundant
        assert len(HPolyhedron(A, b).reduce_inequalities(0.0).b) == needed


def test_rows_that_come_again_with_other_zeros_are_the_same():
    """A negative zero is a zero; multiples by powers of two are the same, others only nearly."""
    rows = [[1.0, 0.0], [1.0, -0.0], [-1.0, 0.0], [-4.0, -0.0], [0.0, 1.0], [0.0, -1.0]]
    box = HPolyhedron(rows, [1.0, 1.0, 1.0, 2.0, 1.0, 1.0])
    redundant = box.find_redundant(0.0)
    assert len(redundant & {0, 1}) == 1
    assert redundant - {0, 1} == {2}
    assert len(box.reduce_inequalities(0.0).b) == 4

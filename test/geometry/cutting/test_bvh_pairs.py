"""Walks down trees of boxes: they miss nothing that a look at every box finds."""

import numpy as np
import pytest

from scene_graph_ros.geometry.cutting.bvh_pairs import (
    absolute_rotation,
    boxes_meet,
    next_leaf_above_plane,
    next_leaf_at_box,
    next_leaf_near_box,
)
from scene_graph_ros.geometry.meshes.bvh import build_bvh, STACK_SIZE


def _tree(rng, n):
    centres, halves = rng.uniform(-1.0, 1.0, (n, 3)), rng.uniform(0.01, 0.1, (n, 3))
    lower, upper, left, right, order = build_bvh(centres - halves, centres + halves)
    nodes = np.hstack([0.5 * (lower + upper), 0.5 * (upper - lower)])
    return np.hstack([centres, halves]), (nodes, left, right), order


def _rotation(rng):
    Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(R))
    return Q * np.sign(np.linalg.det(Q))


def _collect(step, tree, order):
    """Walk a tree to its end and return the elements of the leaves."""
    stack, depth, found = np.zeros(STACK_SIZE, np.int64), 1, []
    while depth > 0:
        depth, node = step(stack, depth)
        if node < 0:
            break
        first, count = -1 - tree[1][node], tree[2][node]
        found += order[first : first + count].tolist()
    assert len(found) == len(set(found))
    return set(found)


def _corners(box):
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    return box[:3] + signs * box[3:]


@pytest.mark.parametrize("seed", range(5))
def test_turned_boxes_that_meet_are_found(seed):
    """No box that has a point in the other body's turned box is missed."""
    rng = np.random.default_rng(seed)
    boxes, tree, order = _tree(rng, 60)
    R, p = _rotation(rng), rng.uniform(-0.5, 0.5, 3)
    other = np.array([[0.1, -0.1, 0.0, 0.4, 0.3, 0.2]])
    R9, p3 = tuple(R.ravel()), tuple(p)
    found = _collect(
        lambda stack, depth: next_leaf_near_box(
            tree, stack, depth, (other, 0), (R9, absolute_rotation(R9), p3), 0.0
        ),
        tree,
        order,
    )
    for i, box in enumerate(boxes):
        inside = rng.uniform(-1.0, 1.0, (200, 3)) * box[3:] + box[:3]
        in_other = np.abs((inside - p) @ R - other[0, :3]) <= other[0, 3:]
        if in_other.all(axis=1).any():
            assert i in found
            assert boxes_meet(boxes, i, other, 0, R9, absolute_rotation(R9), p3, 0.0)
    assert len(found) < len(boxes)


def test_separated_by_each_kind_of_axis():
    """Boxes apart along an axis of one or of the other are told apart; beside it they meet."""
    one = np.array([[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]])
    c = np.sqrt(0.5)
    R = (c, -c, 0.0, c, c, 0.0, 0.0, 0.0, 1.0)
    A = absolute_rotation(R)
    # Turned by 45 degrees the box reaches sqrt(2) along x; towards (1, 1) it reaches 1, and the
    # other's corner sqrt(2).
    assert boxes_meet(one, 0, one, 0, R, A, (1.0 + np.sqrt(2.0) - 1e-9, 0.0, 0.0), 0.0)
    assert not boxes_meet(one, 0, one, 0, R, A, (1.0 + np.sqrt(2.0) + 1e-9, 0.0, 0.0), 0.0)
    reach = (1.0 + np.sqrt(2.0)) * c
    assert not boxes_meet(one, 0, one, 0, R, A, (reach + 1e-9, reach + 1e-9, 0.0), 0.0)
    assert boxes_meet(one, 0, one, 0, R, A, (reach - 1e-9, reach - 1e-9, 0.0), 0.0)


def test_aligned_box_finds_exactly_what_its_leaves_have():
    """Every box that overlaps an aligned one is in a leaf that is found."""
    rng = np.random.default_rng(7)
    boxes, tree, order = _tree(rng, 80)
    item = np.array([9.0, 0.2, 0.1, -0.1, 0.2, 0.3, 0.1])  # the box begins at entry 1
    found = _collect(
        lambda stack, depth: next_leaf_at_box(tree, stack, depth, item, 1, 0.0), tree, order
    )
    overlap = (np.abs(boxes[:, :3] - item[1:4]) <= boxes[:, 3:] + item[4:]).all(axis=1)
    assert set(np.flatnonzero(overlap)) <= found
    assert 0 < len(found) < len(boxes)


@pytest.mark.parametrize("both", [False, True])
def test_plane_finds_what_reaches_above_it(both):
    """Every box above the plane, or cut by it, is in a leaf that is found."""
    rng = np.random.default_rng(8)
    boxes, tree, order = _tree(rng, 80)
    n = np.array([0.48, -0.6, 0.64])
    found = _collect(
        lambda stack, depth: next_leaf_above_plane(
            tree, stack, depth, (tuple(n), -0.2), both, 0.0
        ),
        tree,
        order,
    )
    heights = np.array([_corners(box) @ n - 0.2 for box in boxes])
    wanted = heights.max(axis=1) >= 0.0
    if both:
        wanted &= heights.min(axis=1) <= 0.0
    assert set(np.flatnonzero(wanted)) <= found
    assert len(found) < len(boxes)

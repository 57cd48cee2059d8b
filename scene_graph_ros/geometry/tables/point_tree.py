"""Balls around points in a tree of boxes with eight children each, for kernels.

Points are sorted along a Morton curve (Morton, *A Computer Oriented Geodetic Data Base*, 1966):
eight that follow each other are a leaf, eight leaves that follow each other a node, and so on.
Nothing but the order says which belong together. Where many points are in one cell of the curve,
as one that is far from all others makes the cells large, these are sorted again by themselves.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    LANES,
    larger,
    load_lanes,
    smaller,
    store_lanes,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.loans import RoomLender
from scene_graph_ros.geometry.tables.holding import Holding

__all__ = [
    "BEYOND",
    "BOX",
    "PlacedPoints",
    "PointTree",
    "borrowed_points",
    "held_again",
    "place_points",
]

FloatArray = NDArray[np.float64]

BOX = 7
"""Numbers of a child in its node: its box's lower and upper corner, and the largest radius."""
BEYOND = 1e300
"""Where boxes are that fill a node up; their radius is -inf, so nothing is near them."""

_BITS = 10
"""Of each coordinate, in a cell's number."""
_CELLS = 1 << _BITS
_SPREAD = np.array(
    [sum((x >> bit & 1) << 3 * bit for bit in range(_BITS)) for x in range(_CELLS)], np.int64
)
"""Numbers of ten bits with two zeros between any two of them."""
_INDEX_BITS = 32
_INDEX = (1 << _INDEX_BITS) - 1
"""Of a key: the bits of its point's number."""
_KEPT_LEAVES = 1 << 9, 1 << 15
"""Of trees whose memory is kept for the next one: that of less is not cleared by the system each
time, and that of more is given back to it."""
_RUN = 64
"""More points of one cell than these are sorted by themselves."""


_corners = stack_array((2, 3 * LANES))


class PointTree(NamedTuple):
    """The kernels' tree of n points."""

    points: np.ndarray
    """``(leaves, 3, LANES)`` m, in G. The last leaf is filled up with its last point."""
    radii: np.ndarray
    """``(leaves, LANES)`` m; no leaves where all radii are alike."""
    boxes: np.ndarray
    """``(nodes, BOX, LANES)`` m: each node's children, level by level, from above the leaves."""
    order: np.ndarray
    """``(leaves LANES,)`` int32: which point each was when they were given."""
    starts: np.ndarray
    """``(levels + 1,)``: the first node of each level but the leaves, and how many there are."""
    bounds: np.ndarray
    """``(2, 3)`` m: the corners of the box around all points."""
    radius: np.ndarray
    """``(2,)`` m: the largest, and the one of all that are alike."""


class PlacedPoints(NamedTuple):
    """A tree and where its arrays are."""

    tree: PointTree
    count: int  # type: ignore[assignment]
    """How many points there are."""
    places: Any
    """What ``borrowed_points`` takes; right as long as the tree lives."""

    def points_in_order(self) -> FloatArray:
        """Return the points ``(n, 3)`` as they were given, a new array."""
        result = np.empty((self.count, 3))
        by_place = self.tree.points.transpose(0, 2, 1).reshape(-1, 3)
        result[self.tree.order] = by_place
        return result


@inlined_kernel
def _corners_of_all(points, corners):
    """Write the corners of the box around all points, eight points at a time."""
    numbers, wide = len(points) * 3, 3 * LANES
    for k in range(min(wide, numbers)):
        corners[0, k] = corners[1, k] = points[k // 3, k % 3]
    if numbers >= wide:
        # Number k of three lanes is one of coordinate k % 3.
        la, lb, lc = (
            load_lanes(points, 0),
            load_lanes(points, LANES),
            load_lanes(points, 2 * LANES),
        )
        ua, ub, uc = la, lb, lc
        for at in range(wide, numbers - wide + 1, wide):
            a, b, c = (
                load_lanes(points, at),
                load_lanes(points, at + LANES),
                load_lanes(points, at + 2 * LANES),
            )
            la, lb, lc = smaller(la, a), smaller(lb, b), smaller(lc, c)
            ua, ub, uc = larger(ua, a), larger(ub, b), larger(uc, c)
        for row, first, second, third in ((0, la, lb, lc), (1, ua, ub, uc)):
            store_lanes(corners, row * wide, first)
            store_lanes(corners, row * wide + LANES, second)
            store_lanes(corners, row * wide + 2 * LANES, third)
    for k in range(3, min(wide, numbers)):
        corners[0, k % 3] = min(corners[0, k % 3], corners[0, k])
        corners[1, k % 3] = max(corners[1, k % 3], corners[1, k])
    for k in range(numbers - numbers % wide, numbers):
        corners[0, k % 3] = min(corners[0, k % 3], points[k // 3, k % 3])
        corners[1, k % 3] = max(corners[1, k % 3], points[k // 3, k % 3])


@inlined_kernel
def _corners_of(points, keys, first, last, corners):
    """Write the corners of the box around some points."""
    for axis in range(3):
        lower, upper = np.inf, -np.inf
        for k in range(first, last):
            x = points[keys[k] & _INDEX, axis]
            lower, upper = min(lower, x), max(upper, x)
        corners[0, axis], corners[1, axis] = lower, upper


@inlined_kernel
def _number_cells(points, keys, first, last, corners, counts):
    """Write which cells of their box some points are in, and count digits; return its extent."""
    lx, ly, lz = corners[0, 0], corners[0, 1], corners[0, 2]
    extent = max(corners[1, 0] - lx, corners[1, 1] - ly, corners[1, 2] - lz)
    scale = (_CELLS - 1) / extent
    if not 0.0 < scale < np.inf:
        return 0.0
    for digit in range(_CELLS):
        counts[0, digit] = counts[1, digit] = counts[2, digit] = 0
    for k in range(first, last):
        i = keys[k] & _INDEX
        x = _SPREAD[np.int64((points[i, 0] - lx) * scale)]
        y = _SPREAD[np.int64((points[i, 1] - ly) * scale)]
        code = x | y << 1 | _SPREAD[np.int64((points[i, 2] - lz) * scale)] << 2
        keys[k] = code << _INDEX_BITS | i
        counts[0, code & _CELLS - 1] += 1
        counts[1, code >> _BITS & _CELLS - 1] += 1
        counts[2, code >> 2 * _BITS] += 1
    return extent


@inlined_kernel
def _sort_by_digit(keys, other, first, last, digit, counts):
    """Write a part of the keys to the other array, sorted by ten bits; stable."""
    place, shift = first, _INDEX_BITS + digit * _BITS
    for each in range(_CELLS):
        count = counts[digit, each]
        counts[digit, each] = place
        place += count
    for k in range(first, last):
        each = keys[k] >> shift & _CELLS - 1
        place = counts[digit, each]
        counts[digit, each] = place + 1
        other[place] = keys[k]


@lean_kernel
def _sort(points, keys, other, counts, parts):
    """Sort keys, each a point's number by now, along the curve; ``parts`` waits to be sorted.

    A key is the number of its cell before that of the point.
    """
    corners = _corners()
    parts[0, 0], parts[0, 1], waiting = 0, len(points), 1
    while waiting > 0:
        waiting -= 1
        first, last = parts[waiting, 0], parts[waiting, 1]
        if last - first == len(points):
            _corners_of_all(points, corners)
        else:
            _corners_of(points, keys, first, last, corners)
        if not _number_cells(points, keys, first, last, corners, counts) > 0.0:
            continue
        _sort_by_digit(keys, other, first, last, 0, counts)
        _sort_by_digit(other, keys, first, last, 1, counts)
        _sort_by_digit(keys, other, first, last, 2, counts)
        begin = first
        for k in range(first, last):
            keys[k] = other[k]
            if keys[k] >> _INDEX_BITS == keys[begin] >> _INDEX_BITS:
                continue
            if k - begin > _RUN:
                parts[waiting, 0], parts[waiting, 1] = begin, k
                waiting += 1
            begin = k
        if last - begin > _RUN:
            parts[waiting, 0], parts[waiting, 1] = begin, last
            waiting += 1


@inlined_kernel
def _fill_leaves(points, radii, keys, tree):
    """Write the points of all leaves, and their radii where they have their own."""
    n, has_radii = len(points), len(tree.radii) > 0
    for leaf in range(len(tree.points)):
        for i in range(LANES):
            k = keys[min(LANES * leaf + i, n - 1)] & _INDEX
            tree.order[LANES * leaf + i] = k
            for axis in range(3):
                tree.points[leaf, axis, i] = points[k, axis]
            if has_radii:
                tree.radii[leaf, i] = radii[k]


@inlined_kernel
def _bound_leaf(tree, leaf, row, i):
    """Write the box of a leaf to its place in a node."""
    for axis in range(3):
        lower = upper = tree.points[leaf, axis, 0]
        for k in range(1, LANES):
            lower = min(lower, tree.points[leaf, axis, k])
            upper = max(upper, tree.points[leaf, axis, k])
        tree.boxes[row, axis, i], tree.boxes[row, 3 + axis, i] = lower, upper
    largest = tree.radius[1]
    if len(tree.radii) > 0:
        largest = tree.radii[leaf, 0]
        for k in range(1, LANES):
            largest = max(largest, tree.radii[leaf, k])
    tree.boxes[row, 6, i] = largest


@inlined_kernel
def _bound_node(tree, child, row, i):
    """Write the box of a node to its place in the node above."""
    boxes = tree.boxes
    for axis in range(3):
        lower, upper = boxes[child, axis, 0], boxes[child, 3 + axis, 0]
        for k in range(1, LANES):
            if boxes[child, axis, k] < BEYOND:
                lower = min(lower, boxes[child, axis, k])
                upper = max(upper, boxes[child, 3 + axis, k])
        boxes[row, axis, i], boxes[row, 3 + axis, i] = lower, upper
    largest = boxes[child, 6, 0]
    for k in range(1, LANES):
        largest = max(largest, boxes[child, 6, k])
    boxes[row, 6, i] = largest


@lean_kernel
def _fill(points, radii, keys, tree):
    """Write all of a tree but where its levels start."""
    _fill_leaves(points, radii, keys, tree)
    below, first_below = len(tree.points), 0
    for level in range(len(tree.starts) - 1):
        first = tree.starts[level]
        count = tree.starts[level + 1] - first
        for node in range(count):
            for i in range(LANES):
                child, row = LANES * node + i, first + node
                if child >= below:
                    for number in range(BOX):
                        tree.boxes[row, number, i] = BEYOND if number < 6 else -np.inf
                elif level == 0:
                    _bound_leaf(tree, child, row, i)
                else:
                    _bound_node(tree, first_below + child, row, i)
        below, first_below = count, first
    top = tree.boxes[len(tree.boxes) - 1]
    for axis in range(3):
        tree.bounds[0, axis], tree.bounds[1, axis] = np.inf, -np.inf
        for i in range(LANES):
            if top[axis, i] < BEYOND:
                tree.bounds[0, axis] = min(tree.bounds[0, axis], top[axis, i])
                tree.bounds[1, axis] = max(tree.bounds[1, axis], top[3 + axis, i])
    for i in range(LANES):
        tree.radius[0] = max(tree.radius[0], top[6, i])


def _node_counts(leaves: int) -> list[int]:
    """Return how many nodes there are on each level, from above the leaves."""
    counts: list[int] = []
    below = leaves
    while below > 1 or (below == 1 and not counts):
        below = -(-below // LANES)
        counts.append(below)
    return counts


def _new_rooms(leaves: int, memory: type[np.ndarray[Any, Any]]) -> tuple[NDArray[Any], ...]:
    return (
        memory((leaves, 3, LANES)),
        memory((leaves, LANES)),
        memory((sum(_node_counts(leaves)), BOX, LANES)),
        memory((leaves * LANES,), np.int32),
    )


_rooms = RoomLender(_new_rooms, *_KEPT_LEAVES)
_sorting = RoomLender(
    lambda leaves, memory: (memory((2, leaves * LANES), np.int64),), *_KEPT_LEAVES
)


def _new_tree(n: int, radii: FloatArray) -> PointTree:
    """Return a tree for n points without anything in it but how it is laid out."""
    leaves = -(-n // LANES)
    points, own, boxes, order = _rooms.take(leaves)
    starts = np.concatenate([[0], np.cumsum(_node_counts(leaves))]).astype(np.int64)
    of_all = 0.0 if radii.ndim else float(radii)
    return PointTree(
        points[:leaves],
        own[: leaves if radii.ndim else 0],
        boxes[: int(starts[-1])],
        order[: leaves * LANES],
        starts,
        np.full((2, 3), [[np.inf], [-np.inf]]),
        np.array([0.0, of_all]),
    )


_holding = Holding("a tree of points", lambda: _new_tree(0, np.zeros(())))
borrowed_points = _holding.borrowed
"""Return, in a lean kernel, the tree that the ``places`` of PlacedPoints describe."""


def held_again(placed: PlacedPoints) -> PlacedPoints:
    """Return a tree with its places in this process, into which it was unpickled."""
    return placed._replace(places=_holding.places(placed.tree))


def place_points(points: FloatArray, radii: FloatArray) -> PlacedPoints:
    """Return points ``(n, 3)`` in their tree, with a radius ``()`` of all or ``(n,)``, all in m.

    They must have been checked.
    """
    n = len(points)
    tree = _new_tree(n, radii)
    if n > 0:
        keys, other = _sorting.take(len(tree.points))[0][:, :n]
        keys[:] = np.arange(n)
        counts = np.empty((3, _CELLS), np.int64)
        parts = np.empty((n // _RUN + 1, 2), np.int64)
        given, own = points.view(), np.atleast_1d(radii).view()
        for array in (given, own):
            array.setflags(write=False)  # one type of argument for all
        _sort(given, keys, other, counts, parts)
        _fill(given, own, keys, tree)
    return PlacedPoints(tree, n, _holding.places(tree))

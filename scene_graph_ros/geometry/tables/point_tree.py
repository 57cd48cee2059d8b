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
from scene_graph_ros.geometry.compiled.lanes import LANES
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
_RUN = 64
"""More points of one cell than these are sorted by themselves."""


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
def _spread(x):
    """Return a number of ten bits with two zeros between any two of them."""
    x &= _CELLS - 1
    x = (x | x << 16) & 0x30000FF
    x = (x | x << 8) & 0x300F00F
    x = (x | x << 4) & 0x30C30C3
    return (x | x << 2) & 0x9249249


@inlined_kernel
def _number_cells(points, order, first, last, codes):
    """Write which cell of their own box some of the points are in; return the box's extent."""
    lx = ly = lz = np.inf
    ux = uy = uz = -np.inf
    for k in range(first, last):
        i = order[k]
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        lx, ly, lz = min(lx, x), min(ly, y), min(lz, z)
        ux, uy, uz = max(ux, x), max(uy, y), max(uz, z)
    extent = max(ux - lx, uy - ly, uz - lz)
    if extent > 0.0:
        scale = (_CELLS - 1) / extent
        for k in range(first, last):
            i = order[k]
            x = _spread(np.int64((points[i, 0] - lx) * scale))
            y = _spread(np.int64((points[i, 1] - ly) * scale))
            codes[k] = x | y << 1 | _spread(np.int64((points[i, 2] - lz) * scale)) << 2
    return extent


@inlined_kernel
def _sort_by_digit(codes, order, other_codes, other_order, first, last, shift, counts):
    """Write a part of codes and order to the other arrays, sorted by ten bits; stable."""
    for digit in range(_CELLS + 1):
        counts[digit] = 0
    for k in range(first, last):
        counts[(codes[k] >> shift & _CELLS - 1) + 1] += 1
    for digit in range(_CELLS):
        counts[digit + 1] += counts[digit]
    for k in range(first, last):
        digit = codes[k] >> shift & _CELLS - 1
        place = first + counts[digit]
        counts[digit] += 1
        other_codes[place], other_order[place] = codes[k], order[k]


@inlined_kernel
def _sort_by_cells(work, first, last, counts):
    """Sort a part by the numbers of its cells."""
    codes, order, other_codes, other_order = work
    _sort_by_digit(codes, order, other_codes, other_order, first, last, 0, counts)
    _sort_by_digit(other_codes, other_order, codes, order, first, last, _BITS, counts)
    _sort_by_digit(codes, order, other_codes, other_order, first, last, 2 * _BITS, counts)
    for k in range(first, last):
        codes[k], order[k] = other_codes[k], other_order[k]


@lean_kernel
def _sort(points, work, counts, parts):
    """Sort ``work[1]``, the points' order, along the curve; ``parts`` waits to be sorted."""
    codes, order = work[0], work[1]
    parts[0, 0], parts[0, 1], waiting = 0, len(order), 1
    while waiting > 0:
        waiting -= 1
        first, last = parts[waiting, 0], parts[waiting, 1]
        if not _number_cells(points, order, first, last, codes) > 0.0:
            continue
        _sort_by_cells(work, first, last, counts)
        begin = first
        for k in range(first + 1, last + 1):
            if k < last and codes[k] == codes[begin]:
                continue
            if k - begin > _RUN:
                parts[waiting, 0], parts[waiting, 1] = begin, k
                waiting += 1
            begin = k


@inlined_kernel
def _fill_leaves(points, radii, order, tree):
    """Write the points of all leaves, and their radii where they have their own."""
    n, has_radii = len(points), len(tree.radii) > 0
    for leaf in range(len(tree.points)):
        for i in range(LANES):
            k = order[min(LANES * leaf + i, n - 1)]
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
def _fill(points, radii, order, tree):
    """Write all of a tree but where its levels start."""
    _fill_leaves(points, radii, order, tree)
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


def _new_tree(n: int, radii: FloatArray) -> PointTree:
    """Return a tree for n points without anything in it but how it is laid out."""
    leaves = -(-n // LANES)
    counts: list[int] = []
    below = leaves
    while below > 1 or (below == 1 and not counts):
        below = -(-below // LANES)
        counts.append(below)
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    of_all = 0.0 if radii.ndim else float(radii)
    return PointTree(
        np.empty((leaves, 3, LANES)),
        np.empty((leaves if radii.ndim else 0, LANES)),
        np.empty((int(starts[-1]), BOX, LANES)),
        np.empty(leaves * LANES, np.int32),
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
        order = np.arange(n, dtype=np.int32)
        codes, other = np.empty(n, np.int32), np.empty(n, np.int32)
        counts = np.empty(_CELLS + 1, np.int64)
        parts = np.empty((n // _RUN + 1, 2), np.int64)
        given, own = points.view(), np.atleast_1d(radii).view()
        for array in (given, own):
            array.setflags(write=False)  # one type of argument for all
        _sort(given, (codes, order, other, np.empty_like(order)), counts, parts)
        _fill(given, own, order, tree)
    return PlacedPoints(tree, n, _holding.places(tree))

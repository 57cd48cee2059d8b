"""Throw out candidate pairs that a plane across the line of their centres separates.

Boxes along the world's axes meet more often than their bodies, and this shows most of those
pairs to be apart, by a formula without a branch. The exact distance decides the others.

Lanes are the coordinates of one vector, and a spare one.
"""

from __future__ import annotations

import math

from scene_graph_ros.geometry.broadphase.box_vectors import CORNER
from scene_graph_ros.geometry.broadphase.extents import BOX_PART, NUMBERS
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    load_four,
    magnitude,
    merging,
    reordering,
    root,
    smaller,
)
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = ["drop_separated"]

_POSE = 16
"""Numbers of a pose."""

OFFSETS = 3.0
"""How often the sum of an offset's coordinates covers those of it turned, and its own."""

_spare = merging(3, 3, 7, 7)
"""The spare number of the first, twice, and that of the second."""
_front, _back = merging(0, 1, 4, 5), merging(2, 2, 6, 6)
"""The first two coordinates of both, and the third ones."""
_neighbors = reordering(1, 0, 3, 2)


@inlined_kernel
def _sums(a, b):
    """Return the sum of a's coordinates, twice, and that of b's."""
    front = _front(a, b)
    return front + _neighbors(front) + _back(a, b)


@inlined_kernel
def _rows(X_WG, i):
    """Return the three rows of a pose: coordinates of the axes, and one of the origin."""
    at = i * _POSE
    return load_four(X_WG, at), load_four(X_WG, at + 4), load_four(X_WG, at + 8)


@inlined_kernel
def _are_separated(extents, centres, X_WG, i, j, margin):
    """Tell whether the line of centres shows rows i and j to be more than ``margin`` apart.

    Everything is times the distance of the centres. Infinite and nan entries separate nothing.
    """
    c_X, c_Y = load_four(centres, i * CORNER), load_four(centres, j * CORNER)
    between = c_Y - c_X
    u = between[0], between[1], between[2]
    square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    length = math.sqrt(square)
    X, Y = _rows(X_WG, i), _rows(X_WG, j)
    q_X = u[0] * X[0] + u[1] * X[1] + u[2] * X[2]
    q_Y = u[0] * Y[0] + u[1] * Y[1] + u[2] * Y[2]
    at_X, at_Y = i * NUMBERS, j * NUMBERS
    round_X, round_Y = load_four(extents, at_X), load_four(extents, at_Y)
    box_X, box_Y = load_four(extents, at_X + BOX_PART), load_four(extents, at_Y + BOX_PART)
    a, b = round_X * q_X, round_Y * q_Y
    # How far both reach from their centres, times the length.
    flat = _sums(box_X * magnitude(q_X), box_Y * magnitude(q_Y))
    half = root(_sums(a * a, b * b)) + flat + _spare(round_X, round_Y) * length
    half = smaller(half, _spare(c_X, c_Y) * length)
    both = half[0] + half[2]
    # A centre is computed from an origin that is no further out than it and its offset are.
    known = magnitude(c_X) + magnitude(c_Y)
    offsets = _spare(box_X, box_Y)
    coordinates = known[0] + known[1] + known[2] + OFFSETS * (offsets[0] + offsets[2])
    slack = BOX_ROUNDING * (length * (margin + coordinates) + both)
    return square - both > length * margin + slack


@lean_kernel
def drop_separated(extents, centres, X_WG, pairs, count, margin):
    """Keep the pairs, in their order, that the line of centres does not show to be apart.

    Return how many of the first ``count`` are kept; they are moved to the front.

    Args:
        extents: from ``extents.extents_of``, n rows.
        centres: of PlacedRows at the poses.
        X_WG: (n, 4, 4) poses.
        pairs: (k, 2) rows, written to.
        count: at most k.
        margin: in metres; pairs left out are further apart than this.

    """
    kept = 0
    for k in range(count):
        i, j = pairs[k, 0] & LAST_PLACE, pairs[k, 1] & LAST_PLACE
        pairs[kept & LAST_PLACE, 0], pairs[kept & LAST_PLACE, 1] = i, j
        kept += not _are_separated(extents, centres, X_WG, i, j, margin)
    return kept

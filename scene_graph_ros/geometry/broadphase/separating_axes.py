"""Throw out candidate pairs that a plane across the line of their centres separates.

Boxes along the world's axes meet more often than what is in them, and this shows most of those
pairs to be apart, by a formula without a branch. What is left, the exact distance soon finds out.

Lanes are the coordinates of one vector, and a spare one.
"""

from __future__ import annotations

import math

from scene_graph_ros.geometry.broadphase.extents import BALL, BOX_PART, NUMBERS
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    every_four,
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

_POSE, _CENTRE = 16, BALL + 1
"""Numbers of a pose, and of a row of centres."""

_with_one = merging(0, 1, 2, 7)
"""The coordinates of the first, and the spare number of the second."""
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
def _along(X, Y, c_X, c_Y):
    """Return a coordinate in W of the vector between two centres, from rows of poses."""
    part = Y * c_Y - X * c_X
    return (part[0] + part[1]) + (part[2] + part[3])


@inlined_kernel
def _coordinates(X, Y, c_X, c_Y):
    """Return the sum of the sizes of all coordinates that centres are computed from."""
    origins = magnitude(X[0]) + magnitude(X[1]) + magnitude(X[2])
    origins = origins + magnitude(Y[0]) + magnitude(Y[1]) + magnitude(Y[2])
    centres = magnitude(c_X) + magnitude(c_Y)
    return origins[3] + centres[0] + centres[1] + centres[2]


@inlined_kernel
def _are_separated(extents, centres, X_WG, i, j, margin):
    """Tell whether the line of centres shows rows i and j to be more than ``margin`` apart.

    Everything is times the distance of the centres. What is infinite or nan separates nothing.
    """
    X, Y = _rows(X_WG, i), _rows(X_WG, j)
    c_X, c_Y = load_four(centres, i * _CENTRE), load_four(centres, j * _CENTRE)
    one = every_four(1.0)
    to_X, to_Y = _with_one(c_X, one), _with_one(c_Y, one)
    u = (
        _along(X[0], Y[0], to_X, to_Y),
        _along(X[1], Y[1], to_X, to_Y),
        _along(X[2], Y[2], to_X, to_Y),
    )
    square = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
    length = math.sqrt(square)
    q_X = u[0] * X[0] + u[1] * X[1] + u[2] * X[2]
    q_Y = u[0] * Y[0] + u[1] * Y[1] + u[2] * Y[2]
    at_X, at_Y = i * NUMBERS, j * NUMBERS
    round_X, round_Y = load_four(extents, at_X), load_four(extents, at_Y)
    a, b = round_X * q_X, round_Y * q_Y
    flat_X = load_four(extents, at_X + BOX_PART) * magnitude(q_X)
    flat_Y = load_four(extents, at_Y + BOX_PART) * magnitude(q_Y)
    # How far both reach from their centres, times the length.
    half = root(_sums(a * a, b * b)) + _sums(flat_X, flat_Y) + _spare(round_X, round_Y) * length
    half = smaller(half, _spare(c_X, c_Y) * length)
    both = half[0] + half[2]
    slack = BOX_ROUNDING * (length * (margin + _coordinates(X, Y, c_X, c_Y)) + both)
    return square - both > length * margin + slack


@lean_kernel
def drop_separated(extents, centres, X_WG, pairs, count, margin):
    """Keep the pairs, in their order, that the line of centres does not show to be apart.

    Return how many of the first ``count`` are kept; they are moved to the front.

    Args:
        extents: from ``extents.extents_of``, n rows.
        centres: from ``extents.centres_of``.
        X_WG: (n, 4, 4) poses.
        pairs: (k, 2) rows, written to.
        count: at most k.
        margin: in metres; what is left out is further apart than this.

    """
    kept = 0
    for k in range(count):
        i, j = pairs[k, 0] & LAST_PLACE, pairs[k, 1] & LAST_PLACE
        pairs[kept & LAST_PLACE, 0], pairs[kept & LAST_PLACE, 1] = i, j
        kept += not _are_separated(extents, centres, X_WG, i, j, margin)
    return kept

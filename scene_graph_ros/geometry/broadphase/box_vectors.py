"""World-aligned boxes, all axes of the world at a time."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.extents import (
    BALL,
    BOX_PART,
    NUMBERS,
    RADIUS,
    ROUND_PART,
)
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    as_lanes,
    larger,
    load_four,
    load_number,
    magnitude,
    merging,
    root,
    smaller,
    store_lanes,
)
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = ["CORNER", "PlacedRows", "bound_points", "bound_shape", "new_placed_rows"]

CORNER = 4
"""Numbers of a corner of a box, or of a centre: three coordinates, and a spare one. A centre has
the radius of its ball there, a corner what nobody reads."""

_POSE = 16

_FIRST_TWO, _LAST_TWO = merging(0, 4, 1, 5), merging(2, 6, 3, 7)
"""Columns of two rows."""
_COLUMNS = merging(0, 1, 4, 4), merging(2, 3, 5, 5), merging(0, 1, 6, 6), merging(2, 3, 7, 7)
"""Each of the four columns, from two columns of two rows, and a row."""
_X, _Y, _Z, _ORIGIN = _COLUMNS
_WITH_BALL = merging(0, 1, 2, 4 + BALL)
"""The coordinates of a centre in W, and the radius of the ball around it from its row in G."""


class PlacedRows(NamedTuple):
    """The placed rows of a scene, each (n, CORNER)."""

    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    centre: NDArray[np.float64]
    """As ``extents.centres_of``, in W."""


def new_placed_rows(n: int) -> PlacedRows:
    """Return the arrays to write to, all 0."""
    return PlacedRows(*np.zeros((3, n, CORNER)))


@inlined_kernel
def _columns(X, i):
    """Return the axes of G, and its origin, in W; their fourth numbers mean nothing."""
    at = i * _POSE
    x, y, z = load_four(X, at), load_four(X, at + 4), load_four(X, at + 8)
    left, right = _FIRST_TWO(x, y), _LAST_TWO(x, y)
    return (_X(left, z), _Y(left, z), _Z(right, z)), _ORIGIN(right, z)


@inlined_kernel
def _write_box(origin, low, high, placed, i):
    """Write a box that reaches from low to high around its origin, rounded outwards."""
    largest = larger(magnitude(low), magnitude(high))
    slack = (magnitude(origin) + largest) * BOX_ROUNDING
    store_lanes(placed.lower, i * CORNER, (origin + low) - slack)
    store_lanes(placed.upper, i * CORNER, (origin + high) + slack)


@inlined_kernel
def bound_shape(extents, centres, X, i, placed):
    """Write the box and the centre of row i of ``extents``, at the pose ``X[i]``, to PlacedRows.

    The centre is the origin.
    """
    at = i * NUMBERS
    (x, y, z), origin = _columns(X, i)
    round_x = load_number(extents, at + ROUND_PART) * x
    round_y = load_number(extents, at + ROUND_PART + 1) * y
    round_z = load_number(extents, at + ROUND_PART + 2) * z
    half = (
        root(round_x * round_x + round_y * round_y + round_z * round_z)
        + load_number(extents, at + BOX_PART) * magnitude(x)
        + load_number(extents, at + BOX_PART + 1) * magnitude(y)
        + load_number(extents, at + BOX_PART + 2) * magnitude(z)
        + load_number(extents, at + RADIUS)
    )
    _write_box(origin, -half, half, placed, i)
    centre = load_four(centres, i * CORNER)
    store_lanes(placed.centre, i * CORNER, _WITH_BALL(origin, centre))


@inlined_kernel
def bound_points(points, first, last, centres, X, i, placed):
    """Write the box of points (m, 3) in G from first to last, and the centre, as above."""
    axes, origin = _columns(X, i)
    c = load_four(centres, i * CORNER)
    centre = origin + c[0] * axes[0] + c[1] * axes[1] + c[2] * axes[2]
    store_lanes(placed.centre, i * CORNER, _WITH_BALL(centre, c))
    low = as_lanes((math.inf, math.inf, math.inf, math.inf))
    high = -low
    for at in range(3 * first, 3 * last, 3):
        x, y, z = load_number(points, at), load_number(points, at + 1), load_number(points, at + 2)
        along = x * axes[0] + y * axes[1] + z * axes[2]
        low, high = smaller(along, low), larger(along, high)
    _write_box(origin, low, high, placed, i)

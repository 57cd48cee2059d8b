"""World-aligned boxes, all axes of the world at a time."""

import math

from scene_graph_ros.geometry.broadphase.extents import (
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

__all__ = ["CORNER", "bound_points", "bound_shape"]

CORNER = 4
"""Numbers of a corner of a box: three coordinates, and one that nobody reads."""

_POSE = 16

_FIRST_TWO, _LAST_TWO = merging(0, 4, 1, 5), merging(2, 6, 3, 7)
"""Columns of two rows."""
_COLUMNS = merging(0, 1, 4, 4), merging(2, 3, 5, 5), merging(0, 1, 6, 6), merging(2, 3, 7, 7)
"""Each of the four columns, from two columns of two rows, and a row."""
_X, _Y, _Z, _ORIGIN = _COLUMNS


@inlined_kernel
def _columns(X, i):
    """Return the axes of G, and its origin, in W; their fourth numbers mean nothing."""
    at = i * _POSE
    x, y, z = load_four(X, at), load_four(X, at + 4), load_four(X, at + 8)
    left, right = _FIRST_TWO(x, y), _LAST_TWO(x, y)
    return (_X(left, z), _Y(left, z), _Z(right, z)), _ORIGIN(right, z)


@inlined_kernel
def _write_box(origin, low, high, lower, upper, i):
    """Write a box that reaches from low to high around its origin, rounded outwards."""
    largest = larger(magnitude(low), magnitude(high))
    slack = (magnitude(origin) + largest) * BOX_ROUNDING
    store_lanes(lower, i * CORNER, (origin + low) - slack)
    store_lanes(upper, i * CORNER, (origin + high) + slack)


@inlined_kernel
def bound_shape(extents, X, i, lower, upper):
    """Write the box of row i of ``extents``, at the pose ``X[i]``, to (n, 4) corners."""
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
    _write_box(origin, -half, half, lower, upper, i)


@inlined_kernel
def bound_points(points, first, last, X, i, lower, upper):
    """Write the box of points (m, 3) in G from first to last, at the pose ``X[i]``."""
    axes, origin = _columns(X, i)
    low = as_lanes((math.inf, math.inf, math.inf, math.inf))
    high = -low
    for at in range(3 * first, 3 * last, 3):
        x, y, z = load_number(points, at), load_number(points, at + 1), load_number(points, at + 2)
        along = x * axes[0] + y * axes[1] + z * axes[2]
        low, high = smaller(along, low), larger(along, high)
    _write_box(origin, low, high, lower, upper, i)

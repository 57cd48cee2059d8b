"""World-aligned boxes, all axes of the world at a time."""

import numpy as np

from scene_graph_ros.geometry.broadphase.extents import (
    BOX_PART,
    NUMBERS,
    RADIUS,
    ROUND_PART,
)
from scene_graph_ros.geometry.compiled.code import ARRAY, generated, PLACE
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = ["CORNER", "bound_points", "bound_shape"]

CORNER = 4
"""Numbers of a corner of a box: three coordinates, and one that nobody reads."""

_POSE = 16


def _columns(code, pose):
    """Return the axes of G, and its origin, in W; their fourth numbers mean nothing."""
    rows = [pose.vector(4 * row, 4) for row in range(3)]
    left = code.merged(rows[0], rows[1], (0, 4, 1, 5))
    right = code.merged(rows[0], rows[1], (2, 6, 3, 7))
    return [
        code.merged(part, rows[2], places)
        for part, places in (
            (left, (0, 1, 4, 4)),
            (left, (2, 3, 5, 5)),
            (right, (0, 1, 6, 6)),
            (right, (2, 3, 7, 7)),
        )
    ]


def _write_box(code, origin, low, high, lower, upper):
    """Write a box that reaches from low to high around its origin, rounded outwards."""
    largest = code.larger(code.magnitude(low), code.magnitude(high))
    slack = (code.magnitude(origin) + largest) * BOX_ROUNDING
    below = (origin + low) - slack
    above = (origin + high) + slack
    lower.write(0, below)
    upper.write(0, above)


def _write_plainly(X, low, high, i, lower, upper):
    origin = X[i, :3, 3]
    slack = BOX_ROUNDING * (abs(origin) + np.maximum(abs(low), abs(high)))
    lower[i, :3], upper[i, :3] = origin + low - slack, origin + high + slack


def _bound_shape_plainly(extents, X, i, lower, upper):
    R, row = X[i, :3, :3], extents[i]
    across = R * row[ROUND_PART : ROUND_PART + 3]
    half = np.sqrt((across * across).sum(axis=1)) + row[RADIUS]
    half += abs(R) @ row[BOX_PART : BOX_PART + 3]
    _write_plainly(X, -half, half, i, lower, upper)


def _bound_points_plainly(points, first, last, X, i, lower, upper):
    along = points[first:last] @ X[i, :3, :3].T
    _write_plainly(X, along.min(axis=0), along.max(axis=0), i, lower, upper)


@generated(ARRAY, ARRAY, PLACE, ARRAY, ARRAY, plain=_bound_shape_plainly)
def bound_shape(code, extents, X, i, lower, upper):
    """Write the box of row i of ``extents``, at the pose ``X[i]``, to (n, 4) corners."""
    row = extents.start(i * NUMBERS)
    *axes, origin = _columns(code, X.start(i * _POSE))

    def number(place):
        return code.repeated(row.number(place), 4)

    def scaled(first, vectors):
        return [number(first + k) * vector for k, vector in enumerate(vectors)]

    across = scaled(ROUND_PART, axes)
    half = code.sum(
        [
            code.square_root(code.sum([vector * vector for vector in across])),
            *scaled(BOX_PART, [code.magnitude(axis) for axis in axes]),
            number(RADIUS),
        ]
    )
    _write_box(code, origin, -half, half, lower.start(i * CORNER), upper.start(i * CORNER))


@generated(ARRAY, PLACE, PLACE, ARRAY, PLACE, ARRAY, ARRAY, plain=_bound_points_plainly)
def bound_points(code, points, first, last, X, i, lower, upper):
    """Write the box of points (m, 3) in G from first to last, at the pose ``X[i]``."""
    points = points.start(first * 3)
    *axes, origin = _columns(code, X.start(i * _POSE))
    low, high = code.kept(code.numbers(*[np.inf] * 4)), code.kept(code.numbers(*[-np.inf] * 4))
    with code.loop(last - first) as k:
        point = points.start(k * 3)
        coordinates = [code.repeated(point.number(axis), 4) for axis in range(3)]
        along = code.dot(coordinates, axes)
        low.write(code.smaller(along, low.read()))
        high.write(code.larger(along, high.read()))
    corners = (lower.start(i * CORNER), upper.start(i * CORNER))
    _write_box(code, origin, low.read(), high.read(), *corners)

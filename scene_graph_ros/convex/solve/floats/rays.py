"""Rays from an inner point, and the rows that they surely meet alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.solve.floats.row_tests import moved
from scene_graph_ros.convex.solve.floats.unit_rows import beyond, holds
from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["Body", "shoot", "turn"]

_ON_RAY = 4.0 * EPSILON
"""Relative to the numbers in a row, for each of them: rounding of a slack along a ray."""


class Body(NamedTuple):
    """Unit rows ``(m, n)``, their columns ``(n, m)``, sides and lengths; a point inside.

    ``slacks (m,)`` are those of the point, ``tol`` is the distance that rows are moved out by;
    ``rates (m,)`` and ``far (n,)`` are room.
    """

    rows: np.ndarray
    columns: np.ndarray
    sides: np.ndarray
    lengths: np.ndarray
    tol: float
    x0: np.ndarray
    slacks: np.ndarray
    rates: np.ndarray
    far: np.ndarray


@lean_kernel
def _first_met(columns, slacks, way, rates):
    """Return the row that a ray meets first, -1 for none, and how far it and the second are."""
    n, m = columns.shape
    for i in range(m):
        rates[i] = 0.0
    for k in range(n):
        column, step = columns[k], way[k]
        for i in range(m):
            rates[i] += column[i] * step
    first, nearest, second = -1, np.inf, np.inf
    for i in range(m):
        if rates[i] > 0.0 and slacks[i] < second * rates[i]:
            distance = slacks[i] / rates[i]
            if distance < nearest:
                first, nearest, second = i, distance, nearest
            else:
                second = distance
    return first, nearest, second


@lean_kernel
def _is_met_alone(body, way, first, nearest, second):
    """Tell whether a point of a ray is surely beyond its first row, moved out, and no other."""
    n, sides = len(way), body.sides
    step = 0.5 * (nearest + min(second, 2.0 * nearest))
    far, size = body.far, 0.0
    for k in range(n):
        far[k] = body.x0[k] + step * way[k]
        size += abs(body.x0[k]) + step * abs(way[k])
    above = moved(sides[first], body.tol, body.lengths[first], 1.0)
    if not beyond(body.rows[first], above, far):
        return False
    # Of its slack each other row has left a share by which it is further than the point.
    share = 1.0 - step / second
    for i in range(len(sides)):
        if i != first and share * body.slacks[i] <= _ON_RAY * (n + 4) * (abs(sides[i]) + size):
            return holds(body.columns, sides, len(sides), first, far)
    return True


@lean_kernel
def shoot(body, way, is_sure):
    """Return the row that a ray meets first, -1 for none, and whether that is newly marked.

    It is marked where no other row cuts off some point beyond it: it is needed.
    """
    first, nearest, second = _first_met(body.columns, body.slacks, way, body.rates)
    if first < 0 or is_sure[first]:
        return first, False
    is_sure[first] = _is_met_alone(body, way, first, nearest, second)
    return first, is_sure[first]


@lean_kernel
def turn(body, i, first, way):
    """Turn a ray towards a row and away from that which it met first (Rosenblatt 1958).

    A row is met first where its normal over its slack reaches furthest along the ray.
    """
    share = body.slacks[i] / body.slacks[first]
    for k in range(len(way)):
        way[k] += body.rows[i, k] - share * body.rows[first, k]

"""Pairs of bodies that are near at configurations, and how each velocity changes their distance.

Witness points are stationary to first order (envelope theorem): a distance changes as the bodies'
own points there move along the normal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.tables.holding import Holding
from scene_graph_ros.planning.bodies import (
    BodyTable,
    distance_at,
    PairTable,
    place_bodies,
    Places,
)
from scene_graph_ros.planning.separation_kernels import separation
from scene_graph_ros.planning.still_kernels import find_near
from scene_graph_ros.planning.still_tree import StillNodes
from scene_graph_ros.robots.tree_kernels import FLOATING, LANES, PLANAR, PRISMATIC, TreeTable

__all__ = ["NearTable", "near_distances", "near_places"]

_FEWEST = 128
"""Nodes of a tree that is worth it for a single configuration."""

_MARGIN = 1.0 + 1e-12
"""Times squared distances of balls: far more than rounding adds."""


class NearTable(NamedTuple):
    """All that the kernel reads, and what one thread writes to."""

    tree: TreeTable
    bodies: BodyTable
    pairs: PairTable
    X_WB: np.ndarray
    """``(4, 4)``."""
    places: Places
    """Where the bodies that do not move are is there already."""
    rows: np.ndarray
    """``(p,)``: pairs that were found."""
    distances: np.ndarray
    """``(p,)`` metres, less the padding."""
    gradients: np.ndarray
    """``(p, nv)``: derivatives of the distances by the velocities."""


def _example() -> NearTable:
    rows, flags, numbers = np.zeros(1, np.int64), np.zeros(1, np.bool_), np.zeros(1)
    poses, points = np.zeros((1, 3, 4)), np.zeros((1, 3))
    tree = TreeTable(rows, rows, poses, rows, rows, numbers, numbers, rows, poses)
    nodes = StillNodes(points, numbers, rows, rows)
    bodies = BodyTable(rows, rows, poses, poses, points, numbers, points, points, 0, nodes)
    table = np.zeros((1, 1), np.int64)
    two = np.zeros((1, 2), np.int64)
    pairs = PairTable(two, flags, numbers, numbers, rows, rows, table, numbers)
    lanes = np.zeros((1, 12, LANES))
    marks = rows.view(np.int8)
    places = Places(lanes, points, lanes, lanes, numbers, numbers, numbers, rows, marks, rows)
    return NearTable(tree, bodies, pairs, points, places, rows, numbers, points)


_holding = Holding("a table of pairs", _example)
_borrowed, near_places = _holding.borrowed, _holding.places


@inlined_kernel
def _to_world(X, v, place, k):
    """Return what a vector, or a point where ``place`` is 1, of a body's frame is in W."""
    return (
        X[0, k] * v[0] + X[1, k] * v[1] + X[2, k] * v[2] + place * X[3, k],
        X[4, k] * v[0] + X[5, k] * v[1] + X[6, k] * v[2] + place * X[7, k],
        X[8, k] * v[0] + X[9, k] * v[1] + X[10, k] * v[2] + place * X[11, k],
    )


@inlined_kernel
def _rates(p, X, ax, ay, az, nhat, sign, k):
    """Return how fast p goes along the normal where it turns about an axis, and slides along it.

    A point that turns about the axis a at r goes along the normal by a . (r x normal).
    """
    rx, ry, rz = p[0] - X[3, k], p[1] - X[7, k], p[2] - X[11, k]
    turn = (
        ax * (ry * nhat[2] - rz * nhat[1])
        + ay * (rz * nhat[0] - rx * nhat[2])
        + az * (rx * nhat[1] - ry * nhat[0])
    )
    return sign * turn, sign * (ax * nhat[0] + ay * nhat[1] + az * nhat[2])


@inlined_kernel
def _add_rates(tree, joint, X_WJ, p, nhat, sign, gradient, k):
    """Add how fast a point that a joint and those below move goes along the normal, in W."""
    while joint > 0:
        kind, column = tree.kinds[joint], tree.velocity_starts[joint]
        X = X_WJ[joint]
        if kind in (FLOATING, PLANAR):
            # The axes along which it slides are those that it has before it turns.
            before, X_PJ = X_WJ[tree.parents[joint]], tree.X_PJ[joint]
            for axis in range(3):
                u, v, w = X_PJ[0, axis], X_PJ[1, axis], X_PJ[2, axis]
                ax = before[0, k] * u + before[1, k] * v + before[2, k] * w
                ay = before[4, k] * u + before[5, k] * v + before[6, k] * w
                az = before[8, k] * u + before[9, k] * v + before[10, k] * w
                turn, slide = _rates(p, X, ax, ay, az, nhat, sign, k)
                if kind == PLANAR:
                    gradient[column + axis] += slide if axis < 2 else turn
                else:
                    gradient[column + axis] += turn
                    gradient[column + 3 + axis] += slide
        else:
            turn, slide = _rates(p, X, X[2, k], X[6, k], X[10, k], nhat, sign, k)
            gradient[column] += tree.multipliers[joint] * (slide if kind == PRISMATIC else turn)
        joint = tree.parents[joint]


@inlined_kernel
def _may_be_near(bodies, a, b, places, limit, k):
    """Tell whether two bodies may be as near as ``limit`` (m): balls first, then boxes."""
    A, B = places.centers[a], places.centers[b]
    x, y, z = A[0, k] - B[0, k], A[1, k] - B[1, k], A[2, k] - B[2, k]
    reach = bodies.radii[a] + bodies.radii[b] + limit
    if reach < 0.0 or x * x + y * y + z * z > reach * reach * _MARGIN:
        return False
    distance, _ = separation(bodies, a, b, places, k)
    return distance <= limit


@inlined_kernel
def _write_row(held, table, p, k, influence, row):
    """Write a pair that may be near in configuration k to the table; tell whether it is."""
    tree, bodies, pairs, places = table.tree, table.bodies, table.pairs, table.places
    a, b, limit = pairs.bodies[p, 0], pairs.bodies[p, 1], influence + pairs.paddings[p]
    phi, p_ACa, p_ACb, nhat_A, _, _, _ = distance_at(
        held, bodies, pairs, p, k, places, max(limit, 0.0), 0.0
    )
    if not phi <= limit:
        return False
    if pairs.swaps[p]:
        a, b = b, a
    robots, X_WA = len(bodies.joints), places.X_WG[a]
    nhat = _to_world(X_WA, nhat_A, 0.0, k)
    gradient = table.gradients[row]
    gradient[:] = 0.0
    if a < robots:
        p_WCa = _to_world(X_WA, p_ACa, 1.0, k)
        _add_rates(tree, bodies.joints[a], places.X_WJ, p_WCa, nhat, 1.0, gradient, k)
    if b < robots:
        p_WCb = _to_world(X_WA, p_ACb, 1.0, k)
        _add_rates(tree, bodies.joints[b], places.X_WJ, p_WCb, nhat, -1.0, gradient, k)
    table.rows[row], table.distances[row] = p, phi - pairs.paddings[p]
    return True


@lean_kernel
def near_distances(held, near, q, influence, counts):
    """Write the pairs that are near at each of q ``(n, nq)`` to a table, and ``counts`` ``(n,)``.

    Near are those that are at most ``influence`` (m) farther apart than their padding. ``near`` is
    a NearTable that was written down. Returns for how many configurations there was room in it, at
    least one.
    """
    table = _borrowed(near)
    bodies, pairs, places = table.bodies, table.pairs, table.places
    row = 0
    for a in range(len(bodies.joints)):
        places.limits[a] = influence + pairs.most_paddings[a]
    for first in range(0, len(q), LANES):
        place_bodies(table.tree, bodies, q, first, table.X_WB, places)
        near_ones = find_near(bodies, pairs, places, _FEWEST)
        for k in range(min(LANES, len(q) - first)):
            if len(table.rows) - row < len(pairs.bodies):
                return first + k
            begin = row
            for i in range(near_ones):
                p = places.near[i] if near_ones < len(pairs.bodies) else i
                a, b, limit = pairs.bodies[p, 0], pairs.bodies[p, 1], influence + pairs.paddings[p]
                if _may_be_near(bodies, a, b, places, limit, k) and _write_row(
                    held, table, p, k, influence, row
                ):
                    row += 1
            counts[first + k] = row - begin
    return len(q)

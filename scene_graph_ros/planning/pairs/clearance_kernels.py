"""Pairs of bodies that are near at configurations, and how each velocity changes their distance.

Witness points are stationary to first order (envelope theorem): a distance changes as the bodies'
own points there move along the normal.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import load_number, store_lanes
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.tables.holding import Holding
from scene_graph_ros.planning.pairs.bodies import (
    BodyTable,
    PairTable,
    place_bodies,
    Places,
)
from scene_graph_ros.planning.pairs.pair_measure import pair_distance
from scene_graph_ros.planning.pairs.separation_kernels import separation
from scene_graph_ros.planning.pairs.separation_lanes import place_cover, pose_in_cover, separations
from scene_graph_ros.planning.pairs.static_kernels import find_near
from scene_graph_ros.planning.pairs.static_tree import StaticNodes
from scene_graph_ros.robots.joint_chains import add_rates, JointChains, place_axes
from scene_graph_ros.robots.tree_kernels import LANES, TreeTable

__all__ = ["NearTable", "near_distances", "near_places"]

_FEWEST = 128
"""Nodes of a tree that is worth it for a single configuration."""

_MARGIN = 1.0 + 1e-12
"""Times squared distances of balls: far more than rounding adds."""


class NearTable(NamedTuple):
    """The kernel's inputs, and the scratch arrays of one thread."""

    tree: TreeTable
    chains: JointChains
    axes: np.ndarray
    """Of the tree's freedoms in a configuration (``joint_chains``)."""
    bodies: BodyTable
    pairs: PairTable
    X_WB: np.ndarray
    """``(4, 4)``."""
    places: Places
    """Where the bodies that do not move are is there already."""
    covers: np.ndarray
    """What is known of bodies (``separation_lanes``); where those are that do not move, is there
    already."""
    starts: np.ndarray
    """``(2 p,)``: where what is known of each pair's bodies begins, in the scene's order."""
    shapes: np.ndarray
    """``(2 p,)``: rows of the shape table, in that order."""
    joints: np.ndarray
    """``(2 p,)``: which joints move them, 0 for none."""
    reaches: np.ndarray
    """``(p,)`` metres: both balls' radii and the padding."""
    close: np.ndarray
    """``(p + LANES,)``: pairs that are close in a configuration, by their balls and boxes."""
    bounds: np.ndarray
    """``(LANES,)``: scratch."""
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
    nodes = StaticNodes(points, numbers, rows, rows)
    bodies = BodyTable(rows, rows, poses, poses, points, numbers, points, points, points, 0, nodes)
    table = np.zeros((1, 1), np.int64)
    two = np.zeros((1, 2), np.int64)
    pairs = PairTable(two, flags, numbers, numbers, rows, rows, table, numbers)
    lanes = np.zeros((1, 12, LANES))
    marks = rows.view(np.int8)
    places = Places(lanes, points, lanes, lanes, numbers, numbers, numbers, rows, marks, rows)
    return NearTable(
        tree,
        JointChains(rows, rows, flags, rows, rows, rows, numbers, numbers, rows),
        axes=numbers,
        bodies=bodies,
        pairs=pairs,
        X_WB=points,
        places=places,
        covers=numbers,
        starts=rows,
        shapes=rows,
        joints=rows,
        reaches=numbers,
        close=rows,
        bounds=numbers,
        rows=rows,
        distances=numbers,
        gradients=points,
    )


_holding = Holding("a table of pairs", _example)
_borrowed, near_places = _holding.borrowed, _holding.places


@inlined_kernel
def _find_by_balls(table, influence, near_ones):
    """Write which pairs' balls are near enough; return how many.

    Of fewer than all pairs ``places.near`` says which may be near.
    """
    covers, starts, close, count = table.covers, table.starts, table.close, 0
    is_some = near_ones < len(table.reaches)
    for i in range(near_ones):
        p = table.places.near[i] if is_some else i
        a, b = starts[2 * p & LAST_PLACE] + 12, starts[2 * p + 1 & LAST_PLACE] + 12
        x = load_number(covers, a) - load_number(covers, b)
        y = load_number(covers, a + 1) - load_number(covers, b + 1)
        z = load_number(covers, a + 2) - load_number(covers, b + 2)
        reach = load_number(table.reaches, p) + influence
        close[count & LAST_PLACE] = p
        count += reach >= 0.0 and x * x + y * y + z * z <= reach * reach * _MARGIN
    return count


@inlined_kernel
def _starts_of_eight(starts, close, first, side):
    """Return the first rows of the covers of A, or B, of eight pairs."""
    return (
        starts[2 * close[first & LAST_PLACE] + side & LAST_PLACE],
        starts[2 * close[first + 1 & LAST_PLACE] + side & LAST_PLACE],
        starts[2 * close[first + 2 & LAST_PLACE] + side & LAST_PLACE],
        starts[2 * close[first + 3 & LAST_PLACE] + side & LAST_PLACE],
        starts[2 * close[first + 4 & LAST_PLACE] + side & LAST_PLACE],
        starts[2 * close[first + 5 & LAST_PLACE] + side & LAST_PLACE],
        starts[2 * close[first + 6 & LAST_PLACE] + side & LAST_PLACE],
        starts[2 * close[first + 7 & LAST_PLACE] + side & LAST_PLACE],
    )


@inlined_kernel
def _find_by_boxes(bodies, pairs, table, influence, count, k):
    """Keep those of ``count`` pairs whose boxes are near enough, too; return how many."""
    close, covers, bounds, kept = table.close, table.covers, table.bounds, 0
    for i in range(count, count + LANES):
        close[i] = 0
    for first in range(0, count, LANES):
        at_A = _starts_of_eight(table.starts, close, first, 0)
        at_B = _starts_of_eight(table.starts, close, first, 1)
        store_lanes(bounds, 0, separations(covers, at_A, at_B))
        for i in range(min(LANES, count - first)):
            p = close[first + i & LAST_PLACE]
            least = load_number(bounds, i)
            if load_number(table.reaches, p) == math.inf:
                a, b = pairs.bodies[p, 0], pairs.bodies[p, 1]
                least, _ = separation(bodies, a, b, table.places, k)
            close[kept & LAST_PLACE] = p
            kept += least <= influence + load_number(pairs.paddings, p)
    return kept


@inlined_kernel
def _write_row(held, table, p, influence, row):
    """Write a pair that may be near to the table; tell whether it is.

    In the order in which the scene's own queries ask, so that they cannot disagree.
    """
    covers, chains, axes = table.covers, table.chains, table.axes
    first, second = 2 * p & LAST_PLACE, 2 * p + 1 & LAST_PLACE
    limit = influence + load_number(table.pairs.paddings, p)
    arguments = (
        held,
        table.shapes[first],
        table.shapes[second],
        pose_in_cover(covers, table.starts[first]),
        pose_in_cover(covers, table.starts[second]),
        max(limit, 0.0),
        0.0,
    )
    phi, p_WCa, p_WCb, nhat, _ = pair_distance(table.bodies.measure, arguments)
    if not phi <= limit:
        return False
    gradient = table.gradients[row]
    gradient[:] = 0.0
    add_rates(chains, axes, table.joints[first], p_WCa, nhat, 1.0, table.bounds, gradient)
    add_rates(chains, axes, table.joints[second], p_WCb, nhat, -1.0, table.bounds, gradient)
    table.rows[row], table.distances[row] = p, phi - load_number(table.pairs.paddings, p)
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
            for a in range(len(bodies.joints)):
                place_cover(places, a, k, table.covers)
            close = _find_by_balls(table, influence, near_ones)
            close = _find_by_boxes(bodies, pairs, table, influence, close, k)
            if close > 0:
                place_axes(table.tree, table.chains, places.X_WJ, k, table.axes)
            for i in range(close):
                row += _write_row(held, table, table.close[i], influence, row)
            counts[first + k] = row - begin
    return len(q)

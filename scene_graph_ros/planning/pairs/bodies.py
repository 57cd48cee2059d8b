"""The geometries of robots and of their surroundings, placed for eight configurations.

A body is a geometry with the proximity role. Each is in a ball and in a box, from which follows a
distance that it certainly keeps from another one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, merged_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    all_of,
    every,
    larger,
    load_lanes,
    root,
    smaller,
    store_lanes,
)
from scene_graph_ros.geometry.tables.held_table import borrowed_table
from scene_graph_ros.planning.pairs.pair_measure import pair_distance
from scene_graph_ros.planning.pairs.static_kernels import least_of, WORD
from scene_graph_ros.planning.pairs.static_tree import StaticNodes
from scene_graph_ros.robots.tree_kernels import compose_lanes, LANES, place_joints, TreeTable

__all__ = [
    "BodyTable",
    "CheckedTables",
    "PairTable",
    "Places",
    "distance_at",
    "new_places",
    "place_bodies",
    "place_static_bodies",
    "sure_distances",
]


class BodyTable(NamedTuple):
    """The table of bodies: those of robots first, then those that do not move."""

    rows: np.ndarray
    """``(b,)`` rows of the shape table."""
    joints: np.ndarray
    """``(r,)`` rows of the joints that move the robots' bodies."""
    X_JG: np.ndarray
    """``(r, 3, 4)``: robots' bodies in their joints' frames."""
    X_WG: np.ndarray
    """``(b - r, 3, 4)``: bodies that do not move."""
    centers: np.ndarray
    """``(b, 3)``: the ball's centre in G."""
    radii: np.ndarray
    """``(b,)``: infinite for a half space."""
    lower: np.ndarray
    """``(b, 3)``: the box's corners in G."""
    upper: np.ndarray
    """``(b, 3)``."""
    inner: np.ndarray
    """``(b, INNER)``: what is inside each."""
    measure: int
    """The address of what measures pairs, see ``pair_measure``."""
    nodes: StaticNodes
    """Of those that do not move, but half spaces; none where they are few."""


class PairTable(NamedTuple):
    """The pairs that may not touch; A is of a robot."""

    bodies: np.ndarray
    """``(p, 2)``."""
    swaps: np.ndarray
    """``(p,)``: whether B's row is the first of the two in the scene's own queries."""
    paddings: np.ndarray
    """``(p,)`` metres."""
    touching: np.ndarray
    """``(p,)`` metres: what is no deeper in the padding than this only touches."""
    shared: np.ndarray
    """``(p,)``: the last joint that moves A and B alike, 0 where there is none."""
    others: np.ndarray
    """Pairs that the tree of what does not move does not find."""
    of_still: np.ndarray
    """``(r, b)``: the pair of each robot's body with each in that tree, or -1."""
    most_paddings: np.ndarray
    """``(r,)`` metres: the largest padding of a robot's body with any in that tree."""


class CheckedTables(NamedTuple):
    """The kernels' tables of checked pairs."""

    held: np.ndarray
    """Where the scene's shape table is."""
    tree: TreeTable
    bodies: BodyTable
    pairs: PairTable
    reaches: np.ndarray
    """``(r,)`` metres: the largest distance of a robot body's points from its joint's origin."""
    X_WB: np.ndarray
    """``(4, 4)``: the robots' root link."""


class Places(NamedTuple):
    """Scratch of one thread."""

    X_WJ: np.ndarray
    work: np.ndarray
    X_WG: np.ndarray
    centers: np.ndarray
    sure: np.ndarray
    limits: np.ndarray
    """``(r,)`` metres: what counts as near of a robot's body."""
    slacks: np.ndarray
    """``(r,)`` metres: how much farther away than that all are that are not near."""
    near: np.ndarray
    """``(p,)``: pairs that may be near."""
    marks: np.ndarray
    """Of each pair a byte, 0 but while these are found."""
    words: np.ndarray
    """The same bytes as numbers."""


def new_places(joints: int, robots: int, bodies: int, pairs: int) -> Places:
    """Return scratch for trees, bodies of robots, all bodies, and pairs of this size."""
    words = np.zeros(-(-pairs // WORD), np.int64)
    return Places(
        np.empty((joints, 12, LANES)),
        np.empty((3, LANES)),
        np.empty((bodies, 12, LANES)),
        np.empty((bodies, 3, LANES)),
        np.empty(LANES),
        np.empty(robots),
        np.empty(robots),
        np.arange(pairs),
        words.view(np.int8),
        words,
    )


@inlined_kernel
def _place_center(bodies, b, places):
    """Write where the centre of a body's ball is."""
    X, center, out = places.X_WG[b], bodies.centers[b], places.centers[b]
    x, y, z = center[0], center[1], center[2]
    for row in range(3):
        at = 4 * row * LANES
        ax, by = load_lanes(X, at) * x, load_lanes(X, at + LANES) * y
        cz, d = load_lanes(X, at + 2 * LANES) * z, load_lanes(X, at + 3 * LANES)
        store_lanes(out, row * LANES, ax + by + cz + d)


@inlined_kernel
def place_static_bodies(bodies, places):
    """Write where the bodies are that do not move."""
    robots = len(bodies.joints)
    for b in range(robots, len(bodies.rows)):
        for i in range(12):
            for k in range(LANES):
                places.X_WG[b, i, k] = bodies.X_WG[b - robots, i // 4, i % 4]
        _place_center(bodies, b, places)


@inlined_kernel
def place_bodies(tree, bodies, q, first, X_WB, places):
    """Write where the robots' bodies are for LANES configurations from ``first`` on."""
    place_joints(tree, q, first, X_WB, places.X_WJ, places.work)
    for b in range(len(bodies.joints)):
        compose_lanes(places.X_WJ[bodies.joints[b]], bodies.X_JG[b], places.X_WG[b])
        _place_center(bodies, b, places)


@inlined_kernel
def _from_box(bodies, a, b, places):
    """Return the distances of A's ball from B's box, for LANES configurations.

    Where its centre is in the box, the distance is that to the nearest face, negative.
    """
    X, center = places.X_WG[b], places.centers[a]
    lower, upper = bodies.lower[b], bodies.upper[b]
    x = load_lanes(center, 0) - load_lanes(X, 3 * LANES)
    y = load_lanes(center, LANES) - load_lanes(X, 7 * LANES)
    z = load_lanes(center, 2 * LANES) - load_lanes(X, 11 * LANES)
    square, farthest = every(0.0), every(-math.inf)
    for i in range(3):
        along = load_lanes(X, i * LANES) * x + load_lanes(X, (4 + i) * LANES) * y
        along = along + load_lanes(X, (8 + i) * LANES) * z
        beyond = larger(lower[i] - along, along - upper[i])
        farthest, beyond = larger(farthest, beyond), larger(beyond, 0.0)
        square = square + beyond * beyond
    return root(square) + smaller(farthest, 0.0) - bodies.radii[a]


@inlined_kernel
def _between_centers(a, b, places):
    """Return the squared distances of two balls' centres, for LANES configurations."""
    center, other = places.centers[a], places.centers[b]
    x = load_lanes(center, 0) - load_lanes(other, 0)
    y = load_lanes(center, LANES) - load_lanes(other, LANES)
    z = load_lanes(center, 2 * LANES) - load_lanes(other, 2 * LANES)
    return x * x + y * y + z * z


@inlined_kernel
def sure_distances(bodies, a, b, places, enough):
    """Return the least distance of two bodies of LANES configurations where balls tell ``enough``.

    Else -inf, and ``places.sure`` has lower bounds of each, -inf where nothing is sure. No
    more is found out than that it is ``enough``.
    """
    radii = bodies.radii[a] + bodies.radii[b]
    squares = _between_centers(a, b, places)
    least = math.sqrt(least_of(squares)) - radii
    if least >= enough:
        return least
    sure = larger(_from_box(bodies, a, b, places), root(squares) - radii)
    if bodies.radii[b] < math.inf and not all_of(sure >= enough):
        sure = larger(_from_box(bodies, b, a, places), sure)
    store_lanes(places.sure, 0, sure)
    return -math.inf


@inlined_kernel
def _pose_of(X, k):
    rotation = (
        X[0, k], X[1, k], X[2, k], X[4, k], X[5, k], X[6, k], X[8, k], X[9, k], X[10, k]
    )  # fmt: skip
    return rotation, (X[3, k], X[7, k], X[11, k])


@merged_kernel
def distance_at(held, bodies, pairs, p, k, places, max_distance, tolerance):
    """Return the answer of the measuring function about one in configuration k.

    In the order in which the scene's own queries ask, so that they cannot disagree.
    """
    table = borrowed_table(held)
    a, b = pairs.bodies[p, 0], pairs.bodies[p, 1]
    if pairs.swaps[p]:
        a, b = b, a
    X_WA, X_WB = _pose_of(places.X_WG[a], k), _pose_of(places.X_WG[b], k)
    i, j = bodies.rows[a], bodies.rows[b]
    size = max(table.scale[i], table.scale[j])
    arguments = held, i, j, X_WA, X_WB, max_distance, tolerance * size
    return pair_distance(bodies.measure, arguments)

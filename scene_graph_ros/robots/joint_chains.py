"""How fast points that joints move go along a direction, eight of the joints' freedoms in step.

A freedom is one velocity of a joint: it turns about an axis, or slides along one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    as_lanes,
    LANES,
    load_lanes,
    load_number,
    store_lanes,
)
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, PRISMATIC, TreeTable

__all__ = ["AXIS", "JointChains", "add_rates", "joint_chains", "place_axes"]

AXIS = 6
"""Numbers of a freedom: its axis in W, and a point of it, which is its joint's place."""


class JointChains(NamedTuple):
    """The freedoms of a tree, and of each joint those of its chain, from it down to the base."""

    joints: NDArray[np.int64]
    """``(f,)``: the joint of each freedom."""
    axes: NDArray[np.int64]
    """``(f,)``: which axis of the joint's frame."""
    is_before: NDArray[np.bool_]
    """``(f,)``: whether that is the axis which it has before the joint has moved."""
    starts: NDArray[np.int64]
    """``(j,)``: where a joint's chain begins in the columns below, each filled up to LANES."""
    counts: NDArray[np.int64]
    """``(j,)``."""
    places: NDArray[np.int64]
    """``(n,)``: AXIS times the freedom."""
    turns: NDArray[np.float64]
    """``(n,)``: how much it turns for a unit of velocity."""
    slides: NDArray[np.float64]
    """``(n,)``: how much it slides."""
    columns: NDArray[np.int64]
    """``(n,)``: which velocity it is."""


class _Freedom(NamedTuple):
    axis: int
    is_before: bool
    turn: float
    slide: float
    column: int


def _freedoms(kind: int, multiplier: float, column: int) -> list[_Freedom]:
    """Return those of a joint whose velocities begin at a column."""
    if kind == PLANAR:
        slides = [_Freedom(axis, True, 0.0, 1.0, column + axis) for axis in range(2)]
        return [*slides, _Freedom(2, True, 1.0, 0.0, column + 2)]
    if kind == FLOATING:
        turns = [_Freedom(axis, True, 1.0, 0.0, column + axis) for axis in range(3)]
        return turns + [_Freedom(axis, True, 0.0, 1.0, column + 3 + axis) for axis in range(3)]
    if kind == PRISMATIC:
        return [_Freedom(2, False, 0.0, multiplier, column)]
    return [_Freedom(2, False, multiplier, 0.0, column)]


def joint_chains(tree: TreeTable) -> JointChains:
    """Return the chains of a tree's joints."""
    own: list[list[int]] = [[]]
    freedoms: list[_Freedom] = []
    joints: list[int] = []
    for joint in range(1, len(tree.kinds)):
        found = _freedoms(
            int(tree.kinds[joint]),
            float(tree.multipliers[joint]),
            int(tree.velocity_starts[joint]),
        )
        own.append(list(range(len(freedoms), len(freedoms) + len(found))))
        freedoms += found
        joints += [joint] * len(found)
    chains: list[list[int]] = [[]]
    for joint in range(1, len(tree.kinds)):
        chains.append(own[joint] + chains[int(tree.parents[joint])])
    counts = np.array([len(chain) for chain in chains], dtype=np.int64)
    rooms = -(-counts // LANES) * LANES
    starts = np.cumsum(rooms) - rooms
    listed = np.zeros(int(rooms.sum()), np.int64)
    is_listed = np.zeros(len(listed), np.bool_)
    for start, chain in zip(starts, chains, strict=True):
        listed[start : start + len(chain)] = chain
        is_listed[start : start + len(chain)] = True
    turns, slides = (
        np.array([getattr(each, name) for each in freedoms], dtype=np.float64)
        for name in ("turn", "slide")
    )
    columns = np.array([each.column for each in freedoms], dtype=np.int64)
    return JointChains(
        np.array(joints, dtype=np.int64),
        np.array([each.axis for each in freedoms], dtype=np.int64),
        np.array([each.is_before for each in freedoms], dtype=np.bool_),
        starts,
        counts,
        AXIS * listed,
        np.where(is_listed, turns[listed], 0.0) if freedoms else np.empty(0),
        np.where(is_listed, slides[listed], 0.0) if freedoms else np.empty(0),
        columns[listed] if freedoms else np.empty(0, np.int64),
    )


@inlined_kernel
def place_axes(tree, chains, X_WJ, k, axes):
    """Write the axes of all freedoms, ``(AXIS f,)``, where joints are at ``X_WJ`` in lane k."""
    for f in range(len(chains.joints)):
        joint, axis, at = chains.joints[f], chains.axes[f], AXIS * f
        X = X_WJ[joint]
        for row in range(3):
            axes[at + row] = X[4 * row + axis, k]
            axes[at + 3 + row] = X[4 * row + 3, k]
        if chains.is_before[f]:
            before, X_PJ = X_WJ[tree.parents[joint]], tree.X_PJ[joint]
            x, y, z = X_PJ[0, axis], X_PJ[1, axis], X_PJ[2, axis]
            for row in range(3):
                a, b, c = before[4 * row, k], before[4 * row + 1, k], before[4 * row + 2, k]
                axes[at + row] = a * x + b * y + c * z


@inlined_kernel
def _of_eight(axes, places, first, i):
    """Return the i-th number of eight freedoms."""
    return as_lanes(
        (
            load_number(axes, places[first & LAST_PLACE] + i),
            load_number(axes, places[first + 1 & LAST_PLACE] + i),
            load_number(axes, places[first + 2 & LAST_PLACE] + i),
            load_number(axes, places[first + 3 & LAST_PLACE] + i),
            load_number(axes, places[first + 4 & LAST_PLACE] + i),
            load_number(axes, places[first + 5 & LAST_PLACE] + i),
            load_number(axes, places[first + 6 & LAST_PLACE] + i),
            load_number(axes, places[first + 7 & LAST_PLACE] + i),
        )
    )


@inlined_kernel
def add_rates(chains, axes, joint, p, n, sign, rates, gradient):
    """Add how fast a point p that a joint and those below move goes along n, times ``sign``.

    For a unit of each velocity, to ``gradient`` ``(nv,)``; all in W. ``rates`` ``(LANES,)`` is
    scratch. A point that turns about the axis a at r goes along n by a . (r x n).
    """
    start, count = chains.starts[joint], chains.counts[joint]
    for first in range(start, start + count, LANES):
        ax, ay, az = (
            _of_eight(axes, chains.places, first, 0),
            _of_eight(axes, chains.places, first, 1),
            _of_eight(axes, chains.places, first, 2),
        )
        rx, ry, rz = (
            p[0] - _of_eight(axes, chains.places, first, 3),
            p[1] - _of_eight(axes, chains.places, first, 4),
            p[2] - _of_eight(axes, chains.places, first, 5),
        )
        turn = ax * (ry * n[2] - rz * n[1])
        turn = turn + ay * (rz * n[0] - rx * n[2]) + az * (rx * n[1] - ry * n[0])
        slide = ax * n[0] + ay * n[1] + az * n[2]
        turns, slides = load_lanes(chains.turns, first), load_lanes(chains.slides, first)
        store_lanes(rates, 0, sign * (turns * turn + slides * slide))
        for i in range(min(LANES, start + count - first)):
            gradient[chains.columns[first + i & LAST_PLACE] & LAST_PLACE] += load_number(rates, i)

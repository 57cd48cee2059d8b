"""Whether points of a cloud may be in a box: one number tells mostly, else eight, of any box.

A grid of cells has for each the distance in cells to the nearest that has points, as king's moves
(Rosenfeld and Pfaltz, *Distance Functions on Digital Pictures*, 1968), and counts the points
before each of its corners (Crow, *Summed-Area Tables for Texture Mapping*, 1984, in three
dimensions).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    bits_of,
    every,
    LANES,
    larger,
    lowest_bit,
    smaller,
    store_lanes,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array

__all__ = ["CELLS", "count_points", "grid_scale", "king_moves", "lanes_near", "may_be_near"]

CELLS = 48
"""Along each axis of the box around all points."""

_STEP_Y, _STEP_Z = CELLS + 1, (CELLS + 1) ** 2

_MOST_MOVES = 16
"""That are told apart."""

_HAIR = 1e-9
"""Of a cell: more than rounding moves places by."""

_cells = stack_array((4, LANES))


@inlined_kernel
def _cell_of(lower, scale, x):
    """Return the cell of a coordinate, one of those at the border beyond it. It grows with x."""
    return np.int64(min(max((x - lower) * scale, 0.0), CELLS - 1.0))


@inlined_kernel
def _scale(tree, axis):
    extent = tree.bounds[1, axis] - tree.bounds[0, axis]
    return (CELLS - 0.5) / extent if extent > 0.0 else 0.0


@lean_kernel
def _count(tree, counts):
    for leaf in range(len(tree.points)):
        for i in range(LANES):
            at = 0
            for axis in range(3):
                cell = _cell_of(
                    tree.bounds[0, axis], _scale(tree, axis), tree.points[leaf, axis, i]
                )
                at += (cell + 1) * (1 if axis == 0 else _STEP_Y if axis == 1 else _STEP_Z)
            counts[at] += 1
    for step in (1, _STEP_Y, _STEP_Z):
        for z in range(1, CELLS + 1):
            for y in range(1, CELLS + 1):
                first = z * _STEP_Z + y * _STEP_Y
                for x in range(first + 1, first + CELLS + 1):
                    counts[x] += counts[x - step]


def count_points(tree: Any) -> NDArray[np.int32]:
    """Return the counts ``((CELLS + 1)^3,)`` of a tree of points, x first."""
    counts = np.zeros((CELLS + 1) * (CELLS + 1) * (CELLS + 1), np.int32)
    _count(tree, counts)
    return counts


def grid_scale(tree: Any) -> NDArray[np.float64]:
    """Return the cells per m along each axis, ``(3,)``."""
    scale = np.empty(3)
    _scales(tree, scale)
    return scale


@lean_kernel
def _scales(tree, scale):
    for axis in range(3):
        scale[axis] = _scale(tree, axis)


def king_moves(counts: NDArray[np.int32]) -> NDArray[np.uint8]:
    """Return the king's moves ``(CELLS^3,)``, x first, from cells to the nearest with points.

    ``counts`` are those of `count_points`; _MOST_MOVES stands for as many or more.
    """
    sums = counts.reshape(3 * (CELLS + 1,))
    near = np.diff(np.diff(np.diff(sums, axis=0), axis=1), axis=2) != 0
    moves = (~near).astype(np.uint8)
    for _ in range(1, _MOST_MOVES):
        for axis in range(3):
            wide = near.copy()
            first, last = _halves(axis)
            wide[first] |= near[last]
            wide[last] |= near[first]
            near = wide
        if near.all():
            break
        moves += ~near
    return moves.reshape(-1)


def _halves(axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return the indices of all cells but the last along an axis, and of all but the first."""
    return (
        tuple(slice(None, -1) if k == axis else slice(None) for k in range(3)),
        tuple(slice(1, None) if k == axis else slice(None) for k in range(3)),
    )


@inlined_kernel
def lanes_near(tree, table, c, lower, upper, bits):
    """Return those of ``bits``, one of each lane, where balls may be in boxes along C's axes.

    The boxes' corners are lanes; c is a cloud of the table. One number tells here.
    """
    low, high, radius = tree.bounds[0], tree.bounds[1], tree.radius[0]
    scale, moves, cells = table.scales[c], table.moves[c], _cells()
    gap, half = every(-math.inf), every(0.0)
    for axis in range(3):
        first, last = lower[axis] - radius, upper[axis] + radius
        gap = larger(gap, larger(first - high[axis], low[axis] - last))
        half = larger(half, (last - first) * (0.5 * scale[axis]))
        cell = ((first + last) * 0.5 - low[axis]) * scale[axis]
        store_lanes(cells, axis * LANES, smaller(larger(cell, 0.0), CELLS - 1.0))
    store_lanes(cells, 3 * LANES, half + (1.0 + _HAIR))
    bits &= ~bits_of(gap > 0.0)
    left = bits
    while left != 0:
        k = lowest_bit(left)
        left &= left - 1
        at = np.int64(cells[0, k]) + CELLS * np.int64(cells[1, k])
        # What is nearest to a place beyond the border is as far from that on the border, or less.
        if cells[3, k] < moves[at + CELLS * CELLS * np.int64(cells[2, k])]:
            bits &= ~(1 << k)
    return bits


@inlined_kernel
def may_be_near(tree, table, c, lower, upper):
    """Tell whether balls may be in a box along the axes of C; eight numbers tell of any box."""
    low, high, radius = tree.bounds[0], tree.bounds[1], tree.radius[0]
    a, b, c0 = lower[0] - radius, lower[1] - radius, lower[2] - radius
    d, e, f = upper[0] + radius, upper[1] + radius, upper[2] + radius
    if a > high[0] or b > high[1] or c0 > high[2] or d < low[0] or e < low[1] or f < low[2]:
        return False
    scale, counts = table.scales[c], table.counts[c]
    sx, sy, sz = scale[0], scale[1], scale[2]
    x, last_x = _cell_of(low[0], sx, a), _cell_of(low[0], sx, d) + 1
    y, last_y = _cell_of(low[1], sy, b) * _STEP_Y, (_cell_of(low[1], sy, e) + 1) * _STEP_Y
    z, last_z = _cell_of(low[2], sz, c0) * _STEP_Z, (_cell_of(low[2], sz, f) + 1) * _STEP_Z
    behind = counts[last_x + last_y + last_z] - counts[x + last_y + last_z]
    behind += counts[x + y + last_z] - counts[last_x + y + last_z]
    before = counts[last_x + last_y + z] - counts[x + last_y + z]
    before += counts[x + y + z] - counts[last_x + y + z]
    return behind != before

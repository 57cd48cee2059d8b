"""Shortcuts of a path: its corners are left out or cut off, first where that saves most.

A corner is cut between points on both its edges, as far off as parts of these say. The first part
is the whole edge, which leaves the corner out; where the cut is not free, the next part is
smaller (compare Chaikin, *An Algorithm for High Speed Curve Generation*, 1974, whose part is a
quarter). New corners are cut in their turn.
"""

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.planning.edges.curve_kernels import interpolate
from scene_graph_ros.planning.paths.search.search_state import (
    COUNT,
    DONE,
    FIRST,
    NEEDS_ROOM,
    PROVE,
)
from scene_graph_ros.planning.paths.search.space_kernels import distance

__all__ = ["Corners", "more_corners", "new_corners", "propose_shortcut", "take_shortcut"]

_PARTS = (1.0, 0.7, 0.4, 0.2)
"""Of the edges beside a corner, how much is cut off: if not the first, the second, and so on."""

_UNKNOWN = -1.0


class Corners(NamedTuple):
    """A path that is shortened."""

    rows: np.ndarray
    """``(m, nq)``, with room for more."""
    tries: np.ndarray
    """``(m,)``: how many parts of a corner's edges were tried in vain."""
    savings: np.ndarray
    """``(m,)``: what the next part would save; -1 where that is not known."""
    least: np.ndarray
    """``(1,)``: of the path's length, what is worth a proof."""


def new_corners(path: np.ndarray, room: int, least: float) -> Corners:
    """Return the table of a path ``(n, nq)``, with room for so many corners."""
    rows = np.empty((room, path.shape[1]))
    rows[: len(path)] = path
    return Corners(rows, np.zeros(room, np.int64), np.full(room, _UNKNOWN), np.array([least]))


def more_corners(path: Corners) -> Corners:
    """Return the same path with twice the room."""
    more = new_corners(path.rows, 2 * len(path.rows), path.least[0])
    for kept, new in ((path.tries, more.tries), (path.savings, more.savings)):
        new[: len(kept)] = kept
    return more


@inlined_kernel
def _cut(tree, path, i, out):
    """Write where a corner would be cut off next to the first two rows of ``out``."""
    part = _PARTS[path.tries[i]]
    for side in range(2):
        end = path.rows[i - 1 + 2 * side]
        if part < 1.0:
            interpolate(tree, path.rows[i], end, part, out[side])
        else:
            for c in range(len(end)):
                out[side, c] = end[c]


@inlined_kernel
def _saving(tree, space, path, i, edge):
    """Return the length that cutting a corner would save; ``edge`` is scratch."""
    if path.tries[i] >= len(_PARTS):
        return 0.0
    _cut(tree, path, i, edge)
    corner = path.rows[i]
    there = distance(space, edge[0], corner) + distance(space, corner, edge[1])
    return max(0.0, there - distance(space, edge[0], edge[1]))


@inlined_kernel
def propose_shortcut(tree, space, path, state, edge):
    """Write the cut that saves most to ``edge``; return an answer."""
    count, whole = state[COUNT], 0.0
    if count >= len(path.rows):
        return NEEDS_ROOM
    best, most = 0, 0.0
    for i in range(1, count):
        whole += distance(space, path.rows[i - 1], path.rows[i])
        if i == count - 1:
            break
        if path.savings[i] == _UNKNOWN:
            path.savings[i] = _saving(tree, space, path, i, edge)
        if path.savings[i] > most:
            best, most = i, path.savings[i]
    if best == 0 or most < path.least[0] * whole:
        return DONE
    _cut(tree, path, best, edge)
    state[FIRST] = best
    return PROVE


@inlined_kernel
def _move(path, first, count, shift):
    """Move the rows of the corners from ``first`` on by one row, ``shift`` is 1 or -1."""
    for k in range(count - first):
        row = count - 1 - k if shift > 0 else first + k
        path.tries[row + shift], path.savings[row + shift] = path.tries[row], path.savings[row]
        for c in range(path.rows.shape[1]):
            path.rows[row + shift, c] = path.rows[row, c]


@inlined_kernel
def take_shortcut(path, state, edge, is_free):
    """Cut the corner off if that is free."""
    i, count = state[FIRST], state[COUNT]
    if not is_free:
        path.tries[i] += 1
        path.savings[i] = _UNKNOWN
        return
    if path.tries[i] == 0:
        _move(path, i + 1, count, -1)
        state[COUNT] = count - 1
        path.savings[i - 1] = path.savings[i] = _UNKNOWN
        return
    _move(path, i + 1, count, 1)
    state[COUNT] = count + 1
    for side in range(2):
        path.tries[i + side] = 0
        for c in range(path.rows.shape[1]):
            path.rows[i + side, c] = edge[side, c]
    for row in range(i - 1, i + 3):
        path.savings[row] = _UNKNOWN

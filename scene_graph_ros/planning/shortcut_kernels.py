"""Shortcuts of a path: straight edges between two of its points that may be on any of its edges.

Geraerts and Overmars, *Creating High-quality Paths for Motion Planning*, 2007, section 4.1. Points
that are near a corner are moved onto it, so that a path gets fewer corners, not more.
"""

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.planning.curve_kernels import interpolate
from scene_graph_ros.planning.search_state import (
    COUNT,
    DONE,
    FIRST,
    LAST,
    NEEDS_SAMPLES,
    PROVE,
    SAMPLE,
)
from scene_graph_ros.planning.space_kernels import distance

__all__ = ["Corners", "propose_shortcut", "take_shortcut"]

_SNAP = 0.1
"""Of an edge: nearer to its end than that a point is moved there."""

_BEYOND = 0.1
"""Of a path: so far beyond its ends points are chosen, and moved there, as shortcuts from the ends
save most."""

_LEAST_SAVING = 1e-3
"""Of a path's length: a shortcut that saves less is not worth a proof."""


class Corners(NamedTuple):
    """A path that is shortened."""

    rows: np.ndarray
    """``(m, nq)``, with room for one more in each shortcut."""
    lengths: np.ndarray
    """``(m,)``: from the start to each corner."""


@inlined_kernel
def _measure(space, path, count):
    """Write the lengths and return the whole."""
    path.lengths[0] = 0.0
    for i in range(1, count):
        step = distance(space, path.rows[i - 1], path.rows[i])
        path.lengths[i] = path.lengths[i - 1] + step
    return path.lengths[count - 1]


@inlined_kernel
def _point(tree, path, count, length, out):
    """Write the point so far along the path; return its edge and how far along it is."""
    i = 0
    while i < count - 2 and path.lengths[i + 1] <= length:
        i += 1
    low, high = path.lengths[i], path.lengths[i + 1]
    part = (length - low) / (high - low) if high > low else 0.0
    if part < _SNAP:
        part = 0.0
    elif part > 1.0 - _SNAP:
        part = 1.0
    if 0.0 < part < 1.0:
        interpolate(tree, path.rows[i], path.rows[i + 1], part, out)
    else:
        end = i if part == 0.0 else i + 1
        for c in range(len(out)):
            out[c] = path.rows[end, c]
    return i, low + part * (high - low)


@inlined_kernel
def propose_shortcut(tree, space, path, uniforms, state, edge):
    """Write the next shortcut worth a proof to ``edge``; return an answer.

    ``uniforms`` ``(n, 2)`` are random numbers in [0, 1).
    """
    count = state[COUNT]
    if count < 3:
        return DONE
    whole = _measure(space, path, count)
    while state[SAMPLE] < len(uniforms):
        u, v = uniforms[state[SAMPLE], 0], uniforms[state[SAMPLE], 1]
        s = ((1.0 + 2.0 * _BEYOND) * min(u, v) - _BEYOND) * whole
        t = ((1.0 + 2.0 * _BEYOND) * max(u, v) - _BEYOND) * whole
        first, s = _point(tree, path, count, min(max(s, 0.0), whole), edge[0])
        last, t = _point(tree, path, count, min(max(t, 0.0), whole), edge[1])
        saving = (t - s) - distance(space, edge[0], edge[1])
        if first < last and saving > _LEAST_SAVING * whole:
            state[FIRST], state[LAST] = first, last
            return PROVE
        state[SAMPLE] += 1
    return NEEDS_SAMPLES


@inlined_kernel
def _is_row(path, row, q):
    is_same = True
    for c in range(len(q)):
        is_same &= path.rows[row, c] == q[c]
    return is_same


@inlined_kernel
def take_shortcut(path, state, edge, is_free):
    """Put the shortcut into the path if it is free."""
    state[SAMPLE] += 1
    if not is_free:
        return
    first, last, count = state[FIRST], state[LAST], state[COUNT]
    head = first if _is_row(path, first, edge[0]) else first + 1
    tail = last + 2 if _is_row(path, last + 1, edge[1]) else last + 1
    shift = head + 2 - tail
    moved = count - tail
    for k in range(moved):
        row = tail + (moved - 1 - k if shift > 0 else k)
        for c in range(path.rows.shape[1]):
            path.rows[row + shift, c] = path.rows[row, c]
    for c in range(path.rows.shape[1]):
        path.rows[head, c], path.rows[head + 1, c] = edge[0, c], edge[1, c]
    state[COUNT] = count + shift

"""Grids of voxels as the streams of bytes that OctoMap reads; see ``octree_stream``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.shapes.voxel_grid import Voxel
from scene_graph_ros.sensing.octree_stream import BIT_STATES, DEPTH, MIDDLE, OctreeError

__all__ = ["LOG_ODDS", "binary_octree", "full_octree"]

LOG_ODDS = (-2.0, 3.5)
"""Of free and of occupied voxels in a full stream: OctoMap's own limits, about 0.12 and 0.97."""

_UNKNOWN, _FREE, _OCCUPIED, _INNER = BIT_STATES
_HOLDS = 4
"""Added to an inner node's state where anything below it is occupied."""
_KNOWN = np.array([_FREE, _OCCUPIED, _UNKNOWN], np.uint8)
_WAITING = 7 * DEPTH + 9
_NODE = 5
"""Bytes of a full stream's node."""


@inlined_kernel
def _state_of(states, starts, counts, lows, level, x, y, z):
    """Return the state of a node of a level by its key there; unknown outside of the grid."""
    i, j, k = x - lows[level, 0], y - lows[level, 1], z - lows[level, 2]
    if min(i, min(j, k)) < 0 or i >= counts[level, 0] or j >= counts[level, 1]:
        return np.int64(_UNKNOWN)
    if k >= counts[level, 2]:
        return np.int64(_UNKNOWN)
    at = (i * counts[level, 1] + j) * counts[level, 2] + k
    return np.int64(states[starts[level] + at])


@lean_kernel
def _write_binary(states, starts, counts, lows, stack, out):
    """Write the inner nodes' children, as far as there is room; return how many bytes they take.

    The root is one, as it holds more voxels than a grid has.
    """
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = DEPTH, 0, 0, 0
    at, waiting = 0, 1
    while waiting > 0:
        waiting -= 1
        below = stack[waiting, 0] - 1
        x, y, z = stack[waiting, 1], stack[waiting, 2], stack[waiting, 3]
        bits = 0
        for back in range(8):  # the first child is the next that waits
            child = 7 - back
            cx, cy, cz = 2 * x + (child & 1), 2 * y + (child >> 1 & 1), 2 * z + (child >> 2)
            state = _state_of(states, starts, counts, lows, below, cx, cy, cz) & 3
            bits |= state << (2 * child)
            if state == _INNER:
                stack[waiting, 0], stack[waiting, 1] = below, cx
                stack[waiting, 2], stack[waiting, 3] = cy, cz
                waiting += 1
        if at + 2 <= len(out):
            out[at], out[at + 1] = bits & 255, bits >> 8
        at += 2
    return at


@lean_kernel
def _write_full(states, starts, counts, lows, stack, odds, out):
    """Write all nodes: their log-odds, bytes of ``odds`` ``(2, 4)``, and their children's bits.

    An inner node has the largest log-odds below it.
    """
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = DEPTH, 0, 0, 0
    at, waiting = 0, 1
    while waiting > 0:
        waiting -= 1
        level = stack[waiting, 0]
        x, y, z = stack[waiting, 1], stack[waiting, 2], stack[waiting, 3]
        own, bits = _state_of(states, starts, counts, lows, level, x, y, z), 0
        is_occupied = own == _OCCUPIED or own == _INNER + _HOLDS
        for back in range(8 if (own & 3) == _INNER else 0):
            child = 7 - back
            cx, cy, cz = 2 * x + (child & 1), 2 * y + (child >> 1 & 1), 2 * z + (child >> 2)
            if _state_of(states, starts, counts, lows, level - 1, cx, cy, cz) != _UNKNOWN:
                bits |= 1 << child
                stack[waiting, 0], stack[waiting, 1] = level - 1, cx
                stack[waiting, 2], stack[waiting, 3] = cy, cz
                waiting += 1
        if at + 5 <= len(out):
            for k in range(4):
                out[at + k] = odds[1 if is_occupied else 0, k]
            out[at + 4] = bits
        at += 5
    return at


def binary_octree(occupancy: NDArray[np.uint8], first: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the binary stream of states ``(nx, ny, nz)`` from a key ``(3,)`` on.

    Eight children that are alike are one leaf. Raises OctreeError for keys that an octree does not
    have.
    """
    levels = _levels(occupancy, first)
    if levels is None:
        return np.empty(0, np.uint8)
    return _written(_write_binary, *levels, np.empty((_WAITING, 4), np.int64))


def full_octree(occupancy: NDArray[np.uint8], first: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the full stream of the same, of nodes without a colour; see LOG_ODDS."""
    levels = _levels(occupancy, first)
    if levels is None:
        return np.empty(0, np.uint8)
    odds = np.array(LOG_ODDS, "<f4").view(np.uint8).reshape(2, 4)
    return _written(_write_full, *levels, np.empty((_WAITING, 4), np.int64), odds)


def _written(write: object, *arguments: object) -> NDArray[np.uint8]:
    assert callable(write)
    out = np.empty(write(*arguments, np.empty(0, np.uint8)), np.uint8)
    write(*arguments, out)
    return out


Levels = tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]


def _levels(occupancy: NDArray[np.uint8], first: NDArray[np.int64]) -> Levels | None:
    """Return the nodes' states of all levels, where those of each begin, counts and first keys.

    None is returned for a grid without a known voxel.
    """
    last = first + occupancy.shape
    if (first < 0).any() or (last > 2 * MIDDLE).any():
        raise OctreeError(
            f"an octree has {2 * MIDDLE} voxels along an axis, from the origin half of them each"
            f" way: keys {first.tolist()} to {last.tolist()} are outside"
        )
    if not (occupancy != Voxel.UNKNOWN).any():
        return None
    levels, lows = [_KNOWN[occupancy]], [first]
    for _ in range(DEPTH):
        levels.append(_merged(levels[-1], lows[-1]))
        lows.append(lows[-1] // 2)
    counts = np.array([level.shape for level in levels], np.int64)
    starts = np.concatenate([[0], np.cumsum(counts.prod(axis=1))]).astype(np.int64)
    return np.concatenate([level.reshape(-1) for level in levels]), starts, counts, np.array(lows)


def _merged(states: NDArray[np.uint8], low: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the states of the nodes above: that of all eight children, or that these differ."""
    before = low % 2
    pads = [(int(b), int((b + n) % 2)) for b, n in zip(before, states.shape, strict=True)]
    whole = np.pad(states, pads)
    eight = [whole[i::2, j::2, k::2] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    alike, holds = np.ones(eight[0].shape, np.bool_), np.zeros(eight[0].shape, np.bool_)
    for child in eight:
        alike &= child == eight[0]
        holds |= (child == _OCCUPIED) | (child == _INNER + _HOLDS)
    inner = np.where(holds, np.uint8(_INNER + _HOLDS), np.uint8(_INNER))
    alike &= (eight[0] & 3) != _INNER
    result: NDArray[np.uint8] = np.where(alike, eight[0], inner).astype(np.uint8)
    return result

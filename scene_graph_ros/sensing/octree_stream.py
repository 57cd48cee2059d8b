"""Octrees of OctoMap as streams of bytes, to and from grids of voxels.

Both layouts are read as that library writes them (Hornung and others, *OctoMap: An Efficient
Probabilistic 3D Mapping Framework Based on Octrees*, 2013): nodes depth first, children in the
order of x, y, z bits. A binary stream has two bits for each of a node's children; a full one the
log-odds of each node, and a bit for each child that there is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import lean_kernel

__all__ = ["DEPTH", "MIDDLE", "Leaves", "OctreeError", "octree_bytes", "read_binary", "read_full"]

DEPTH = 16
"""Levels below the root: a leaf there is one voxel."""
MIDDLE = 2 ** (DEPTH - 1)
"""The key of the voxel whose lower corner is at the origin."""
_WAITING = 7 * DEPTH + 9
_FREE, _OCCUPIED, _INNER = 1, 2, 3
"""Two bits of a child in a binary stream; 0 is unknown."""


class OctreeError(ValueError):
    """A stream of bytes that is no octree."""


class Leaves(NamedTuple):
    """The known leaves of an octree."""

    keys: NDArray[np.int64]
    """``(n, 3)`` of their lowest voxels along x, y, z, from 0 to 2 MIDDLE - 1."""
    widths: NDArray[np.int64]
    """``(n,)`` voxels along an edge."""
    occupied: NDArray[np.bool_]
    """``(n,)``; the others are free."""


_ENDS, _DEEP, _MORE = 1, 2, 3
"""Why a stream is no octree: it ends within a node, has a child below depth 16, or goes on."""


@lean_kernel
def _walk_binary(data, stack, leaves):
    """Write leaves ``(key x, y, z, width, state)``, as far as there is room; return (n, why)."""
    count, at, waiting = 0, 0, 0
    if len(data) > 0:
        stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, 0, 0, 2 * MIDDLE
        waiting = 1
    while waiting > 0:
        waiting -= 1
        x, y, z = stack[waiting, 0], stack[waiting, 1], stack[waiting, 2]
        half = stack[waiting, 3] // 2
        if at + 2 > len(data):
            return count, _ENDS
        if half < 1:
            return count, _DEEP
        bits = np.int64(data[at]) + 256 * np.int64(data[at + 1])
        at += 2
        for back in range(8):  # the first child is the next that waits
            child = 7 - back
            state = (bits >> (2 * child)) & 3
            kx = x + half * (child & 1)
            ky, kz = y + half * (child >> 1 & 1), z + half * (child >> 2)
            if state == _INNER:
                stack[waiting, 0], stack[waiting, 1], stack[waiting, 2] = kx, ky, kz
                stack[waiting, 3] = half
                waiting += 1
            elif state != 0:
                if count < len(leaves):
                    leaves[count, 0], leaves[count, 1], leaves[count, 2] = kx, ky, kz
                    leaves[count, 3], leaves[count, 4] = half, state
                count += 1
    return count, _MORE if at < len(data) else 0


@lean_kernel
def _walk_full(data, odds, stride, threshold, stack, leaves):
    """Write the leaves of nodes of ``stride`` bytes and one for their children; as above.

    ``odds`` are the log-odds that begin at each byte.
    """
    count, at, waiting = 0, 0, 0
    if len(data) > 0:
        stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, 0, 0, 2 * MIDDLE
        waiting = 1
    while waiting > 0:
        waiting -= 1
        x, y, z = stack[waiting, 0], stack[waiting, 1], stack[waiting, 2]
        width = stack[waiting, 3]
        if at + stride + 1 > len(data):
            return count, _ENDS
        value, bits = odds[at], np.int64(data[at + stride])
        at += stride + 1
        if bits == 0:
            if count < len(leaves):
                leaves[count, 0], leaves[count, 1], leaves[count, 2] = x, y, z
                leaves[count, 3] = width
                leaves[count, 4] = _OCCUPIED if not value < threshold else _FREE
            count += 1
            continue
        half = width // 2
        if half < 1:
            return count, _DEEP
        for back in range(8):
            child = 7 - back
            if (bits >> child) & 1:
                stack[waiting, 0] = x + half * (child & 1)
                stack[waiting, 1] = y + half * (child >> 1 & 1)
                stack[waiting, 2], stack[waiting, 3] = z + half * (child >> 2), half
                waiting += 1
    return count, _MORE if at < len(data) else 0


def _leaves(walk: object, *arguments: object) -> Leaves:
    assert callable(walk)
    stack = np.empty((_WAITING, 4), np.int64)
    count, why = walk(*arguments, stack, np.empty((0, 5), np.int64))
    if why:
        told = {
            _ENDS: "ends within a node",
            _DEEP: f"has nodes below depth {DEPTH}",
            _MORE: "goes on behind its last node",
        }
        raise OctreeError(f"the octree's data {told[why]}")
    found = np.empty((count, 5), np.int64)
    walk(*arguments, stack, found)
    return Leaves(found[:, :3], found[:, 3], found[:, 4] == _OCCUPIED)


def read_binary(data: NDArray[np.uint8]) -> Leaves:
    """Return the leaves of a binary stream; an empty one is a tree in which all is unknown.

    Raises OctreeError for bytes that end early, go on behind the tree, or go below its depth.
    """
    return _leaves(_walk_binary, np.ascontiguousarray(data))


def read_full(data: NDArray[np.uint8], *, extra: int = 0, threshold: float = 0.0) -> Leaves:
    """Return the leaves of a full stream, whose nodes have ``extra`` bytes behind their log-odds.

    A node is occupied where its log-odds are at least ``threshold``, or NaN. Raises OctreeError
    as `read_binary`.
    """
    data = np.ascontiguousarray(data)
    padded = np.concatenate([data, np.zeros(4, np.uint8)])
    windows = np.lib.stride_tricks.sliding_window_view(padded, 4)[: len(data)]
    odds = np.ascontiguousarray(windows).view("<f4").reshape(-1).astype(np.float64)
    return _leaves(_walk_full, data, odds, 4 + extra, threshold)


def octree_bytes(known: NDArray[np.uint8], first: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the binary stream of voxels ``(nx, ny, nz)``: 0 unknown, 1 free, 2 occupied.

    ``first`` ``(3,)`` is the key of the first one. Eight children that are known alike are one
    leaf. Raises OctreeError for keys that an octree does not have.
    """
    last = first + known.shape
    if (first < 0).any() or (last > 2 * MIDDLE).any():
        raise OctreeError(
            f"an octree has {2 * MIDDLE} voxels along an axis, from the origin half of them each"
            f" way: keys {first.tolist()} to {last.tolist()} are outside"
        )
    if not (known != 0).any():
        return np.empty(0, np.uint8)
    levels, lows = [known], [first]
    for _ in range(DEPTH):
        levels.append(_merged(levels[-1], lows[-1]))
        lows.append(lows[-1] // 2)
    out = bytearray()
    # The root is an inner node, also where all is alike.
    waiting = [(DEPTH, 0, 0, 0)]
    while waiting:
        level, x, y, z = waiting.pop()
        below, low = levels[level - 1], lows[level - 1]
        bits, inner = 0, []
        for child in range(8):
            key = (2 * x + (child & 1), 2 * y + (child >> 1 & 1), 2 * z + (child >> 2))
            i, j, k = (a - b for a, b in zip(key, low.tolist(), strict=True))
            if min(i, j, k) < 0 or i >= below.shape[0] or j >= below.shape[1]:
                continue
            if k >= below.shape[2]:
                continue
            state = int(below[i, j, k])
            bits |= state << (2 * child)
            if state == _INNER:
                inner.append((level - 1, *key))
        out += bits.to_bytes(2, "little")
        waiting += reversed(inner)
    return np.frombuffer(bytes(out), np.uint8)


def _merged(states: NDArray[np.uint8], low: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the states of the nodes above: that of all eight children, or that these differ."""
    before = low % 2
    pads = [(int(b), int((b + n) % 2)) for b, n in zip(before, states.shape, strict=True)]
    whole = np.pad(states, pads)
    nx, ny, nz = (n // 2 for n in whole.shape)
    eight = whole.reshape(nx, 2, ny, 2, nz, 2).transpose(0, 2, 4, 1, 3, 5).reshape(nx, ny, nz, 8)
    alike = (eight == eight[..., :1]).all(axis=3)
    result: NDArray[np.uint8] = np.where(alike, eight[..., 0], _INNER).astype(np.uint8)
    return result

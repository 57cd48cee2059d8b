"""Octrees of OctoMap, streams of bytes, as grids of voxels.

Both layouts are read as that library writes them (Hornung and others, *OctoMap: An Efficient
Probabilistic 3D Mapping Framework Based on Octrees*, 2013): nodes depth first, children in the
order of x, y, z bits. A binary stream has two bits for each of a node's children; a full one the
log-odds of each node, and a bit for each child that there is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.shapes.voxel_grid import Voxel

__all__ = ["BIT_STATES", "DEPTH", "MIDDLE", "OctreeError", "OctreeStream"]

DEPTH = 16
"""Levels below the root: a leaf there is one voxel."""
MIDDLE = 2 ** (DEPTH - 1)
"""The key of the voxel whose lower corner is at the origin."""
BIT_STATES = (0, 1, 2, 3)
"""Two bits of a child in a binary stream: unknown, free, occupied, or an inner node."""
_WAITING = 7 * DEPTH + 9
_BIT_OCCUPIED, _INNER = BIT_STATES[2], BIT_STATES[3]
_FREE, _OCCUPIED = int(Voxel.FREE), int(Voxel.OCCUPIED)


class OctreeError(ValueError):
    """A stream of bytes that is no octree."""


_ENDS, _DEEP, _MORE = 1, 2, 3
"""Why a stream is no octree: it ends within a node, has a child below depth 16, or goes on."""
_TOLD = {
    _ENDS: "ends within a node",
    _DEEP: f"has nodes below depth {DEPTH}",
    _MORE: "goes on behind its last node",
}


@inlined_kernel
def _put_leaf(x, y, z, width, state, lower, states, bounds):
    """Write a leaf's state into the voxels that there are of it, and the bounds of all leaves."""
    bounds[0, 0], bounds[1, 0] = min(bounds[0, 0], x), max(bounds[1, 0], x + width)
    bounds[0, 1], bounds[1, 1] = min(bounds[0, 1], y), max(bounds[1, 1], y + width)
    bounds[0, 2], bounds[1, 2] = min(bounds[0, 2], z), max(bounds[1, 2], z + width)
    nx, ny, nz = states.shape
    for i in range(max(x - lower[0], 0), min(x + width - lower[0], nx)):
        for j in range(max(y - lower[1], 0), min(y + width - lower[1], ny)):
            for k in range(max(z - lower[2], 0), min(z + width - lower[2], nz)):
                states[i, j, k] = state


@lean_kernel
def _walk_binary(data, stack, lower, states, bounds):
    """Write the leaves of a binary stream, see ``_put_leaf``; return why it is none, or 0."""
    at, waiting = 0, 0
    if len(data) > 0:
        stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, 0, 0, 2 * MIDDLE
        waiting = 1
    while waiting > 0:
        waiting -= 1
        x, y, z = stack[waiting, 0], stack[waiting, 1], stack[waiting, 2]
        half = stack[waiting, 3] // 2
        if at + 2 > len(data):
            return _ENDS
        if half < 1:
            return _DEEP
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
                known = _OCCUPIED if state == _BIT_OCCUPIED else _FREE
                _put_leaf(kx, ky, kz, half, known, lower, states, bounds)
    return _MORE if at < len(data) else 0


@lean_kernel
def _walk_full(data, odds, stride, threshold, stack, lower, states, bounds):
    """Do the same with nodes of ``stride`` bytes and one for their children.

    ``odds`` are the log-odds that begin at each byte.
    """
    at, waiting = 0, 0
    if len(data) > 0:
        stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, 0, 0, 2 * MIDDLE
        waiting = 1
    while waiting > 0:
        waiting -= 1
        x, y, z = stack[waiting, 0], stack[waiting, 1], stack[waiting, 2]
        width = stack[waiting, 3]
        if at + stride + 1 > len(data):
            return _ENDS
        value, bits = odds[at], np.int64(data[at + stride])
        at += stride + 1
        if bits == 0:
            known = _OCCUPIED if not value < threshold else _FREE
            _put_leaf(x, y, z, width, known, lower, states, bounds)
            continue
        half = width // 2
        if half < 1:
            return _DEEP
        for back in range(8):
            child = 7 - back
            if (bits >> child) & 1:
                stack[waiting, 0] = x + half * (child & 1)
                stack[waiting, 1] = y + half * (child >> 1 & 1)
                stack[waiting, 2], stack[waiting, 3] = z + half * (child >> 2), half
                waiting += 1
    return _MORE if at < len(data) else 0


class OctreeStream:
    """The bytes of one octree; in an empty one all is unknown.

    A binary one has its occupied and free leaves. In a full one, whose nodes have ``extra`` bytes
    behind their log-odds, a leaf is occupied where these are at least ``threshold``, or NaN.
    """

    def __init__(
        self,
        data: NDArray[np.uint8],
        *,
        is_binary: bool,
        extra: int = 0,
        threshold: float = 0.0,
    ) -> None:
        self._data = np.ascontiguousarray(data)
        self._odds = None if is_binary else _log_odds(self._data)
        self._stride, self._threshold = 4 + extra, threshold

    def extent(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the keys ``(3,)`` of the first voxel of all leaves, and behind the last.

        They are the same without leaves. Raises OctreeError for bytes that end early, go on behind
        the tree, or go below its depth.
        """
        bounds = np.array([[2 * MIDDLE] * 3, [0] * 3], np.int64)
        self._walk(np.zeros(3, np.int64), np.empty((0, 0, 0), np.uint8), bounds)
        if bounds[0, 0] > bounds[1, 0]:
            bounds[:] = 0
        return bounds[0], bounds[1]

    def states(self, lower: NDArray[np.int64], upper: NDArray[np.int64]) -> NDArray[np.uint8]:
        """Return the states of the voxels from one key on to below another; raises OctreeError."""
        states = np.full(upper - lower, int(Voxel.UNKNOWN), np.uint8)
        self._walk(np.ascontiguousarray(lower), states, np.zeros((2, 3), np.int64))
        return states

    def _walk(
        self, lower: NDArray[np.int64], states: NDArray[np.uint8], bounds: NDArray[np.int64]
    ) -> None:
        stack = np.empty((_WAITING, 4), np.int64)
        where = stack, lower, states, bounds
        if self._odds is None:
            why = _walk_binary(self._data, *where)
        else:
            why = _walk_full(self._data, self._odds, self._stride, self._threshold, *where)
        if why:
            raise OctreeError(f"the octree's data {_TOLD[why]}")


def _log_odds(data: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the float that begins at each byte ``(n,)``: a view, so that nothing is copied."""
    padded = np.concatenate([data, np.zeros(4, np.uint8)])
    return np.ndarray(len(data), np.dtype("<f4"), padded, strides=(1,))

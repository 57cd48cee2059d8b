"""Voxels as bits, and those of blocks of 4 x 4 x 4 of them, and so on, for kernels.

A tree with 64 children of a node (compare Museth, *VDB: High-Resolution Sparse Volumes with
Dynamic Topology*, 2013), in which nothing but the place says where a block is: a grid takes 1/8
byte for a voxel, and 1/63 of that more.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.tables.holding import Holding

__all__ = ["SIDE", "PlacedVoxels", "VoxelBits", "borrowed_voxels", "place_voxels", "voxels_again"]

SIDE = 4
"""Children of a node along each axis: 64, which are the bits of a word."""


class VoxelBits(NamedTuple):
    """What kernels read of voxels; level 0 are the voxels, level 1 blocks of 4 x 4 x 4 of them."""

    words: np.ndarray
    """``(nodes,)`` uint64, level by level from 1 on: bit 16 a + 4 b + c is set where anything
    below the child (a, b, c) is solid."""
    starts: np.ndarray
    """``(levels + 1,)`` int64: the first node of each level from 1 on, and how many there are."""
    counts: np.ndarray
    """``(levels + 1, 3)`` int64: nodes of each level along x, y, z; the last level has one."""
    numbers: np.ndarray
    """``(1,)`` m: the edge of a voxel."""


class PlacedVoxels(NamedTuple):
    """Bits and where their arrays are."""

    bits: VoxelBits
    places: Any
    """What ``borrowed_voxels`` takes; right as long as the bits live."""
    num_elements: int
    """How many voxels are solid."""
    corners: tuple[NDArray[np.float64], NDArray[np.float64]]
    """The lower and upper corner ``(3,)`` of the box around these, in m; zeros without any."""

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the corners of the box around all that is solid."""
        return self.corners


def _words(solid: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Return the words ``(nx, ny, nz)`` of blocks; the solid ones are in full blocks."""
    nx, ny, nz = (n // SIDE for n in solid.shape)
    blocks = solid.reshape(nx, SIDE, ny, SIDE, nz, SIDE).transpose(0, 2, 4, 1, 3, 5)
    packed = np.packbits(blocks.reshape(-1, SIDE * SIDE * SIDE), axis=1, bitorder="little")
    return packed.view("<u8").astype(np.uint64).reshape(nx, ny, nz)


def _whole(solid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the same with free voxels behind the last, so that blocks are full."""
    more = [(0, -n % SIDE if n else SIDE) for n in solid.shape]
    return np.pad(solid, more)


def _example() -> VoxelBits:
    return _bits(np.zeros((1, 1, 1), np.bool_), 1.0)


def _bits(solid: NDArray[np.bool_], edge: float) -> VoxelBits:
    levels, counts = [_words(_whole(solid))], [solid.shape]
    while True:
        counts.append(levels[-1].shape)
        if levels[-1].size == 1:
            break
        levels.append(_words(_whole(levels[-1] != 0)))
    return VoxelBits(
        np.concatenate([level.reshape(-1) for level in levels]),
        np.concatenate([[0], np.cumsum([level.size for level in levels])]).astype(np.int64),
        np.array(counts, np.int64),
        np.array([edge]),
    )


_holding = Holding("a grid of voxels", _example)
borrowed_voxels = _holding.borrowed
"""Return, in a lean kernel, the bits that the ``places`` of PlacedVoxels describe."""


def voxels_again(placed: PlacedVoxels) -> PlacedVoxels:
    """Return bits with their places in this process, into which they were unpickled."""
    return placed._replace(places=_holding.places(placed.bits))


def place_voxels(solid: NDArray[np.bool_], edge: float) -> PlacedVoxels:
    """Return a mask ``(nx, ny, nz)`` of boxes of an edge (m) for kernels; checked before."""
    corners = np.zeros((2, 3))
    for axis in range(3):
        there = np.flatnonzero(solid.any(axis=tuple(k for k in range(3) if k != axis)))
        if len(there):
            corners[:, axis] = there[0] * edge, (there[-1] + 1) * edge
    bits = _bits(solid, edge)
    count = int(np.count_nonzero(solid))
    return PlacedVoxels(bits, _holding.places(bits), count, (corners[0], corners[1]))

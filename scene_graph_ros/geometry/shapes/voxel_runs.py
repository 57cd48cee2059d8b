"""Voxels as runs of equal states, in the order of C: how files and messages have them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import InvalidShapeError

__all__ = ["MOST_IN_RUNS", "from_runs", "to_runs"]

MOST_IN_RUNS = 2**24
"""Voxels of one grid in a file or message: a few bytes may ask for so many."""


def to_runs(occupancy: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return pairs ``(n, 2)`` of a state and how many voxels in turn have it.

    Raises InvalidShapeError for more than MOST_IN_RUNS.
    """
    if occupancy.size > MOST_IN_RUNS:
        raise InvalidShapeError(
            f"VoxelGrid: {occupancy.size} voxels are too many for a file or message, which may"
            f" have {MOST_IN_RUNS}"
        )
    flat = occupancy.reshape(-1)
    starts = np.flatnonzero(np.diff(flat, prepend=255)) if len(flat) else np.empty(0, np.int64)
    return np.stack([flat[starts], np.diff(starts, append=len(flat))], axis=1).astype(np.int64)


def from_runs(counts: ArrayLike, runs: ArrayLike) -> NDArray[np.uint8]:
    """Return states ``(nx, ny, nz)`` of runs.

    Raises InvalidShapeError for counts that are none, for more than MOST_IN_RUNS, and for runs
    that are none or have another number of voxels.
    """
    shape, pairs = np.asarray(counts, np.float64), np.asarray(runs, np.float64).reshape(-1, 2)
    whole = (shape >= 0).all() and (shape == np.floor(shape)).all()
    if shape.shape != (3,) or not whole or not shape.prod() <= MOST_IN_RUNS:
        raise InvalidShapeError(
            f"VoxelGrid: counts must be three whole numbers whose product is at most"
            f" {MOST_IN_RUNS}, not {shape.tolist()}"
        )
    right = (pairs[:, 1] >= 0) & (pairs[:, 1] == np.floor(pairs[:, 1]))
    right &= (pairs[:, 0] >= 0) & (pairs[:, 0] <= 2) & (pairs[:, 0] == np.floor(pairs[:, 0]))
    if not right.all():
        k = int((~right).argmax())
        raise InvalidShapeError(
            f"VoxelGrid: runs[{k}] must be a state from 0 to 2 and a whole number of voxels, not"
            f" {pairs[k].tolist()}"
        )
    total = float(pairs[:, 1].sum())
    if total != shape.prod():
        raise InvalidShapeError(
            f"VoxelGrid: runs have {total:.0f} voxels, not the {shape.prod():.0f} of"
            f" {shape.astype(np.int64).tolist()}"
        )
    states = np.repeat(pairs[:, 0].astype(np.uint8), pairs[:, 1].astype(np.int64))
    return states.reshape(shape.astype(np.int64))

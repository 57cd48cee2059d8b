"""Voxel grids as convex sets: runs of voxels, or where these are many, boxes around blocks."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.geometry.model.voxel_set import VoxelSet

__all__ = ["MOST_RUNS", "count_voxel_sets", "sets_of_voxels"]

MOST_RUNS = 1000
"""A grid of more is taken by boxes, of which each holds what is solid in 8 x 8 x 8 voxels."""
_BLOCK = 8

_SIDES = np.array(list(itertools.product((0, 1), repeat=3)), dtype=np.bool_)


def count_voxel_sets(now: VoxelSet) -> int:
    """Return the number of sets of a grid."""
    return len(_boxes(now.solid))


def sets_of_voxels(now: VoxelSet, X_FG: NDArray[np.float64]) -> list[ConvexSet]:
    """Return sets that hold all that is solid in a grid at ``X_FG`` ``(4, 4)``, in F."""
    edge = now.shape.voxel
    corners = [np.where(_SIDES, upper, lower) * edge for lower, upper in _boxes(now.solid)]
    return [VPolytope(each @ X_FG[:3, :3].T + X_FG[:3, 3]) for each in corners]


def _boxes(solid: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the corners ``(n, 2, 3)`` of boxes, in voxels."""
    padded = np.pad(solid, ((0, 0), (0, 0), (1, 1)))
    changes = padded[:, :, 1:] != padded[:, :, :-1]
    # Along each column a run begins and ends in turn.
    ends = np.argwhere(changes)
    if len(ends) <= 2 * MOST_RUNS:
        runs = ends.reshape(-1, 2, 3)
        runs[:, 1, :2] += 1
        return runs
    found = np.argwhere(solid)
    blocks, which = np.unique(found // _BLOCK, axis=0, return_inverse=True)
    lower = np.full(blocks.shape, max(solid.shape))
    upper = np.zeros_like(lower)
    np.minimum.at(lower, which.reshape(-1), found)
    np.maximum.at(upper, which.reshape(-1), found + 1)
    return np.stack([lower, upper], axis=1)

"""Drawings of voxel grids: boxes at their surfaces, which change."""

from __future__ import annotations

import functools
import itertools

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.voxel_set import VoxelSet

__all__ = ["MOST_BOXES", "box_corners", "box_triangles"]

MOST_BOXES = 2048
"""Boxes that are drawn of a grid; of more, boxes of 8, 64, ... voxels, if any is solid."""

_CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))
_FACES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


@functools.cache
def box_triangles() -> NDArray[np.int64]:
    """Return those of as many boxes as there may be; spare ones have no size."""
    first = 8 * np.arange(MOST_BOXES)[:, np.newaxis, np.newaxis]
    result: NDArray[np.int64] = (_FACES + first).reshape(-1, 3)
    return result


def box_corners(now: VoxelSet) -> NDArray[np.float64]:
    """Return the corners ``(8 MOST_BOXES, 3)`` in G, in m, of boxes around what is solid."""
    solid, width = now.solid, 1
    while len(found := _at_surface(solid)) > MOST_BOXES:
        solid, width = _halved(solid), 2 * width
    result = np.zeros((MOST_BOXES, 8, 3))
    corners = (found[:, np.newaxis] + _CORNERS) * (width * now.shape.voxel)
    if len(found):
        result[: len(found)], result[len(found) :] = corners, corners[0, 0]
    return result.reshape(-1, 3)


def _at_surface(solid: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the indices of voxels with a face that no other one covers."""
    around = np.pad(solid, 1)
    middle = slice(1, -1)
    covered: NDArray[np.bool_] = np.ones(solid.shape, np.bool_)
    for axis in range(3):
        for side in (slice(None, -2), slice(2, None)):
            near = around[tuple(side if k == axis else middle for k in range(3))]
            np.logical_and(covered, near, out=covered)
    return np.argwhere(np.logical_and(solid, ~covered))


def _halved(solid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the mask of blocks of 2 x 2 x 2 voxels of which one is solid."""
    whole = np.pad(solid, [(0, n % 2) for n in solid.shape])
    nx, ny, nz = (n // 2 for n in whole.shape)
    return np.asarray(whole.reshape(nx, 2, ny, 2, nz, 2).any(axis=(1, 3, 5)))

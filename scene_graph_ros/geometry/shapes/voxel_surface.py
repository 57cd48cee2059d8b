"""The surface of a voxel grid as triangles, for what draws it; queries never need it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["voxel_triangles"]

FloatArray = NDArray[np.float64]


def voxel_triangles(solid: NDArray[np.bool_], edge: float) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return corners ``(v, 3)`` in G, m, and triangles ``(t, 3)``, counter-clockwise from outside.

    They are two for each face between a voxel that is solid and one that is not; the corners are
    those of the grid that some triangle has.
    """
    padded = np.pad(solid, 1)
    counts = np.array(solid.shape) + 1
    strides = np.array([counts[1] * counts[2], counts[2], 1], np.int64)
    faces = []
    for axis in range(3):
        along, across = strides[(axis + 1) % 3], strides[(axis + 2) % 3]
        before = np.take(padded, range(solid.shape[axis] + 1), axis)
        after = np.take(padded, range(1, solid.shape[axis] + 2), axis)
        inner = tuple(slice(None) if k == axis else slice(1, -1) for k in range(3))
        for is_face, order in ((before & ~after, (0, 1, 2, 3)), (after & ~before, (0, 3, 2, 1))):
            first = (np.argwhere(is_face[inner]) * strides).sum(axis=1)
            around = np.stack([first, first + along, first + along + across, first + across], 1)
            faces.append(around[:, order])
    quads = np.concatenate(faces)
    triangles = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    used, numbers = np.unique(triangles, return_inverse=True)
    places = np.stack(np.unravel_index(used, tuple(counts)), axis=1)
    corners: FloatArray = places.astype(np.float64) * edge
    return corners, numbers.reshape(-1, 3).astype(np.int64)

"""Pictures and transparency of the bodies that a renderer draws, as arrays: for its kernels."""

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE

__all__ = ["BY_TRIANGLE", "Cover", "picture_of"]

BY_TRIANGLE = -2
"""In the place of a body's picture: each triangle has the one that the mesh's file gives it."""


class Cover(NamedTuple):
    """Alpha of n bodies, and the pictures on them; arrays of 0 rows where there is none at all."""

    alpha: np.ndarray
    """(n,) from 0, as if it were not there, to 1."""
    is_transparent: np.ndarray
    """(n,) bool: whether something behind a body may be seen through it."""
    picture: np.ndarray
    """(n,) int32: the picture on each body, -1 for none, or BY_TRIANGLE."""
    repeats: np.ndarray
    """(n, 2): factors of the texture coordinates."""
    first: np.ndarray
    """(n,) int64: the row in ``corners`` of the first triangle of a body's mesh."""
    corners: np.ndarray
    """(T, 3, 2): (u, v) at the corners of triangles."""
    of_triangle: np.ndarray
    """(T,) int32: the picture on each triangle of a body that has them BY_TRIANGLE, or -1."""
    size: np.ndarray
    """(k, 2) int64: width and height of each picture."""
    start: np.ndarray
    """(k,) int64: the row in ``texels`` of its upper left corner."""
    texels: np.ndarray
    """(N, 4) uint8: red, green, blue and alpha, row by row from above."""


@inlined_kernel
def picture_of(cover, row, triangle):
    """Return the number of the picture at a point of a body, by its triangle; -1 for none."""
    picture = cover.picture[row]
    if picture == BY_TRIANGLE:
        picture = cover.of_triangle[(cover.first[row] + triangle) & LAST_PLACE]
    return picture

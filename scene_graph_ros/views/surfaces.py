"""Drawings of contact surfaces: triangles in colours of their pressure.

Colour goes from blue at zero over cyan, green and yellow to red at ``scale`` pascals and above, on
a scale that does not change: pictures of different moments can be compared.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["colored_corners", "corner_rows", "pressure_colors", "triangles_of"]

IntArray = NDArray[np.int64]

_COLORS = np.array([[0, 0, 1], [0, 1, 1], [0, 1, 0], [1, 1, 0], [1, 0, 0]], dtype=np.float64)
"""At equal steps of pressure from 0 to the scale; linear between."""


def corner_rows(surfaces: Any) -> tuple[IntArray, IntArray]:
    """Return the places (f + 1,) at which each face's corners begin, and the corners' vertices.

    Rows of vertices count from 0 in the whole table.
    """
    corners = surfaces.corners
    first = np.repeat(surfaces.vertex_start[:-1], np.asarray(surfaces.num_faces))
    if corners.shape[1] == 3:
        start = 3 * np.arange(len(corners) + 1, dtype=np.int64)
        return start, (corners + first[:, np.newaxis]).ravel()
    # Polygons have their vertices in the order of the faces, and share none.
    count = len(surfaces.pressure)
    return np.append(corners[:, 0] + first, count), np.arange(count, dtype=np.int64)


def triangles_of(surfaces: Any) -> tuple[IntArray, IntArray]:
    """Return triangles (t, 3) of all faces of a table, as fans, and the face (t,) of each.

    Rows of vertices count from 0 in the whole table. Pressure is linear on a face, so that it is
    on the triangles of a fan.
    """
    start, corners = corner_rows(surfaces)
    counts = np.diff(start) - 2
    face = np.repeat(np.arange(len(counts)), counts)
    k = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
    first = start[face]
    return corners[np.stack([first, first + k + 1, first + k + 2], axis=1)], face


def pressure_colors(pressure: NDArray[np.float64], scale: float) -> NDArray[np.float32]:
    """Return colours ``(n, 4)`` of pressures ``(n,)`` in Pa; ``scale`` is that of red."""
    steps = np.linspace(0.0, scale, len(_COLORS))
    result = np.ones((len(pressure), 4), dtype=np.float32)
    for channel in range(3):
        result[:, channel] = np.interp(pressure, steps, _COLORS[:, channel])
    return result


def colored_corners(
    surfaces: Any, scale: float
) -> tuple[NDArray[np.float64], NDArray[np.float32]]:  # fmt: skip
    """Return the corners of all triangles, ``(3 t, 3)`` in W in m, and colours ``(3 t, 4)``."""
    triangles, _ = triangles_of(surfaces)
    rows = triangles.ravel()
    return surfaces.vertices_W[rows], pressure_colors(surfaces.pressure, scale)[rows]

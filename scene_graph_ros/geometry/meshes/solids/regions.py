"""Boxes around the regions that polygons bound, but for those as thin as rounding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.levels import area_vectors, Rings

__all__ = ["region_boxes"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_THIN = 1e-9
"""Relative to the size: nearer to a surface a side may be either. A region that is thinner, by
twice its volume over its area, has no other points."""


def region_boxes(
    points: FloatArray, rings: Rings, is_above: BoolArray, is_below: BoolArray
) -> FloatArray:
    """Return the boxes (r, 2, 3), lower and upper, around the connected boundaries of a region.

    ``is_above`` and ``is_below`` (n,) tell of polygons over (k, 3) points whether the region is on
    their front side, and behind them.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    is_wall = is_above != is_below
    if not is_wall.any():
        return np.zeros((0, 2, 3))
    side = np.flatnonzero(is_wall[rings.polygon])
    n = len(points)
    ends = rings.start[side], rings.end[side]
    label = connected_components(coo_array((np.ones(len(side)), ends), shape=(n, n)))[1]
    of, row = np.unique(label[ends[0]], return_inverse=True)
    lower, upper = np.full((len(of), 3), np.inf), np.full((len(of), 3), -np.inf)
    np.minimum.at(lower, row, points[ends[0]])
    np.maximum.at(upper, row, points[ends[0]])
    # Outwards of the region, which is behind a polygon or on its front side.
    middles, vectors = area_vectors(points, rings)
    wall = np.flatnonzero(is_wall)
    first = side[np.searchsorted(rings.polygon[side], wall)]
    of_wall = np.searchsorted(of, label[rings.start[first]])
    outward = np.where(is_below[wall], 1.0, -1.0)[:, None] * vectors[wall]
    cones = np.einsum("ij,ij->i", middles[wall] - lower[of_wall], outward) / 3.0
    volume = np.bincount(of_wall, cones, len(of))
    area = np.bincount(of_wall, np.linalg.norm(vectors[wall], axis=1), len(of))
    size = float(np.abs(points).max())
    is_thick = 2.0 * np.abs(volume) > _THIN * size * area
    return np.stack([lower, upper], axis=1)[is_thick]

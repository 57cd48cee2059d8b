"""Height fields as convex sets: their prisms, or where these are many, boxes around blocks."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.v_polytope import VPolytope
from scene_graph_ros.geometry.model.height_set import HeightSet
from scene_graph_ros.geometry.shapes.height_field import HeightField

__all__ = ["MOST_PRISMS", "count_sets", "sets_of_field"]

MOST_PRISMS = 1000
"""A field of more is taken by boxes, of which each holds a block of 8 x 8 cells."""
_BLOCK = 8


def count_sets(shape: HeightField) -> int:
    """Return the number of sets of a field."""
    if shape.num_elements <= MOST_PRISMS:
        return shape.num_elements
    rows, cols = shape.heights.shape
    return -(-(rows - 1) // _BLOCK) * -(-(cols - 1) // _BLOCK)


def sets_of_field(now: HeightSet, X_FG: NDArray[np.float64]) -> list[ConvexSet]:
    """Return sets that hold all prisms of a field at ``X_FG`` ``(4, 4)``, in F."""
    corners = _boxes(now) if now.shape.num_elements > MOST_PRISMS else _prisms(now)
    return [VPolytope(each @ X_FG[:3, :3].T + X_FG[:3, 3]) for each in corners]


def _prisms(now: HeightSet) -> list[NDArray[np.float64]]:
    """Return the corners ``(6, 3)`` in G of each prism."""
    x, y = np.meshgrid(now.shape.x(), now.shape.y())
    grid = np.stack([x, y, now.heights], axis=2)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    tops = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2)
    tops = tops.reshape(-1, 3, 3)
    floors = tops.copy()
    floors[:, :, 2] = now.shape.floor
    return list(np.concatenate([tops, floors], axis=1))


def _boxes(now: HeightSet) -> list[NDArray[np.float64]]:
    """Return the corners ``(8, 3)`` in G of boxes around blocks of cells."""
    x, y, heights = now.shape.x(), now.shape.y(), now.heights
    sides = np.array(list(itertools.product((0, 1), repeat=3)), dtype=np.bool_)
    result = []
    for i in range(0, len(y) - 1, _BLOCK):
        for j in range(0, len(x) - 1, _BLOCK):
            rows, cols = slice(i, i + _BLOCK + 1), slice(j, j + _BLOCK + 1)
            top = heights[rows, cols].max()
            lower = np.array([x[cols][0], y[rows][0], now.shape.floor])
            result.append(np.where(sides, [x[cols][-1], y[rows][-1], top], lower))
    return result

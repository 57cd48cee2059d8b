"""The surface of a height field as triangles, for what draws it; queries never need it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.shapes.height_field import HeightField

__all__ = ["drawn_places", "field_triangles", "field_vertices"]

FloatArray = NDArray[np.float64]
Places = tuple[NDArray[np.int64], NDArray[np.int64]]


def drawn_places(shape: HeightField, most: int | None = None) -> Places:
    """Return the rows and columns of heights that are drawn: ``most`` of each, or all.

    They are as even as can be, and the first and last are among them.
    """
    counts = shape.heights.shape
    taken = [count if most is None else min(count, most) for count in counts]
    rows, cols = (
        np.linspace(0, count - 1, some).round().astype(np.int64)
        for count, some in zip(counts, taken, strict=True)
    )
    return rows, cols


def field_vertices(shape: HeightField, heights: FloatArray, places: Places) -> FloatArray:
    """Return the corners ``(v, 3)`` in G: of the surface, of its border on the floor, its middle.

    ``heights`` ``(rows, cols)`` are those of now.
    """
    rows, cols = places
    x, y = shape.x()[cols], shape.y()[rows]
    top = np.empty((len(rows), len(cols), 3))
    top[..., 0], top[..., 1], top[..., 2] = x, y[:, np.newaxis], heights[np.ix_(rows, cols)]
    corners = top.reshape(-1, 3)
    below = corners[_border(len(rows), len(cols))]
    below[:, 2] = shape.floor
    return np.concatenate([corners, below, [[0.0, 0.0, shape.floor]]])


def field_triangles(places: Places) -> NDArray[np.int64]:
    """Return the triangles ``(t, 3)`` of these corners, counter-clockwise seen from outside.

    The first are those of the elements, in their order, where all heights are drawn.
    """
    rows, cols = len(places[0]), len(places[1])
    at = (cols * np.arange(rows - 1)[:, np.newaxis] + np.arange(cols - 1)).reshape(-1, 1, 1)
    surface = (at + np.array([[0, 1, cols + 1], [0, cols + 1, cols]])).reshape(-1, 3)
    border = _border(rows, cols)
    k = np.arange(len(border))
    following = (k + 1) % len(border)
    below, middle = rows * cols + k, np.full(len(k), rows * cols + len(border))
    next_below = rows * cols + following
    return np.concatenate(
        [
            surface,
            np.column_stack([below, next_below, border[following]]),
            np.column_stack([below, border[following], border]),
            np.column_stack([middle, next_below, below]),
        ]
    )


def _border(rows: int, cols: int) -> NDArray[np.int64]:
    """Return the corners around the grid, counter-clockwise seen from above."""
    numbers = np.arange(rows * cols).reshape(rows, cols)
    return np.concatenate(
        [numbers[0, :-1], numbers[:-1, -1], numbers[-1, :0:-1], numbers[:0:-1, 0]]
    )

"""Which vertices of a hull can lie furthest along the directions of each cell of the sphere.

The cells are squares on the faces of a cube around the origin. A direction on a square is a mean
of the directions to its four corners, so a vertex further along all four of them than another is
further along each direction of the cell: the other one need not be looked at there. The rest
are the vertices whose normal cones reach into the cell, and few more.
"""

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.spatial.vectors import axpy, dot, subtract
from scene_graph_ros.geometry.tolerances import CELL_MARGIN

__all__ = ["CELL_LIMIT", "VertexCells", "cell_of", "cells_of"]

CELL_LIMIT = 256
"""A hull up to this many vertices is scanned. Of one that is in the caches cells are looked up in
less time from 64 vertices on, but among a thousand hulls they are fetched from memory."""

_FACES = 6

_FEWEST, _MOST = 4, 8
"""Cells along an edge of the cube: some three vertices for each cell, within limits."""
_SHARE = 18.0
_RIVALS = 5
"""Vertices that others are compared with: those furthest along the corners and the middle."""


class VertexCells(NamedTuple):
    """For each of ``6 * side * side`` cells, as ``cell_of`` counts them, its vertices."""

    side: int
    counts: np.ndarray
    """(cells,) int64."""
    numbers: np.ndarray
    """(sum of counts,) int64 of vertices: those of the first cell, then of the next; ascending."""


@lean_kernel
def _on_cube(face, i, j):
    """Return the direction on a face of the cube at (i, j), both between -1 and 1."""
    axis = face // 2
    a = 1.0 if face % 2 == 1 else -1.0
    if axis == 0:
        return (a, i, j)
    return (j, a, i) if axis == 1 else (i, j, a)


@lean_kernel
def cell_of(d, side):
    """Return the number of the cell that a direction d, not 0, is in."""
    x, y, z = abs(d[0]), abs(d[1]), abs(d[2])
    face, a, i, j = 4, z, d[0], d[1]
    is_positive = d[2] > 0.0
    if x >= y and x >= z:
        face, a, i, j = 0, x, d[1], d[2]
        is_positive = d[0] > 0.0
    elif y >= z:
        face, a, i, j = 2, y, d[2], d[0]
        is_positive = d[1] > 0.0
    half = 0.5 * side
    column = min(int(half * (i / a + 1.0)), side - 1)
    row = min(int(half * (j / a + 1.0)), side - 1)
    return ((face + is_positive) * side + column) * side + row


@lean_kernel
def _vertex(vertices, k):
    return (vertices[k, 0], vertices[k, 1], vertices[k, 2])


@lean_kernel
def _furthest(vertices, d):
    best, height = 0, dot(_vertex(vertices, 0), d)
    for k in range(1, vertices.shape[0]):
        along = dot(_vertex(vertices, k), d)
        if along > height:
            best, height = k, along
    return best


@lean_kernel
def _is_behind(v, rival, corners, margin):
    """Return whether a vertex lies behind a rival along each of four directions."""
    ahead = subtract(rival, v)
    return (
        dot(ahead, corners[0]) > margin
        and dot(ahead, corners[1]) > margin
        and dot(ahead, corners[2]) > margin
        and dot(ahead, corners[3]) > margin
    )


@lean_kernel
def _list_cell(vertices, corners, margin, numbers, at):
    """Write the vertices of a cell if there is room; return how many there are."""
    middle = axpy(1.0, corners[0], axpy(1.0, corners[1], axpy(1.0, corners[2], corners[3])))
    rivals = (
        _vertex(vertices, _furthest(vertices, middle)),
        _vertex(vertices, _furthest(vertices, corners[0])),
        _vertex(vertices, _furthest(vertices, corners[1])),
        _vertex(vertices, _furthest(vertices, corners[2])),
        _vertex(vertices, _furthest(vertices, corners[3])),
    )
    count = 0
    for k in range(vertices.shape[0]):
        v = _vertex(vertices, k)
        is_behind = False
        for r in range(_RIVALS):
            is_behind = is_behind or _is_behind(v, rivals[r], corners, margin)
        if is_behind:
            continue
        if at + count < numbers.shape[0]:
            numbers[at + count] = k
        count += 1
    return count


@lean_kernel
def _list_cells(vertices, side, margin, counts, numbers):
    """Write the vertices of all cells, as far as there is room; return how many there are."""
    total = 0
    step = 2.0 / side
    for cell in range(counts.shape[0]):
        face, column, row = cell // (side * side), cell // side % side, cell % side
        i, j = column * step - 1.0, row * step - 1.0
        corners = (
            _on_cube(face, i, j),
            _on_cube(face, i + step, j),
            _on_cube(face, i, j + step),
            _on_cube(face, i + step, j + step),
        )
        counts[cell] = _list_cell(vertices, corners, margin, numbers, total)
        total += counts[cell]
    return total


def cells_of(vertices: np.ndarray) -> VertexCells | None:
    """List the (v, 3) vertices of a hull, unless they are few."""
    if len(vertices) <= CELL_LIMIT:
        return None
    vertices = np.ascontiguousarray(vertices)
    side = int(np.clip(np.sqrt(len(vertices) / _SHARE), _FEWEST, _MOST))
    margin = CELL_MARGIN * float(np.abs(vertices).max())
    counts = np.zeros(_FACES * side * side, np.int64)
    numbers = np.empty(16 * len(vertices), np.int64)
    total = _list_cells(vertices, side, margin, counts, numbers)
    if total > len(numbers):
        numbers = np.empty(total, np.int64)
        _list_cells(vertices, side, margin, counts, numbers)
    return VertexCells(side, counts, numbers[:total].copy())

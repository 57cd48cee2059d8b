"""Cells around bodies that tell which points are near: most points need no distance of their own.

A signed distance to a convex body changes by at most the way that a point goes. So the distance d
at the centre of a cell of half diagonal r decides for all of the cell: up to ``padding - r`` they
are near, above ``padding + r`` they are not. A cell is measured when a point first lies in it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array

__all__ = [
    "FAR",
    "NEAR",
    "OPEN",
    "ROBOT",
    "UNSURE",
    "WANTED",
    "NearCells",
    "PlacedBoxes",
    "mark_image",
    "mark_points",
    "new_cells",
]

OPEN, ROBOT = 0, 1
"""Of a pixel or point: it shows something else, or a body of the robot."""

UNKNOWN, UNSURE, WANTED, NEAR, FAR = 0, 4, 5, 6, 7
"""Of a cell: it was not asked for, some of its points may be near, it is to be measured, all of
its points are near, none is. A pixel or point in a cell that is unsure, or wanted, is marked so.
"""

_MOST_CELLS = 1 << 21
"""Of a body; a byte each."""

_MOST_ALONG = 1 << 10

_SHARE = 0.98
"""Of the largest edge at which points on a body's surface are in cells that are near."""

_corners = stack_array((8, 3))


class NearCells(NamedTuple):
    """The kernels' table of b bodies."""

    corners: NDArray[np.float64]
    """``(b, 3)`` m: the lower corner of the first cell, in the body's frame B."""
    edges: NDArray[np.float64]
    """``(b,)`` m."""
    sizes: NDArray[np.int64]
    """``(b, 3)``: how many there are along each axis; 0 where no cell tells anything."""
    starts: NDArray[np.int64]
    """``(b + 1,)``: each body's first in ``states``."""
    states: NDArray[np.uint8]

    def centers(self, cells: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the bodies of cells ``(m,)``, and their centres in B ``(m, 3)``, m."""
        body = np.searchsorted(self.starts, cells, side="right") - 1
        rest, k = np.divmod(cells - self.starts[body], self.sizes[body, 2])
        i, j = np.divmod(rest, self.sizes[body, 1])
        places = np.stack([i, j, k], axis=1) + 0.5
        return body, self.corners[body] + places * self.edges[body, np.newaxis]


class PlacedBoxes(NamedTuple):
    """Padded boxes of b bodies, seen from a frame C."""

    X_BCs: NDArray[np.float64]
    """``(b, 4, 4)``."""
    centers: NDArray[np.float64]
    """``(b, 3)`` m, in B."""
    halves: NDArray[np.float64]
    """``(b, 3)`` m: half the edges."""


def new_cells(
    centers: NDArray[np.float64],
    halves: NDArray[np.float64],
    padding: float,
    is_convex: NDArray[np.bool_],
) -> NearCells:
    """Return cells that cover the padded boxes of bodies, none of them measured.

    The edge is as large as lets a point of the surface be near by its cell, if there is a padding.
    """
    lengths = 2.0 * halves
    edges = np.maximum(_SHARE * padding / np.sqrt(3.0), lengths.max(axis=1) / _MOST_ALONG)
    edges = np.maximum(edges, np.cbrt(lengths.prod(axis=1) / _MOST_CELLS))
    if not padding > 0.0:
        edges = np.maximum(edges, lengths.max(axis=1) / 64)
    edges[~(edges > 0.0)] = 1.0
    sizes = np.minimum(np.floor(lengths / edges[:, np.newaxis]) + 1.0, _MOST_ALONG + 1.0)
    sizes[~(is_convex & np.isfinite(lengths).all(axis=1))] = 0.0
    counts = sizes.astype(np.int64)
    starts = np.concatenate([[0], np.cumsum(counts.prod(axis=1))])
    states = np.zeros(int(starts[-1]), np.uint8)
    return NearCells(centers - halves, edges, counts, starts, states)


@inlined_kernel
def _state_of(cells, body, x, y, z):
    """Return the state of the cell that a point of B is in, and note that it is wanted."""
    if cells.sizes[body, 0] == 0:
        return UNSURE
    edge, corner, size = cells.edges[body], cells.corners[body], cells.sizes[body]
    i = min(max(int((x - corner[0]) / edge), 0), size[0] - 1)
    j = min(max(int((y - corner[1]) / edge), 0), size[1] - 1)
    k = min(max(int((z - corner[2]) / edge), 0), size[2] - 1)
    at = cells.starts[body] + (i * size[1] + j) * size[2] + k
    if cells.states[at] == UNKNOWN:
        cells.states[at] = WANTED
    return cells.states[at]


@inlined_kernel
def _mark(boxes, cells, body, x, y, z, mark):
    """Return the mark of a point of C that had one, after a body was looked at."""
    X, center, half = boxes.X_BCs[body], boxes.centers[body], boxes.halves[body]
    at_x = X[0, 0] * x + X[0, 1] * y + X[0, 2] * z + X[0, 3]
    at_y = X[1, 0] * x + X[1, 1] * y + X[1, 2] * z + X[1, 3]
    at_z = X[2, 0] * x + X[2, 1] * y + X[2, 2] * z + X[2, 3]
    if not (
        abs(at_x - center[0]) <= half[0]
        and abs(at_y - center[1]) <= half[1]
        and abs(at_z - center[2]) <= half[2]
    ):
        return mark
    state = _state_of(cells, body, at_x, at_y, at_z)
    if state == FAR:
        return mark
    if state == NEAR:
        return ROBOT
    return max(mark, state)


@inlined_kernel
def _take(u, v, bounds):
    """Return bounds of a window that hold a pixel, too."""
    return min(bounds[0], v), max(bounds[1], v), min(bounds[2], u), max(bounds[3], u)


@inlined_kernel
def _window(X, center, half, lens, near):
    """Return the first and last row and column, in pixels, and the depths that may show a box.

    Where the view's plane at ``near``, m, cuts the box, the cuts of its edges count.
    """
    corners, bounds = _corners(), (np.inf, -np.inf, np.inf, -np.inf)
    low, high = np.inf, -np.inf
    for i in range(8):
        a = center[0] + half[0] * (2 * (i >> 2) - 1) - X[0, 3]
        b = center[1] + half[1] * (2 * (i >> 1 & 1) - 1) - X[1, 3]
        c = center[2] + half[2] * (2 * (i & 1) - 1) - X[2, 3]
        for axis in range(3):
            corners[i, axis] = X[0, axis] * a + X[1, axis] * b + X[2, axis] * c
        low, high = min(low, corners[i, 2]), max(high, corners[i, 2])
    for i in range(8):
        x, y, z = corners[i, 0], corners[i, 1], corners[i, 2]
        if z >= near:
            bounds = _take(lens.fx * x / z + lens.cx, lens.fy * y / z + lens.cy, bounds)
        for axis in range(3):
            j = i | 1 << axis
            if i != j and (z < near) != (corners[j, 2] < near):
                ratio = (near - z) / (corners[j, 2] - z)
                at_x = x + ratio * (corners[j, 0] - x)
                at_y = y + ratio * (corners[j, 1] - y)
                bounds = _take(
                    lens.fx * at_x / near + lens.cx, lens.fy * at_y / near + lens.cy, bounds
                )
    return bounds, low, high


@inlined_kernel
def _clipped(low, high, step, most):
    """Return the first block of pixels of a window, and the one after its last."""
    first = min(max(np.floor(low / step) - 1.0, 0.0), float(most))
    last = min(max(np.ceil(high / step) + 2.0, 0.0), float(most))
    return int(first), int(last)


@lean_kernel
def mark_image(planes, lens, step, near, boxes, cells, mask):
    """Mark the blocks of pixels that show bodies; ``planes`` ``(3, rows, columns)`` are points.

    Returns how many are marked, how many of these are unsure, and how many are in wanted cells.
    """
    rows, columns = mask.shape
    for body in range(len(boxes.centers)):
        X, center, half = boxes.X_BCs[body], boxes.centers[body], boxes.halves[body]
        bounds, low, high = _window(X, center, half, lens, near)
        if bounds[0] > bounds[1]:
            continue
        slack = 1e-9 * (abs(low) + abs(high))
        low, high = max(low - slack, 0.0), high + slack
        first, last = _clipped(bounds[0], bounds[1], step, rows)
        left, right = _clipped(bounds[2], bounds[3], step, columns)
        for i in range(first, last):
            for j in range(left, right):
                z = planes[2, i, j]
                if z > low and z <= high and mask[i, j] != ROBOT:
                    x, y = planes[0, i, j], planes[1, i, j]
                    mask[i, j] = _mark(boxes, cells, body, x, y, z, mask[i, j])
    marked = unsure = wanted = 0
    for i in range(rows):
        for j in range(columns):
            marked += mask[i, j] != OPEN
            unsure += mask[i, j] == UNSURE
            wanted += mask[i, j] == WANTED
    return marked, unsure, wanted


@lean_kernel
def mark_points(points, boxes, lower, upper, cells, mask):
    """Mark the points ``(n, 3)`` of C that are near bodies; returns the same as ``mark_image``.

    ``lower`` and ``upper`` ``(b, 3)`` are the corners of boxes along the axes of C around the
    padded ones.
    """
    least, most = (np.inf, np.inf, np.inf), (-np.inf, -np.inf, -np.inf)
    for body in range(len(lower)):
        a, b = lower[body], upper[body]
        least = min(least[0], a[0]), min(least[1], a[1]), min(least[2], a[2])
        most = max(most[0], b[0]), max(most[1], b[1]), max(most[2], b[2])
    for k in range(len(points)):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        if not (least[0] <= x <= most[0] and least[1] <= y <= most[1]):
            continue
        if not least[2] <= z <= most[2]:
            continue
        for body in range(len(lower)):
            a, b = lower[body], upper[body]
            if (a[0] <= x) & (x <= b[0]) & (a[1] <= y) & (y <= b[1]) & (a[2] <= z) & (z <= b[2]):
                mask[k] = _mark(boxes, cells, body, x, y, z, mask[k])
                if mask[k] == ROBOT:
                    break
    marked = unsure = wanted = 0
    for k in range(len(mask)):
        marked += mask[k] != OPEN
        unsure += mask[k] == UNSURE
        wanted += mask[k] == WANTED
    return marked, unsure, wanted

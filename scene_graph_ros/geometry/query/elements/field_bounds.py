"""How near prisms of a height field may be to a shape, at least: for a row of eight nodes in step.

A node is a block of 8 x 8 cells (level 1), or of 8 x 8 nodes of the level below. Two kinds of
bounds are there: of the box around a node against the shape's own box (``covers``), and along a
direction m in which the shape is known to begin at ``m . x = h`` (a plane, from the shape's origin
on): below it a node reaches as far as its highest corner.
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import as_lanes, LANES, larger, load_lanes, smaller
from scene_graph_ros.geometry.query.elements.covers import from_centers
from scene_graph_ros.geometry.tables.height_grid import FLOOR, SIZE_X, SIZE_Y, x_of, y_of

__all__ = ["below_plane", "box_bounds", "clipped", "nodes_of_row", "width_of"]

_NUMBERS = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)


@inlined_kernel
def width_of(level):
    """Return the width of a node of a level, in cells."""
    width = 1
    for _ in range(level):
        width *= LANES
    return width


@inlined_kernel
def clipped(grid, level, cover, best):
    """Return (first row, last row, first column, last column) of the nodes that may be near.

    These are the ones below or beside a shape's box, up to ``best``.
    """
    rows, cols = grid.counts[level, 0], grid.counts[level, 1]
    if cover[8] or best == math.inf:
        return 0, rows - 1, 0, cols - 1
    width, out = width_of(level), max(best, 0.0)
    p, center, half = cover[2], cover[3], cover[6]
    dx = width * grid.numbers[SIZE_X] / grid.counts[0, 1]
    dy = width * grid.numbers[SIZE_Y] / grid.counts[0, 0]
    x = (p[0] + center[0] + 0.5 * grid.numbers[SIZE_X]) / dx
    y = (p[1] + center[1] + 0.5 * grid.numbers[SIZE_Y]) / dy
    # Rounding of places, in nodes, is far below this.
    along_x = (half[0] + out) / dx + 1e-6 + 1e-12 * abs(x)
    along_y = (half[1] + out) / dy + 1e-6 + 1e-12 * abs(y)
    return (
        int(max(0.0, min(y - along_y, float(rows)))),
        int(max(0.0, min(y + along_y + 1.0, float(rows)))) - 1,
        int(max(0.0, min(x - along_x, float(cols)))),
        int(max(0.0, min(x + along_x + 1.0, float(cols)))) - 1,
    )


@inlined_kernel
def nodes_of_row(grid, level, i, j):
    """Return (x, x, y, y, top): the corners of eight nodes from (i, j) on, and how high they are.

    Behind the last column there is nothing that means anything.
    """
    width, cols = width_of(level), grid.counts[0, 1]
    wide = np.float64(width)
    columns = as_lanes(_NUMBERS) + np.float64(j)
    x_lower = x_of(grid, smaller(columns * wide, np.float64(cols)))
    x_upper = x_of(grid, smaller((columns + 1.0) * wide, np.float64(cols)))
    y_lower = y_of(grid, i * width)
    y_upper = y_of(grid, min((i + 1) * width, grid.counts[0, 0]))
    top = load_lanes(grid.tops, grid.starts[level - 1] + i * grid.counts[level, 1] + j)
    return x_lower, x_upper, y_lower, y_upper, top


@inlined_kernel
def box_bounds(grid, row, cover):
    """Return lower bounds of the signed distances of a row's nodes."""
    x_lower, x_upper, y_lower, y_upper, top = row
    p, floor = cover[2], grid.numbers[FLOOR]
    return from_centers(
        cover,
        0.5 * ((x_lower - p[0]) + (x_upper - p[0])),
        0.5 * ((y_lower - p[1]) + (y_upper - p[1])),
        0.5 * ((top - p[2]) + (floor - p[2])),
        0.5 * (x_upper - x_lower),
        0.5 * (y_upper - y_lower),
        0.5 * (top - floor),
    )


@inlined_kernel
def below_plane(grid, row, p, plane):
    """Return lower bounds of the same along a direction: plane (x, y, z, h) from p on."""
    x_lower, x_upper, y_lower, y_upper, top = row
    mx, my, mz, h = plane
    x = larger(mx * (x_lower - p[0]), mx * (x_upper - p[0]))
    y = max(my * (y_lower - p[1]), my * (y_upper - p[1]))
    z = larger(mz * (top - p[2]), mz * (grid.numbers[FLOOR] - p[2]))
    return h - (x + y + z)

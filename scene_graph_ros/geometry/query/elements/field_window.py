"""The prisms below a rectangle of a field's cells, bounded along directions and measured in turn.

Planes are those of ``field_planes``. Eight cells of a row are bounded in step, each of the two
prisms below a cell by its own corners.
"""

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    as_lanes,
    every,
    LANES,
    larger,
    load_lanes,
    select,
    smaller,
    store_lanes,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.tables.height_grid import FLOOR, x_of, y_of
from scene_graph_ros.geometry.tables.vertex_scan import lane_of_largest, NUMBERS

__all__ = ["MOST_ROWS", "Window", "bound_prisms", "bounds_of", "fits"]

MOST_ROWS = 64
"""Rows of eight cells that are bounded together."""

_bounds = stack_array((MOST_ROWS * 2 * LANES,))
_ys = stack_array((MOST_ROWS + 1,))


class Window(NamedTuple):
    """A rectangle of cells, and what is known of the prisms below them."""

    top: int
    """The first row; the next one is the last row."""
    bottom: int
    left: int
    """The first column; the next one is the last column."""
    right: int
    bounds: np.ndarray
    """Lower bounds, m: of eight cells' first prisms, then of their second ones; row by row of the
    first eight columns of the rectangle, then of the next eight."""
    ys: np.ndarray
    """m: where the rows begin, and the last one ends, from the shape's origin on."""


@inlined_kernel
def fits(near):
    """Return True for a rectangle that can be bounded at once; it may have no cells."""
    top, bottom, left, right = near
    return (bottom - top + 1) * ((right - left + LANES) // LANES) <= MOST_ROWS


@inlined_kernel
def bounds_of(near, grid, p):
    """Return a Window of a rectangle (first row, last row, first column, last column) with cells.

    Nothing is known of its prisms, and beside it there are none; p is the shape's origin.
    """
    top, bottom, left, right = near
    bounds, ys, place = _bounds(), _ys(), 0
    for i in range(top, bottom + 2):
        ys[i - top] = y_of(grid, i) - p[1]
    for j in range(left, right + 1, LANES):
        is_inside = as_lanes(NUMBERS) <= np.float64(right - j)
        lanes = select(is_inside, every(-math.inf), every(math.inf))
        for _ in range(2 * (bottom - top + 1)):
            store_lanes(bounds, place, lanes)
            place += LANES
    return Window(top, bottom, left, right, bounds, ys)


@inlined_kernel
def _height(grid, at, slope, p):
    """Return how far eight corners reach along z, of which the direction has ``slope``, lanes."""
    top = slope * (load_lanes(grid.heights, at) - p[2])
    return larger(top, every(slope * (grid.numbers[FLOOR] - p[2])))


@inlined_kernel
def _raised(window, place, bounds):
    """Raise eight bounds; return them."""
    raised = larger(load_lanes(window.bounds, place), bounds)
    store_lanes(window.bounds, place, raised)
    return raised


@inlined_kernel
def _raise_columns(window, grid, j, place, p, plane, nearest):
    """Raise the bounds of eight columns' prisms to those of a plane.

    Returns the least bound so far in each column of eight, and where in the array its row begins.
    """
    mx, my, mz, h = plane
    least, where = nearest
    cols, columns, ys = grid.counts[0, 1] + 1, as_lanes(NUMBERS) + np.float64(j), window.ys
    left = h - mx * (x_of(grid, columns) - p[0])
    right = h - mx * (x_of(grid, columns + 1.0) - p[0])
    at = window.top * cols + j
    lower_left = (left - my * ys[0]) - _height(grid, at, mz, p)
    lower_right = (right - my * ys[0]) - _height(grid, at + 1, mz, p)
    for i in range(1, window.bottom - window.top + 2):
        at += cols
        upper_left = (left - my * ys[i]) - _height(grid, at, mz, p)
        upper_right = (right - my * ys[i]) - _height(grid, at + 1, mz, p)
        shared = smaller(lower_left, upper_right)
        raised = smaller(
            _raised(window, place, smaller(shared, lower_right)),
            _raised(window, place + LANES, smaller(shared, upper_left)),
        )
        where = select(raised < least, every(np.float64(place)), where)
        least = smaller(raised, least)
        place += 2 * LANES
        lower_left, lower_right = upper_left, upper_right
    return least, where


@inlined_kernel
def bound_prisms(window, grid, p, planes, first, last):
    """Raise the bounds of all prisms to those of some planes, (x, y, z, h) from p on.

    Returns (the least bound, its place, the prism).
    """
    rows = window.bottom - window.top + 1
    nothing = every(math.inf), every(0.0)
    nearest = nothing
    for k in range(first, last):
        plane = planes[k, 0], planes[k, 1], planes[k, 2], planes[k, 3]
        nearest, place = nothing, 0
        for j in range(window.left, window.right + 1, LANES):
            nearest = _raise_columns(window, grid, j, place, p, plane, nearest)
            place += 2 * LANES * rows
    least, where = nearest
    lane = lane_of_largest(-least)
    place = int(where[lane]) + lane
    half = int(window.bounds[place] > window.bounds[place + LANES])
    row = int(where[lane]) // (2 * LANES)
    i, j = window.top + row % rows, window.left + row // rows * LANES + lane
    return least[lane], place + LANES * half, 2 * (i * grid.counts[0, 1] + j) + half

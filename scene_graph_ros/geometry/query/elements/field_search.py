"""The prism of a height field that is nearest to a shape, or deepest in it.

Branch and bound in the pyramid of the heights, in the nodes below the shape's box only. Of a block
of 8 x 8 cells the one with the least bound is looked at first. Each prism that is measured tells a
direction (``element_search``), so that of a hundred cells below a body that stands on them a few
are measured.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    as_lanes,
    LANES,
    larger,
    load_lanes,
    select,
    store_lanes,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.narrowphase.cores.questions import support
from scene_graph_ros.geometry.query.distance.dispatch import core_of
from scene_graph_ros.geometry.query.elements.covers import cover_of
from scene_graph_ros.geometry.query.elements.element_places import (
    grid_of,
    prism_row_of,
)
from scene_graph_ros.geometry.query.elements.element_search import (
    CELLS,
    least_cell,
    measured,
    nothing_yet,
    plane_of,
    PLANES,
    put,
)
from scene_graph_ros.geometry.query.elements.field_bounds import (
    below_plane,
    box_bounds,
    clipped,
    nodes_of_row,
)
from scene_graph_ros.geometry.query.elements.nearest import NONE
from scene_graph_ros.geometry.spatial.vectors import column, dot
from scene_graph_ros.geometry.tables.height_grid import (
    FLOOR,
    HeightGrid,
    SIZE_X,
    SIZE_Y,
    x_of,
    y_of,
)
from scene_graph_ros.geometry.tables.held_table import borrowed_table
from scene_graph_ros.geometry.tables.prism_slots import prism_origin, write_prism

__all__ = ["nearest_prism"]

_STACK = 512
"""Nodes that wait: 63 for each level but the cells', and one; there are at most eight levels."""
_NUMBERS = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)

_nodes = stack_array((_STACK, 3), np.int64)
_gaps = stack_array((_STACK,))
_cells = stack_array((CELLS,))
_planes = stack_array((PLANES, 4))
_low = stack_array((LANES,))
_kept = stack_array((2,), np.int64)


@inlined_kernel
def _reach(table, j, R_FB, axis):
    """Return (least, largest) of a shape along an axis of F, from its origin."""
    core, x = core_of(table, j), (R_FB[3 * axis], R_FB[3 * axis + 1], R_FB[3 * axis + 2])
    upper, _ = support(core, table.hulls.blocks, x)
    lower, _ = support(core, table.hulls.blocks, (-x[0], -x[1], -x[2]))
    return dot(x, lower) - core[2], dot(x, upper) + core[2]


@inlined_kernel
def _fitted(table, j, R_FB, cover):
    """Return a cover with the shape's own extents along the axes of F.

    Those of its box may be larger by three quarters, and so would be the cells below it.
    """
    R, sizes, p, _, c_B, half, _, length, is_half_space = cover
    if is_half_space:
        return cover
    x, y, z = (_reach(table, j, R_FB, 0), _reach(table, j, R_FB, 1), _reach(table, j, R_FB, 2))
    center = 0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]), 0.5 * (z[0] + z[1])
    turned = 0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0]), 0.5 * (z[1] - z[0])
    return R, sizes, p, center, c_B, half, turned, length, is_half_space


@inlined_kernel
def _lengths(grid, cover):
    """Return a length that a pair's rounding errors are relative to, beside its distance."""
    c, half = cover[3], cover[6]
    body = abs(c[0]) + abs(c[1]) + abs(c[2]) + half[0] + half[1] + half[2]
    cell = grid.numbers[SIZE_X] / grid.counts[0, 1] + grid.numbers[SIZE_Y] / grid.counts[0, 0]
    top = grid.tops[grid.starts[len(grid.starts) - 1] - 1]
    return body + cell + (top - grid.numbers[FLOOR])


@inlined_kernel
def _row_bounds(grid, level, i, j, cover, planes, count):
    """Return lower bounds of eight nodes from (i, j) on."""
    row = nodes_of_row(grid, level, i, j)
    bounds = box_bounds(grid, row, cover)
    for k in range(count):
        plane = (planes[k, 0], planes[k, 1], planes[k, 2], planes[k, 3])
        bounds = larger(bounds, below_plane(grid, level, i, j, row, cover[2], plane))
    return bounds


@inlined_kernel
def _bounded(bounds, j, first, last):
    """Return the bounds of columns from ``first`` to ``last``, infinite ones of others."""
    columns = as_lanes(_NUMBERS) + np.float64(j)
    inside = select(columns < np.float64(first), math.inf, bounds)
    return select(columns > np.float64(last), math.inf, inside)


@inlined_kernel
def _open_block(grid, node, cover, planes, count, worth, nodes, gaps, low, waiting):
    """Put the nodes below one on the stack that may be nearer than ``worth``, the nearest last."""
    level, i, j = node
    below, begin = level - 1, waiting
    top, bottom, left, right = clipped(grid, below, cover, worth)
    first = LANES * j
    for row in range(max(top, LANES * i), min(bottom, LANES * i + LANES - 1) + 1):
        bounds = _row_bounds(grid, below, row, first, cover, planes, count)
        store_lanes(low, 0, _bounded(bounds, first, left, right))
        for lane in range(LANES):
            if low[lane] < worth:
                k = waiting
                while k > begin and gaps[k - 1] < low[lane]:
                    gaps[k] = gaps[k - 1]
                    nodes[k, 0], nodes[k, 1], nodes[k, 2] = (
                        nodes[k - 1, 0],
                        nodes[k - 1, 1],
                        nodes[k - 1, 2],
                    )
                    k -= 1
                gaps[k], nodes[k, 0], nodes[k, 1], nodes[k, 2] = (
                    low[lane],
                    below,
                    row,
                    first + lane,
                )
                waiting += 1
    return waiting


@inlined_kernel
def _block_below(grid, cover):
    """Return (i, j) of the block of cells that is below a shape's middle, or the nearest one."""
    p, center, rows, cols = cover[2], cover[3], grid.counts[0, 0], grid.counts[0, 1]
    y = ((p[1] + center[1]) / grid.numbers[SIZE_Y] + 0.5) * rows
    x = ((p[0] + center[0]) / grid.numbers[SIZE_X] + 0.5) * cols
    i, j = int(max(0.0, min(y, rows - 1.0))), int(max(0.0, min(x, cols - 1.0)))
    return i // LANES, j // LANES


@inlined_kernel
def _bound_cells(grid, i, j, cover, planes, count, worth, cells):
    """Write the lower bounds of the 8 x 8 cells of a block; return its rows that may be near."""
    top, bottom, left, right = clipped(grid, 0, cover, worth)
    for k in range(LANES):
        row = LANES * i + k
        if row < top or row > bottom:
            store_lanes(cells, LANES * k, as_lanes(_NUMBERS) + math.inf)
            continue
        bounds = _row_bounds(grid, 0, row, LANES * j, cover, planes, count)
        store_lanes(cells, LANES * k, _bounded(bounds, LANES * j, left, right))
    return max(top - LANES * i, 0), min(bottom - LANES * i, LANES - 1)


@inlined_kernel
def _bound_again(grid, i, j, near, p, plane, cells):
    """Raise the bounds of a block's cells in some rows to what a new direction tells."""
    for k in range(near[0], near[1] + 1):
        row = LANES * i + k
        nodes = nodes_of_row(grid, 0, row, LANES * j)
        bounds = below_plane(grid, 0, row, LANES * j, nodes, p, plane)
        store_lanes(cells, LANES * k, larger(load_lanes(cells, LANES * k), bounds))


@inlined_kernel
def _is_behind(grid, element, p, planes, count, worth):
    """Return True for a prism that some direction proves to be no nearer than ``worth``."""
    cell, cols = element // 2, grid.counts[0, 1]
    i, j = cell // cols, cell % cols
    x0, x1 = x_of(grid, j) - p[0], x_of(grid, j + 1) - p[0]
    y0, y1 = y_of(grid, i) - p[1], y_of(grid, i + 1) - p[1]
    at = i * (cols + 1) + j
    ha, hc = grid.heights[at] - p[2], grid.heights[at + cols + 2] - p[2]
    is_first = element % 2 == 0
    hb = grid.heights[at + 1 if is_first else at + cols + 1] - p[2]
    xb, yb = (x1, y0) if is_first else (x0, y1)
    floor = grid.numbers[FLOOR] - p[2]
    for k in range(count):
        mx, my, mz, h = planes[k, 0], planes[k, 1], planes[k, 2], planes[k, 3]
        front = max(
            mx * x0 + my * y0 + mz * (ha if mz > 0.0 else floor),
            mx * xb + my * yb + mz * (hb if mz > 0.0 else floor),
            mx * x1 + my * y1 + mz * (hc if mz > 0.0 else floor),
        )
        if h - front >= worth:
            return True
    return False


class _Search(NamedTuple):
    """What a search reads, and where it writes the directions and the bounds of a block."""

    places: np.ndarray
    row: int
    """Of the prism that is measured."""
    j: int
    grid: HeightGrid
    cover: Any
    X_FB: Any
    planes: np.ndarray
    kept: np.ndarray
    """How many directions there are, and which is replaced next."""
    cells: np.ndarray


@inlined_kernel
def _keep_plane(search, nhat, block, near):
    """Keep a direction, and bound the cells of a block by it, in some rows."""
    table, (R_FB, p_FB) = borrowed_table(search.places), search.X_FB
    is_plane, plane = plane_of(table, search.j, R_FB, nhat)
    if not is_plane:
        return
    put(search.planes, search.kept, plane)
    _bound_again(search.grid, block[0], block[1], near, p_FB, plane, search.cells)


@inlined_kernel
def _measure(search, found, prism, tolerance):
    """Return (the nearest prism so far, the direction out of the shape) after a look at one."""
    grid = search.grid
    write_prism(borrowed_table(search.places), search.row, grid, prism)
    length = _lengths(grid, search.cover)
    return measured(
        search.places, search.row, search.j, search.X_FB, prism_origin(grid, prism), found, prism,
        length, tolerance,
    )  # fmt: skip


@inlined_kernel
def _search_cells(search, found, block, tolerance):
    """Return the nearest prism so far after a look at a block of 8 x 8 cells."""
    grid, cover, cells = search.grid, search.cover, search.cells
    i, k = block
    planes, count = search.planes, search.kept[0]
    near = _bound_cells(grid, i, k, cover, planes, count, found.worth, cells)
    for _ in range(CELLS):
        at = least_cell(cells)
        if not cells[at] < found.worth:
            break
        cells[at] = math.inf
        cell = (LANES * i + at // LANES) * grid.counts[0, 1] + LANES * k + at % LANES
        for half in range(2):
            prism = 2 * cell + half
            p, count = search.X_FB[1], search.kept[0]
            if not _is_behind(grid, prism, p, planes, count, found.worth):
                found, nhat = _measure(search, found, prism, tolerance)
                if not cover[8]:
                    _keep_plane(search, nhat, block, near)
    return found


@inlined_kernel
def nearest_prism(places, field, j, R_FB, p_FB, max_distance, tolerance):
    """Return (phi, p_Fa, p_Fb, nhat_BA_F, gap, element) of a field F and the shape of row j, B.

    ``element`` is the prism that is nearest, A, or NONE where all are farther than
    ``max_distance``: then phi is a lower bound above that, without witnesses and with an infinite
    gap. ``places`` have a slot for this thread's prisms.
    """
    grid = grid_of(places, field)
    table = borrowed_table(places)
    cover = _fitted(table, j, R_FB, cover_of(table, j, R_FB, p_FB))
    nodes, gaps, planes, low, kept = _nodes(), _gaps(), _planes(), _low(), _kept()
    row, X_FB, cells = prism_row_of(places), (R_FB, p_FB), _cells()
    search = _Search(places, row, j, grid, cover, X_FB, planes, kept, cells)
    found = nothing_yet(max_distance)
    kept[0], kept[1] = 0, 0
    if cover[8]:
        normal = column(R_FB, 2)  # all prisms are measured along it
        planes[0, 0], planes[0, 1], planes[0, 2] = -normal[0], -normal[1], -normal[2]
        planes[0, 3], kept[0] = 0.0, 1
    # The block below the shape is looked at first: then the others are known to be near or not.
    seed = _block_below(grid, cover)
    nodes[0, 0], nodes[0, 1], nodes[0, 2], gaps[0] = len(grid.counts) - 1, 0, 0, -math.inf
    nodes[1, 0], nodes[1, 1], nodes[1, 2], gaps[1] = 1, seed[0], seed[1], -math.inf
    waiting, is_begun = 2, False
    while waiting > 0:
        waiting -= 1
        level, i, k = nodes[waiting, 0], nodes[waiting, 1], nodes[waiting, 2]
        if gaps[waiting] >= found.worth:
            continue
        if level > 1:
            waiting = _open_block(
                grid, (level, i, k), cover, planes, kept[0], found.worth, nodes, gaps, low, waiting
            )
            continue
        if not is_begun or i != seed[0] or k != seed[1]:
            found = _search_cells(search, found, (i, k), tolerance)
        is_begun = True
    gap = found.gap + (found.phi - found.worth) if found.element != NONE else math.inf
    return found.phi, found.p_Fa, found.p_Fb, found.nhat, gap, found.element

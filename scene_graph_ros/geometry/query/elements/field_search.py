"""The prism of a height field that is nearest to a shape, or deepest in it.

A shape's lowest point is so high above the ground, and no farther is the nearest prism. Where the
rectangle of cells below and beside the shape up to there is small, all its prisms are bounded
(``field_window``), and measured from the least bound on. Else it is branch and bound in the
pyramid of the heights, down to blocks of 8 x 8 cells, which are such rectangles. Each prism that
is measured tells a direction (``element_search``), so that of hundreds of prisms below a body
that stands on them a few are measured.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    as_lanes,
    LANES,
    larger,
    select,
    store_lanes,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.query.elements.covers import cover_of
from scene_graph_ros.geometry.query.elements.element_places import (
    grid_of,
    prism_row_of,
)
from scene_graph_ros.geometry.query.elements.element_search import (
    measured,
    nothing_yet,
    plane_of,
    PLANES,
    put,
    SLACK,
)
from scene_graph_ros.geometry.query.elements.field_bounds import (
    below_plane,
    box_bounds,
    clipped,
    nodes_of_row,
)
from scene_graph_ros.geometry.query.elements.field_planes import (
    FIXED,
    NUM_DIRECTIONS,
    plane_before,
    write_extents,
    write_planes,
)
from scene_graph_ros.geometry.query.elements.field_window import bound_prisms, bounds_of, fits
from scene_graph_ros.geometry.query.elements.nearest import NONE
from scene_graph_ros.geometry.spatial.vectors import add, column
from scene_graph_ros.geometry.tables.height_grid import (
    FLOOR,
    HeightGrid,
    SIZE_X,
    SIZE_Y,
)
from scene_graph_ros.geometry.tables.held_table import borrowed_table
from scene_graph_ros.geometry.tables.prism_slots import prism_origin, write_prism

__all__ = ["nearest_prism"]

_STACK = 512
"""Nodes that wait: 63 for each level but the cells', and one; there are at most eight levels."""
_NUMBERS = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)

_nodes = stack_array((_STACK, 3), np.int64)
_gaps = stack_array((_STACK,))
_planes = stack_array((FIXED + PLANES, 4))
_lows = stack_array((NUM_DIRECTIONS,))
_low = stack_array((LANES,))
_kept = stack_array((2,), np.int64)


@inlined_kernel
def _fitted(cover, lows):
    """Return a cover with the shape's own extents along the axes of F.

    Those of its box may be larger by three quarters, and so would be the cells below it.
    """
    R, sizes, p, _, c_B, half, _, length, is_half_space = cover
    x, y, z = (lows[2], -lows[3]), (lows[4], -lows[5]), (lows[0], -lows[1])
    center = 0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]), 0.5 * (z[0] + z[1])
    turned = 0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0]), 0.5 * (z[1] - z[0])
    return R, sizes, p, center, c_B, half, turned, length, is_half_space


@inlined_kernel
def _above_ground(grid, p):
    """Return how high a point is above the surface below it, m; inf where there is none.

    No prism is farther from a shape with that point; it is 0 for a point that is in the ground.
    """
    rows, cols = grid.counts[0, 0], grid.counts[0, 1]
    x = (p[0] / grid.numbers[SIZE_X] + 0.5) * cols
    y = (p[1] / grid.numbers[SIZE_Y] + 0.5) * rows
    if not (0.0 <= x <= cols and 0.0 <= y <= rows and p[2] >= grid.numbers[FLOOR]):
        return math.inf
    i, j = min(int(y), rows - 1), min(int(x), cols - 1)
    x, y, at = x - j, y - i, i * (cols + 1) + j
    a, c = grid.heights[at], grid.heights[at + cols + 2]
    if x > y:
        b = grid.heights[at + 1]
        return max(p[2] - (a + x * (b - a) + y * (c - b)), 0.0)
    b = grid.heights[at + cols + 1]
    return max(p[2] - (a + y * (b - a) + x * (c - b)), 0.0)


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
        bounds = larger(bounds, below_plane(grid, row, cover[2], plane))
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


class _Search(NamedTuple):
    """What a search reads, and where it keeps directions."""

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
def _search_window(search, found, near, tolerance):
    """Return the nearest prism so far after a look at a rectangle of cells, if it has any."""
    grid, planes, kept, (R_FB, p_FB) = search.grid, search.planes, search.kept, search.X_FB
    if near[0] > near[1] or near[2] > near[3]:
        return found
    window, first, last = bounds_of(near, grid, p_FB), 0, kept[0]
    table, slack = borrowed_table(search.places), SLACK * _lengths(grid, search.cover)
    for _ in range(2 * len(window.bounds)):
        least, place, prism = bound_prisms(window, grid, p_FB, planes, first, last)
        if not least < found.worth:
            break
        first = 0
        if not search.cover[8]:
            bound, plane = plane_before(table, search.j, search.X_FB, grid, prism)
            if bound > least + slack:
                first = kept[1]
                put(planes, kept, plane, FIXED)
                last = first + 1
                continue
        window.bounds[place] = math.inf
        found, nhat = _measure(search, found, prism, tolerance)
        if not search.cover[8]:
            is_plane, plane = plane_of(table, search.j, R_FB, nhat)
            if is_plane:
                first = kept[1]
                put(planes, kept, plane, FIXED)
        last = first + 1
    return found


@inlined_kernel
def _block_below(grid, p):
    """Return (i, j) of the block of cells that is below a point, or the nearest one."""
    rows, cols = grid.counts[0, 0], grid.counts[0, 1]
    y = (p[1] / grid.numbers[SIZE_Y] + 0.5) * rows
    x = (p[0] / grid.numbers[SIZE_X] + 0.5) * cols
    i, j = int(max(0.0, min(y, rows - 1.0))), int(max(0.0, min(x, cols - 1.0)))
    return i // LANES, j // LANES


@inlined_kernel
def _search_pyramid(search, found, lowest, tolerance):
    """Return the nearest prism so far after a look at all blocks that may be nearer."""
    grid, cover, planes, kept = search.grid, search.cover, search.planes, search.kept
    nodes, gaps, low = _nodes(), _gaps(), _low()
    # The block below the shape is looked at first: then the others are known to be near or not.
    seed = _block_below(grid, lowest)
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
            near = clipped(grid, 0, cover, found.worth)
            near = (
                max(near[0], LANES * i),
                min(near[1], LANES * i + LANES - 1),
                max(near[2], LANES * k),
                min(near[3], LANES * k + LANES - 1),
            )
            found = _search_window(search, found, near, tolerance)
        is_begun = True
    return found


@inlined_kernel
def nearest_prism(places, field, j, R_FB, p_FB, max_distance, tolerance):
    """Return (phi, p_Fa, p_Fb, nhat_BA_F, gap, element) of a field F and the shape of row j, B.

    ``element`` is the prism that is nearest, A, or NONE where all are farther than
    ``max_distance``: then phi is a lower bound above that, without witnesses and with an infinite
    gap. ``places`` have a slot for this thread's prisms.
    """
    grid, table = grid_of(places, field), borrowed_table(places)
    cover = cover_of(table, j, R_FB, p_FB)
    planes, kept, lows = _planes(), _kept(), _lows()
    lowest, limit = p_FB, max_distance
    if cover[8]:
        normal = column(R_FB, 2)  # all prisms are measured along it
        planes[0, 0], planes[0, 1], planes[0, 2] = -normal[0], -normal[1], -normal[2]
        planes[0, 3], kept[0], kept[1] = 0.0, 1, 1
    else:
        lowest = add(p_FB, write_extents(table, j, R_FB, lows))
        cover = _fitted(cover, lows)
        write_planes(lows, planes)
        kept[0], kept[1] = FIXED, FIXED
        above = _above_ground(grid, lowest) + tolerance
        limit = min(limit, above + SLACK * (_lengths(grid, cover) + above))
    search = _Search(places, prism_row_of(places), j, grid, cover, (R_FB, p_FB), planes, kept)
    found = nothing_yet(limit)
    for _ in range(2):
        near = clipped(grid, 0, cover, found.worth)
        if fits(near):
            found = _search_window(search, found, near, tolerance)
        else:
            found = _search_pyramid(search, found, lowest, tolerance)
        if found.element != NONE or limit >= max_distance:
            break
        # Rounding hid the prism below, or it has no answer.
        limit, found = max_distance, nothing_yet(max_distance)
    gap = found.gap + (found.phi - found.worth) if found.element != NONE else math.inf
    return found.phi, found.p_Fa, found.p_Fb, found.nhat, gap, found.element

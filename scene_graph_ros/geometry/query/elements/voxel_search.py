"""The voxel of a grid that is nearest to a shape, or deepest in it.

Branch and bound in the tree of the grid's bits. Bounds are those of the box around a node against
the shape's own box, and along the directions of voxels that were measured (``element_search``), by
which most of a wall, or of the unknown space around a shape, is passed over.
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
    store_lanes,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.query.elements.covers import cover_of, from_centers
from scene_graph_ros.geometry.query.elements.element_places import cell_row_of, voxels_of
from scene_graph_ros.geometry.query.elements.element_search import (
    CELLS,
    least_cell,
    measured,
    nothing_yet,
    plane_of,
    PLANES,
    put,
)
from scene_graph_ros.geometry.query.elements.nearest import NONE
from scene_graph_ros.geometry.tables.held_table import borrowed_table
from scene_graph_ros.geometry.tables.voxel_bits import SIDE, VoxelBits

__all__ = ["nearest_voxel", "voxel_center"]

_STACK = 1024
"""Nodes that wait: 63 for each level but the voxels', and one; there are at most 14 levels."""
_ALONG_Y = (0.5, 0.5, 0.5, 0.5, 1.5, 1.5, 1.5, 1.5)
_ALONG_Z = (0.5, 1.5, 2.5, 3.5, 0.5, 1.5, 2.5, 3.5)
"""Middles of a row of eight children: two along y, four along z."""
_BIT = np.uint64(1)

_nodes = stack_array((_STACK, 4), np.int64)
_gaps = stack_array((_STACK,))
_cells = stack_array((CELLS,))
_planes = stack_array((PLANES, 4))
_kept = stack_array((2,), np.int64)


class _Search(NamedTuple):
    """What a search reads, and where it writes the directions and the bounds of a node."""

    places: np.ndarray
    row: int
    """Of a voxel at its own middle."""
    j: int
    bits: VoxelBits
    cover: Any
    X_FB: Any
    planes: np.ndarray
    kept: np.ndarray
    """How many directions there are, and which is replaced next."""
    cells: np.ndarray
    """Bounds of the 64 children of a node."""


@inlined_kernel
def voxel_center(bits, element):
    """Return (p_FV, half an edge): the middle of a voxel in the grid's frame."""
    edge, ny, nz = bits.numbers[0], bits.counts[0, 1], bits.counts[0, 2]
    i, j, k = element // (ny * nz), element // nz % ny, element % nz
    return ((i + 0.5) * edge, (j + 0.5) * edge, (k + 0.5) * edge), 0.5 * edge


@inlined_kernel
def _middles(node, row, width, p):
    """Return (x, y, z) from p on of the middles of eight children of a node, the row-th eight."""
    x = (SIDE * node[1] + row // 2 + 0.5) * width - p[0]
    y = (as_lanes(_ALONG_Y) + np.float64(SIDE * node[2] + 2 * (row % 2))) * width - p[1]
    z = (as_lanes(_ALONG_Z) + np.float64(SIDE * node[3])) * width - p[2]
    return x, y, z


@inlined_kernel
def _beyond_plane(middles, half, plane):
    """Return lower bounds of the same along a direction: plane (x, y, z, h)."""
    x, y, z = middles
    mx, my, mz, h = plane
    return h - (mx * x + my * y + mz * z) - half * (abs(mx) + abs(my) + abs(mz))


@inlined_kernel
def _bound_children(search, node, width):
    """Write the lower bounds of a node's children, infinite ones where nothing is solid."""
    bits, cover, planes, cells = search.bits, search.cover, search.planes, search.cells
    level, half = node[0], 0.5 * width
    at = (node[1] * bits.counts[level, 1] + node[2]) * bits.counts[level, 2] + node[3]
    word = bits.words[bits.starts[level - 1] + at]
    for row in range(LANES):
        eight = np.int64((word >> np.uint64(LANES * row)) & np.uint64(255))
        if eight == 0:
            store_lanes(cells, LANES * row, as_lanes(_ALONG_Z) + math.inf)
            continue
        middles = _middles(node, row, width, cover[2])
        bounds = from_centers(cover, middles[0], middles[1], middles[2], half, half, half)
        for k in range(search.kept[0]):
            plane = (planes[k, 0], planes[k, 1], planes[k, 2], planes[k, 3])
            bounds = larger(bounds, _beyond_plane(middles, half, plane))
        store_lanes(cells, LANES * row, bounds)
        for lane in range(LANES):
            if (eight >> lane) & 1 == 0:
                cells[LANES * row + lane] = math.inf


@inlined_kernel
def _open_node(search, node, width, worth, nodes, gaps, waiting):
    """Put the children of a node on the stack that may be nearer than ``worth``, nearest last."""
    _bound_children(search, node, width)
    begin, cells = waiting, search.cells
    for child in range(CELLS):
        if not cells[child] < worth:
            continue
        k = waiting
        while k > begin and gaps[k - 1] < cells[child]:
            gaps[k] = gaps[k - 1]
            for m in range(4):
                nodes[k, m] = nodes[k - 1, m]
            k -= 1
        gaps[k], nodes[k, 0] = cells[child], node[0] - 1
        nodes[k, 1] = SIDE * node[1] + child // 16
        nodes[k, 2] = SIDE * node[2] + child // SIDE % SIDE
        nodes[k, 3] = SIDE * node[3] + child % SIDE
        waiting += 1
    return waiting


@inlined_kernel
def _keep_plane(search, nhat, node, width):
    """Keep a direction, and raise the bounds of a node's children to what it tells."""
    R_FB, p_FB = search.X_FB
    is_plane, plane = plane_of(borrowed_table(search.places), search.j, R_FB, nhat)
    if not is_plane:
        return
    put(search.planes, search.kept, plane, 0)
    for row in range(LANES):
        bounds = _beyond_plane(_middles(node, row, width, p_FB), 0.5 * width, plane)
        known = load_lanes(search.cells, LANES * row)
        store_lanes(search.cells, LANES * row, larger(known, bounds))


@inlined_kernel
def _search_voxels(search, found, node, tolerance):
    """Return the nearest voxel so far after a look at a block of 4 x 4 x 4."""
    bits, cover, cells = search.bits, search.cover, search.cells
    edge, ny, nz = bits.numbers[0], bits.counts[0, 1], bits.counts[0, 2]
    c, half = cover[3], cover[6]
    body = abs(c[0]) + abs(c[1]) + abs(c[2]) + half[0] + half[1] + half[2]
    _bound_children(search, node, edge)
    for _ in range(CELLS):
        at = least_cell(cells)
        if not cells[at] < found.worth:
            break
        cells[at] = math.inf
        i, j = SIDE * node[1] + at // 16, SIDE * node[2] + at // SIDE % SIDE
        element = (i * ny + j) * nz + SIDE * node[3] + at % SIDE
        p_FV, _ = voxel_center(bits, element)
        found, nhat = measured(
            search.places, search.row, search.j, search.X_FB, p_FV, found, element,
            body + 3.0 * edge, tolerance,
        )  # fmt: skip
        if not cover[8]:
            _keep_plane(search, nhat, node, edge)
    return found


@inlined_kernel
def nearest_voxel(places, field, j, R_FB, p_FB, max_distance, tolerance):
    """Return (phi, p_Fa, p_Fb, nhat_BA_F, gap, element) of a grid F and the shape of row j, B.

    ``element`` is the voxel that is nearest, A, or NONE where all are farther than
    ``max_distance``: then phi is a lower bound above that, without witnesses and with an infinite
    gap.
    """
    bits = voxels_of(places, field)
    cover = cover_of(borrowed_table(places), j, R_FB, p_FB)
    nodes, gaps, planes, kept, cells = _nodes(), _gaps(), _planes(), _kept(), _cells()
    row = cell_row_of(places, field)
    search = _Search(places, row, j, bits, cover, (R_FB, p_FB), planes, kept, cells)
    found = nothing_yet(max_distance)
    kept[0], kept[1], top = 0, 0, len(bits.counts) - 1
    nodes[0, 0], nodes[0, 1], nodes[0, 2], nodes[0, 3], gaps[0] = top, 0, 0, 0, -math.inf
    waiting = 1
    while waiting > 0:
        waiting -= 1
        if gaps[waiting] >= found.worth:
            continue
        node = nodes[waiting, 0], nodes[waiting, 1], nodes[waiting, 2], nodes[waiting, 3]
        if node[0] == 1:
            found = _search_voxels(search, found, node, tolerance)
            continue
        width = bits.numbers[0]
        for _ in range(node[0] - 1):
            width *= SIDE
        waiting = _open_node(search, node, width, found.worth, nodes, gaps, waiting)
    gap = found.gap + (found.phi - found.worth) if found.element != NONE else math.inf
    return found.phi, found.p_Fa, found.p_Fb, found.nhat, gap, found.element

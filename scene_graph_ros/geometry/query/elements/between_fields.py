"""The voxel of a grid that is nearest to another grid or a height field, or deepest in it.

Branch and bound in the tree of the grid's bits, as ``field_to_cloud`` has it for balls: no voxel
of a node is nearer to the field than the node's middle, but for half the node's diagonal. None is
deeper than one in the middle of an element.
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.query.elements.element_places import (
    cell_row_of,
    field_measure_of,
    grid_of,
    is_of_voxels,
    point_row_of,
    voxels_of,
)
from scene_graph_ros.geometry.query.elements.field_entry import FIELD_DISTANCE
from scene_graph_ros.geometry.query.elements.nearest import just_above, NONE
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    load_rotation,
    load_translation,
    relative_pose,
    rotate,
    scale,
    transpose,
)
from scene_graph_ros.geometry.tables.height_grid import SIZE_X, SIZE_Y
from scene_graph_ros.geometry.tables.voxel_bits import SIDE

__all__ = ["descends_first", "find_voxel_at_field", "nearest_voxel_to_field"]

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_CHILDREN = SIDE * SIDE * SIDE
_HALF_DIAGONAL = 0.5 * math.sqrt(3.0) * (1.0 + 1e-14)
"""Of a cube of edge 1, rounded up."""
_STACK = 1024
"""Nodes that wait: 63 for each level, and one; there are at most 14 levels."""
_BIT = np.uint64(1)

_nodes = stack_array((_STACK, 4), np.int64)
_gaps = stack_array((_STACK,))
_field_distance = FIELD_DISTANCE.call


@inlined_kernel
def descends_first(places, first, second):
    """Return True if of two grids of voxels the first is the one to go down: it has less nodes."""
    return len(voxels_of(places, first).words) < len(voxels_of(places, second).words)


@inlined_kernel
def _deepest(places, field, edge, R_FA):
    """Return a lower bound of the signed distances of all voxels of an edge to all elements.

    Along x, and along y, elements of F are as wide as a cell, and voxels as they are turned.
    """
    if is_of_voxels(places, field):
        other = voxels_of(places, field).numbers[0]
        R = transpose(R_FA)
        along_own = other * min(
            abs(R[0]) + abs(R[1]) + abs(R[2]),
            min(abs(R[3]) + abs(R[4]) + abs(R[5]), abs(R[6]) + abs(R[7]) + abs(R[8])),
        )
        x, y, z, own = other, other, other, edge + along_own
    else:
        grid = grid_of(places, field)
        x = grid.numbers[SIZE_X] / grid.counts[0, 1]
        y = grid.numbers[SIZE_Y] / grid.counts[0, 0]
        z, own = math.inf, math.inf
    R = R_FA
    x += edge * (abs(R[0]) + abs(R[1]) + abs(R[2]))
    y += edge * (abs(R[3]) + abs(R[4]) + abs(R[5]))
    z += edge * (abs(R[6]) + abs(R[7]) + abs(R[8]))
    return -0.5 * (1.0 + 1e-14) * min(min(x, y), min(z, own))


@inlined_kernel
def _open(places, field, bits, node, X_FA, best, floor, nodes, gaps, begin):
    """Put a node's children that may be nearer than ``best`` on the stack, the nearest last."""
    level, waiting = node[0], begin
    at = (node[1] * bits.counts[level, 1] + node[2]) * bits.counts[level, 2] + node[3]
    word, width = bits.words[bits.starts[level - 1] + at], bits.numbers[0]
    for _ in range(level - 1):
        width *= SIDE
    reach = _HALF_DIAGONAL * width
    for child in range(_CHILDREN):
        if (word >> np.uint64(child)) & _BIT == 0:
            continue
        i = SIDE * node[1] + child // 16
        j, k = SIDE * node[2] + child // SIDE % SIDE, SIDE * node[3] + child % SIDE
        middle = ((i + 0.5) * width, (j + 0.5) * width, (k + 0.5) * width)
        p = add(rotate(X_FA[0], middle), X_FA[1])
        arguments = places, field, point_row_of(places), (_IDENTITY, p), best + reach, 0.0
        phi, _, _, _, _, element = _field_distance(field_measure_of(places), arguments)
        bound = max(phi - reach, floor)
        if element == NONE or not bound < best:
            continue
        at = waiting
        while at > begin and gaps[at - 1] < bound:
            gaps[at] = gaps[at - 1]
            for m in range(4):
                nodes[at, m] = nodes[at - 1, m]
            at -= 1
        gaps[at], nodes[at, 0], nodes[at, 1] = bound, level - 1, i
        nodes[at, 2], nodes[at, 3] = j, k
        waiting += 1
    return waiting


@inlined_kernel
def nearest_voxel_to_field(places, field, grid, R_FA, p_FA, max_distance, tolerance):
    """Return (phi, p_Fa, p_Fb, nhat_BA_F, gap, element, voxel) of a field F and a grid.

    ``grid`` are the voxels that are gone down, B, at a pose in F; ``element`` of F, A, and
    ``voxel`` are NONE where all are farther apart than ``max_distance``: then phi is a lower
    bound above that. ``places`` have a slot for this thread's prisms.
    """
    bits, zero = voxels_of(places, grid), (0.0, 0.0, 0.0)
    edge, ny, nz = bits.numbers[0], bits.counts[0, 1], bits.counts[0, 2]
    floor, row = _deepest(places, field, edge, R_FA), cell_row_of(places, grid)
    best, element, voxel, own = just_above(max_distance), NONE, NONE, math.inf
    p_Fa, p_Fb, nhat = zero, zero, (0.0, 0.0, 1.0)
    nodes, gaps = _nodes(), _gaps()
    nodes[0, 0], nodes[0, 1], nodes[0, 2], nodes[0, 3] = len(bits.counts) - 1, 0, 0, 0
    gaps[0], waiting = -math.inf, 1
    while waiting > 0:
        waiting -= 1
        if gaps[waiting] >= best:
            continue
        node = nodes[waiting, 0], nodes[waiting, 1], nodes[waiting, 2], nodes[waiting, 3]
        if node[0] > 0:
            waiting = _open(
                places, field, bits, node, (R_FA, p_FA), best, floor, nodes, gaps, waiting
            )
            continue
        middle = ((node[1] + 0.5) * edge, (node[2] + 0.5) * edge, (node[3] + 0.5) * edge)
        X_FB = R_FA, add(rotate(R_FA, middle), p_FA)
        arguments = places, field, row, X_FB, best, tolerance
        phi, a, b, n, gap, nearest = _field_distance(field_measure_of(places), arguments)
        if nearest != NONE and phi < best:
            best, element, own = phi, nearest, gap
            voxel = (node[1] * ny + node[2]) * nz + node[3]
            p_Fa, p_Fb, nhat = a, b, n
    return best, p_Fa, p_Fb, nhat, own, element, voxel


@lean_kernel
def find_voxel_at_field(places, first, second, X_WF, X_WB, max_distance, found):
    """Write (phi, element, element) of two fields, of which the second is a grid of voxels.

    Poses are ``(1, 4, 4)``.
    """
    R, p = relative_pose(
        load_rotation(X_WF, 0),
        load_translation(X_WF, 0),
        load_rotation(X_WB, 0),
        load_translation(X_WB, 0),
    )
    if is_of_voxels(places, first) and descends_first(places, first, second):
        R_BF = transpose(R)
        p_BF = scale(-1.0, rotate(R_BF, p))
        phi, _, _, _, _, element, voxel = nearest_voxel_to_field(
            places, second, first, R_BF, p_BF, max_distance, 0.0
        )
        found[0], found[1], found[2] = phi, voxel, element
        return
    phi, _, _, _, _, element, voxel = nearest_voxel_to_field(
        places, first, second, R, p, max_distance, 0.0
    )
    found[0], found[1], found[2] = phi, element, voxel

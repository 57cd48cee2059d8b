"""Points far from small hulls, so many at once that the processor computes some in step.

Each lane finds the corner most likely to be nearest as ``point_convex`` does, by the same
arithmetic in the same order, and whether no corner lies further towards the point. Most points
are answered by then; for the others ``point_convex`` goes on from that corner.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.vector_width import use_widest_vectors
from scene_graph_ros.geometry.query.point.corner_scan import (
    scan_corners_of_hull,
    scan_corners_of_tile,
)
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.query.point.lanes import question, set_answer, triple
from scene_graph_ros.geometry.query.point.point_convex import leave_corner, leave_hull
from scene_graph_ros.geometry.spatial.vectors import dot
from scene_graph_ros.geometry.tables.hull_blocks import vertex_place

__all__ = ["LANE_CORNERS", "answer_hull", "answer_hulls"]

LANE_CORNERS = 16
"""Hulls with more corners are not answered in lanes."""

_NEAREST, _N, _HEIGHT, _BEST, _REACH = (LANES * k for k in (7, 14, 17, 18, 19))


@inlined_kernel
def is_answered(lanes, j):
    """Tell whether lane j has its answer, which is unique far away."""
    return lanes[LANES * 13 + j] != 0.0


@lean_kernel
def _leave(lanes):
    """Answer lanes whose corner is nearest; the others are not unique, for now."""
    use_widest_vectors()
    for j in range(LANES):
        size, p_GQ = question(lanes, j)
        x, n = triple(lanes, _NEAREST, j), triple(lanes, _N, j)
        phi, grad_G, is_far = leave_hull(p_GQ, x, size[0])
        is_nearest = (lanes[_HEIGHT + j] <= lanes[_REACH + j]) & (dot(n, n) > size[0] * size[0])
        set_answer(lanes, j, (phi, x, grad_G, is_nearest & is_far))


@inlined_kernel
def _go_on(lanes, j, blocks, start):
    """Answer lane j, which is not answered, from the corner found."""
    size, p_GQ = question(lanes, j)
    corner = vertex_place(start, int(lanes[_BEST + j]))
    set_answer(lanes, j, leave_corner(blocks, start, size[0], p_GQ, corner))


@lean_kernel
def answer_hulls(lanes, corners, tile, count, blocks, block, rows, row):
    """Answer lanes about the hulls of a tile, of up to ``count`` corners.

    ``corners[tile, k, :, j]`` is corner k of the hull of lane j, in m; hulls with fewer have their
    first again. The block of that hull starts at ``block[rows[row, j]]``. The sizes of the lanes
    are the hulls' extents.
    """
    scan_corners_of_tile(lanes, corners, tile, count)
    _leave(lanes)
    for j in range(LANES):
        if not is_answered(lanes, j):
            _go_on(lanes, j, blocks, block[rows[row, j]])


@lean_kernel
def answer_hull(lanes, blocks, start):
    """Answer lanes that are all about the hull whose block starts at ``start``.

    It has at most SCAN_LIMIT corners. The sizes of the lanes are the hull's extent.
    """
    scan_corners_of_hull(lanes, blocks, vertex_place(start, 0), int(blocks[start]))
    _leave(lanes)
    for j in range(LANES):
        if not is_answered(lanes, j):
            _go_on(lanes, j, blocks, start)

"""Points far from small hulls, so many at once that the processor computes some in step.

Each lane finds the corner most likely to be nearest as ``point_convex`` does, by the same
arithmetic in the same order, and whether no corner lies further towards the point. Most points
are answered by then. Of the others most are nearest to an edge that begins there; for the
rest ``point_convex`` goes on from that corner.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    bits_of,
    FOUR,
    lowest_bit,
    root,
    store_lanes,
    WIDE,
)
from scene_graph_ros.geometry.compiled.lanes import (
    LANES as EIGHT,
)
from scene_graph_ros.geometry.compiled.vector_width import use_widest_vectors
from scene_graph_ros.geometry.query.point.corner_scan import (
    scan_corners_of_hull,
    scan_corners_of_tile,
)
from scene_graph_ros.geometry.query.point.edge_lanes import answer_on_edges
from scene_graph_ros.geometry.query.point.lane_memory import lane_numbers, LANES
from scene_graph_ros.geometry.query.point.lanes import (
    eight_questions,
    is_answered,
    is_done,
    keep_answer,
    keep_wide_answers,
    p_GQ_of_lane,
    question,
    set_answer,
    set_eight_answers,
    wide_p_GQ,
)
from scene_graph_ros.geometry.query.point.point_convex import FAR, leave_corner
from scene_graph_ros.geometry.spatial.vectors import dot, scale
from scene_graph_ros.geometry.tables.hull_blocks import vertex_place

__all__ = ["LANE_CORNERS", "answer_hull", "answer_hulls"]

LANE_CORNERS = 16
"""Hulls with more corners are not answered in lanes."""

_BEST = 14 * LANES
"""The number of each lane's likely corner, after what ``lanes`` has of it."""


@inlined_kernel
def _leave(corner, way, is_furthest, size):
    """Return (phi, p_GN, grad_G, is_answered) of wide lanes, as ``leave_hull`` does far away.

    The way is that from the corner, and ``is_furthest`` tells that no other lies further along it.
    """
    square = dot(way, way)
    phi = root(square)
    is_answered = is_furthest & (square > size * size) & (phi > FAR * size)
    return phi, corner, scale(1.0 / phi, way), is_answered


@lean_kernel
def answer_hulls(lanes, corners, tile, count, blocks, block, rows, row):
    """Answer lanes about the hulls of a tile, of up to ``count`` corners.

    ``corners[tile, k, :, j]`` is corner k of the hull of lane j, in m; hulls with fewer have their
    first again. The block of that hull starts at ``block[rows[row, j]]``. The sizes of the lanes
    are the hulls' extents.
    """
    use_widest_vectors()
    for lane in range(0, LANES, EIGHT):
        size, p_GQ = eight_questions(lanes, lane)
        corner, number, way, is_furthest = scan_corners_of_tile(p_GQ, corners, tile, count, lane)
        set_eight_answers(lanes, lane, _leave(corner, way, is_furthest, size[0]))
        store_lanes(lanes, _BEST + lane, number)
    for j in range(LANES):
        if not is_answered(lanes, j):
            start = block[rows[row, j]]
            size, p_GQ = question(lanes, j)
            likely = vertex_place(start, int(lanes[_BEST + j]))
            set_answer(lanes, j, leave_corner(blocks, start, size[0], p_GQ, likely))


@inlined_kernel
def _take_lowest(lanes, otherwise):
    """Return the lowest lane whose bit is 1, and the bits of the others."""
    return (lowest_bit(lanes) if lanes != 0 else otherwise), lanes & (lanes - 1)


@inlined_kernel
def _answer_open(asked, blocks, start, size, numbers, lanes):
    """Answer the lanes whose bits are 1; ``numbers`` are those of their likely corners."""
    first, corners = vertex_place(start, 0), int(blocks[start])
    while lanes != 0:
        a, lanes = _take_lowest(lanes, 0)
        b, lanes = _take_lowest(lanes, a)
        c, lanes = _take_lowest(lanes, a)
        d, lanes = _take_lowest(lanes, a)
        four = (a, b, c, d)
        if not answer_on_edges(asked, four, numbers, blocks, first, corners, size):
            for k in range(FOUR):
                if not is_done(asked, four[k]):
                    p_GQ, likely = p_GQ_of_lane(asked, four[k]), int(numbers[four[k]])
                    answer = leave_corner(blocks, start, size, p_GQ, vertex_place(start, likely))
                    keep_answer(asked, four[k], answer)


@lean_kernel
def answer_hull(asked, blocks, start, size):
    """Answer all lanes about the hull whose block starts at ``start``, of extent ``size``.

    It has at most SCAN_LIMIT corners.
    """
    use_widest_vectors()
    first, corners = vertex_place(start, 0), int(blocks[start])
    numbers, lanes = lane_numbers(), 0
    for lane in range(0, LANES, WIDE):
        p_GQ = wide_p_GQ(asked, lane)
        corner, number, way, is_furthest = scan_corners_of_hull(p_GQ, blocks, first, corners, lane)
        answer = _leave(corner, way, is_furthest, size)
        keep_wide_answers(asked, lane, answer)
        store_lanes(numbers, lane, number)
        lanes |= bits_of(~answer[3]) << lane
    _answer_open(asked, blocks, start, size, numbers, lanes)

"""Points far from small hulls, so many at once that the processor computes some in step.

Each lane finds the corner most likely to be nearest as ``point_convex`` does, by the same
arithmetic in the same order, and whether no corner lies further towards the point. Most points
are answered by then. Of the others most are nearest to an edge that begins there; for what is
left ``point_convex`` goes on from that corner.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import FOUR, root, store_lanes, WIDE
from scene_graph_ros.geometry.compiled.vector_width import use_widest_vectors
from scene_graph_ros.geometry.query.point.corner_scan import (
    scan_corners_of_hull,
    scan_corners_of_tile,
)
from scene_graph_ros.geometry.query.point.edge_lanes import (
    ask_about_edge,
    edge_answer,
    find_edges,
)
from scene_graph_ros.geometry.query.point.lane_memory import (
    edge_numbers,
    lane_numbers,
    lane_places,
    LANES,
)
from scene_graph_ros.geometry.query.point.lanes import (
    is_answered,
    is_done,
    keep_answer,
    keep_wide_answers,
    kept_nearest,
    p_GQ_of_lane,
    question,
    set_answer,
    set_wide_answers,
    wide_p_GQ,
    wide_question,
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
    for lane in range(0, LANES, WIDE):
        size, p_GQ = wide_question(lanes, lane)
        corner, number, way, is_furthest = scan_corners_of_tile(p_GQ, corners, tile, count, lane)
        set_wide_answers(lanes, lane, _leave(corner, way, is_furthest, size[0]))
        store_lanes(lanes, _BEST + lane, number)
    for j in range(LANES):
        if not is_answered(lanes, j):
            start = block[rows[row, j]]
            size, p_GQ = question(lanes, j)
            likely = vertex_place(start, int(lanes[_BEST + j]))
            set_answer(lanes, j, leave_corner(blocks, start, size[0], p_GQ, likely))


@inlined_kernel
def _answer_open(asked, blocks, start, size, numbers):
    """Answer the lanes that are not answered; ``numbers`` are those of their likely corners."""
    open_lanes, kept, count = lane_places(), edge_numbers(), 0
    for j in range(LANES):  # without a branch, since nobody can tell which lanes they are
        open_lanes[count] = j
        count += 0 if is_done(asked, j) else 1
    for group in range(0, count, FOUR):
        for slot in range(FOUR):
            j = open_lanes[min(group + slot, count - 1)]
            ask_about_edge(kept, slot, p_GQ_of_lane(asked, j), kept_nearest(asked, j), numbers[j])
        find_edges(kept, blocks, vertex_place(start, 0), int(blocks[start]), size)
        for slot in range(min(FOUR, count - group)):
            j = open_lanes[group + slot]
            is_found, answer = edge_answer(kept, slot)
            if not is_found:
                likely = vertex_place(start, int(numbers[j]))
                answer = leave_corner(blocks, start, size, p_GQ_of_lane(asked, j), likely)
            keep_answer(asked, j, answer)


@lean_kernel
def answer_hull(asked, blocks, start, size):
    """Answer all lanes about the hull whose block starts at ``start``, of extent ``size``.

    It has at most SCAN_LIMIT corners.
    """
    use_widest_vectors()
    first, corners = vertex_place(start, 0), int(blocks[start])
    numbers = lane_numbers()
    for lane in range(0, LANES, WIDE):
        p_GQ = wide_p_GQ(asked, lane)
        corner, number, way, is_furthest = scan_corners_of_hull(p_GQ, blocks, first, corners, lane)
        keep_wide_answers(asked, lane, _leave(corner, way, is_furthest, size))
        store_lanes(numbers, lane, number)
    _answer_open(asked, blocks, start, size, numbers)

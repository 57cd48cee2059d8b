"""Points far from small hulls, so many at once that the processor computes some in step.

Each lane finds the corner most likely to be nearest as ``point_convex`` does, by the same
arithmetic in the same order, and whether no corner lies further towards the point. Most points
are answered by then; for the others ``point_convex`` goes on from that corner.
"""

from scene_graph_ros.geometry.jit import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.meshes.hull_blocks import vertex, vertex_place
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.query.point.lanes import (
    question,
    set_answer,
    set_triple,
    triple,
)
from scene_graph_ros.geometry.query.point.point_convex import leave_corner, leave_hull
from scene_graph_ros.geometry.query.point.wide_vectors import use_widest_vectors
from scene_graph_ros.geometry.spatial.places import LAST_PLACE
from scene_graph_ros.geometry.spatial.vectors import dot, subtract

__all__ = ["LANE_CORNERS", "answer_hull", "answer_hulls"]

LANE_CORNERS = 16
"""Hulls with more corners are not answered in lanes."""

_NEAREST, _N, _HEIGHT, _BEST, _REACH = (LANES * k for k in (7, 14, 17, 18, 19))


@inlined_kernel
def is_answered(lanes, j):
    """Tell whether lane j has its answer, which is unique far away."""
    return lanes[LANES * 13 + j] != 0.0


@inlined_kernel
def _corner_of_tile(corners, tile, j, k):
    return (corners[tile, k, 0, j], corners[tile, k, 1, j], corners[tile, k, 2, j])


@inlined_kernel
def _corner(blocks, start, k):
    return vertex(blocks, vertex_place(start, k) & LAST_PLACE)


@inlined_kernel
def _begin(lanes, j, corner):
    """Look from the first corner."""
    _, p_GQ = question(lanes, j)
    n = subtract(p_GQ, corner)
    set_triple(lanes, _N, j, n)
    lanes[_HEIGHT + j] = dot(corner, n)
    lanes[_BEST + j] = 0.0


@inlined_kernel
def _look_at(lanes, j, corner, number):
    """Take a corner if it lies further along the direction of lane j than all before it."""
    height = lanes[_HEIGHT + j]
    along = dot(corner, triple(lanes, _N, j))
    is_higher = along > height
    lanes[_HEIGHT + j] = along if is_higher else height
    lanes[_BEST + j] = number if is_higher else lanes[_BEST + j]


@inlined_kernel
def _go_to(lanes, j, corner):
    """Look from the corner found, the only one so far."""
    _, p_GQ = question(lanes, j)
    n = subtract(p_GQ, corner)
    set_triple(lanes, _NEAREST, j, corner)
    set_triple(lanes, _N, j, n)
    height = dot(corner, n)
    lanes[_HEIGHT + j] = height
    lanes[_REACH + j] = height


@inlined_kernel
def _look_beyond(lanes, j, corner):
    height = lanes[_HEIGHT + j]
    along = dot(corner, triple(lanes, _N, j))
    lanes[_HEIGHT + j] = along if along > height else height


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
def _search_tile(lanes, corners, tile, count):
    use_widest_vectors()
    for j in range(LANES):
        _begin(lanes, j, _corner_of_tile(corners, tile, j, 0))
    for k in range(1, count):
        number = float(k)
        for j in range(LANES):
            _look_at(lanes, j, _corner_of_tile(corners, tile, j, k), number)
    for j in range(LANES):
        _go_to(lanes, j, _corner_of_tile(corners, tile, j, int(lanes[_BEST + j])))
    for k in range(count):
        for j in range(LANES):
            _look_beyond(lanes, j, _corner_of_tile(corners, tile, j, k))


@lean_kernel
def answer_hulls(lanes, corners, tile, count, blocks, block, rows, row):
    """Answer lanes about the hulls of a tile, of up to ``count`` corners.

    ``corners[tile, k, :, j]`` is corner k of the hull of lane j, in m; hulls with fewer have their
    first again. The block of that hull starts at ``block[rows[row, j]]``. The sizes of the lanes
    are the hulls' extents.
    """
    _search_tile(lanes, corners, tile, count)
    _leave(lanes)
    for j in range(LANES):
        if not is_answered(lanes, j):
            _go_on(lanes, j, blocks, block[rows[row, j]])


@lean_kernel
def _search(lanes, blocks, start, count):
    use_widest_vectors()
    corner = _corner(blocks, start, 0)
    for j in range(LANES):
        _begin(lanes, j, corner)
    for k in range(1, count):
        number, corner = float(k), _corner(blocks, start, k)
        for j in range(LANES):
            _look_at(lanes, j, corner, number)
    for j in range(LANES):
        _go_to(lanes, j, _corner(blocks, start, int(lanes[_BEST + j])))
    for k in range(count):
        corner = _corner(blocks, start, k)
        for j in range(LANES):
            _look_beyond(lanes, j, corner)


@lean_kernel
def answer_hull(lanes, blocks, start):
    """Answer lanes that are all about the hull whose block starts at ``start``.

    It has at most SCAN_LIMIT corners. The sizes of the lanes are the hull's extent.
    """
    _search(lanes, blocks, start, int(blocks[start]))
    _leave(lanes)
    for j in range(LANES):
        if not is_answered(lanes, j):
            _go_on(lanes, j, blocks, start)

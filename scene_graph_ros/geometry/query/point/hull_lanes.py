"""Points far from small hulls, so many at once that the processor computes some in step.

Each lane takes the first steps of the descent to the nearest corner in ``point_convex``, the same
arithmetic in the same order. Most points are answered by then; the others take it from the start.
"""

from scene_graph_ros.geometry.jit import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.meshes.scratch import LANES
from scene_graph_ros.geometry.query.point.flat_features import nearest_on_segment
from scene_graph_ros.geometry.query.point.lanes import (
    question,
    set_answer,
    set_triple,
    triple,
)
from scene_graph_ros.geometry.query.point.point_convex import leave_hull
from scene_graph_ros.geometry.spatial.vectors import dot, subtract

__all__ = ["LANE_CORNERS", "answer_hull_lanes", "is_answered"]

LANE_CORNERS = 16
"""Hulls with more corners are not answered in lanes."""

_NEAREST, _N, _HEIGHT, _BEST, _FIRST, _SECOND, _LEAST = (
    LANES * k for k in (7, 14, 17, 18, 19, 20, 21)
)
_IS_GOOD = LANES * 13
"""In place of uniqueness: an answer far away is unique."""


@inlined_kernel
def is_answered(lanes, j):
    """Tell whether lane j has its answer."""
    return lanes[_IS_GOOD + j] != 0.0


@inlined_kernel
def _corner(corners, tile, j, k):
    return (corners[tile, k, 0, j], corners[tile, k, 1, j], corners[tile, k, 2, j])


@lean_kernel
def _find_furthest(lanes, corners, tile, count):
    """Find in each lane the first of the corners that lie furthest along its direction."""
    for j in range(LANES):
        lanes[_HEIGHT + j] = dot(_corner(corners, tile, j, 0), triple(lanes, _N, j))
        lanes[_BEST + j] = 0.0
    for k in range(1, count):
        number = float(k)
        for j in range(LANES):
            height = lanes[_HEIGHT + j]
            along = dot(_corner(corners, tile, j, k), triple(lanes, _N, j))
            is_higher = along > height
            lanes[_HEIGHT + j] = along if is_higher else height
            lanes[_BEST + j] = number if is_higher else lanes[_BEST + j]


@lean_kernel
def _begin(lanes, corners, tile):
    for j in range(LANES):
        _, p_GQ = question(lanes, j)
        set_triple(lanes, _N, j, subtract(p_GQ, _corner(corners, tile, j, 0)))


@lean_kernel
def _go_to_corner(lanes, corners, tile):
    for j in range(LANES):
        size, p_GQ = question(lanes, j)
        p_GA = _corner(corners, tile, j, int(lanes[_BEST + j]))
        n = subtract(p_GQ, p_GA)
        least = dot(n, n)
        set_triple(lanes, _NEAREST, j, p_GA)
        set_triple(lanes, _N, j, n)
        lanes[_FIRST + j] = lanes[_BEST + j]
        lanes[_LEAST + j] = least
        lanes[_IS_GOOD + j] = 1.0 if least > size[0] * size[0] else 0.0


@lean_kernel
def _go_along_edge(lanes, corners, tile):
    """Go from the corner to the nearest point on the way to the one that is further, if any is."""
    for j in range(LANES):
        _, p_GQ = question(lanes, j)
        first, best = lanes[_FIRST + j], lanes[_BEST + j]
        is_there = best == first
        p_GA = triple(lanes, _NEAREST, j)
        x, t = nearest_on_segment(p_GQ, p_GA, _corner(corners, tile, j, int(best)))
        n = subtract(p_GQ, x)
        is_good = lanes[_IS_GOOD + j] != 0.0 and (is_there or dot(n, n) < lanes[_LEAST + j])
        n_A = triple(lanes, _N, j)
        x = (
            p_GA[0] if is_there else x[0],
            p_GA[1] if is_there else x[1],
            p_GA[2] if is_there else x[2],
        )
        n = (
            n_A[0] if is_there else n[0],
            n_A[1] if is_there else n[1],
            n_A[2] if is_there else n[2],
        )
        set_triple(lanes, _NEAREST, j, x)
        set_triple(lanes, _N, j, n)
        lanes[_FIRST + j] = best if t == 1.0 else first
        lanes[_SECOND + j] = best
        lanes[_IS_GOOD + j] = 1.0 if is_good else 0.0


@lean_kernel
def _finish(lanes):
    for j in range(LANES):
        size, p_GQ = question(lanes, j)
        best, x = lanes[_BEST + j], triple(lanes, _NEAREST, j)
        is_nearest = best == lanes[_FIRST + j] or best == lanes[_SECOND + j]
        phi, grad_G, is_far = leave_hull(p_GQ, x, size[0])
        is_good = lanes[_IS_GOOD + j] != 0.0 and is_nearest and is_far
        set_answer(lanes, j, (phi, x, grad_G, is_good))


@lean_kernel
def answer_hull_lanes(lanes, corners, tile, count):
    """Answer lanes about the hulls of a tile, of up to ``count`` corners, where few steps do.

    ``corners[tile, k, :, j]`` is corner k of the hull of lane j, in m; hulls with fewer have their
    first again. The sizes of the lanes are the hulls' extents.
    """
    _begin(lanes, corners, tile)
    _find_furthest(lanes, corners, tile, count)
    _go_to_corner(lanes, corners, tile)
    _find_furthest(lanes, corners, tile, count)
    _go_along_edge(lanes, corners, tile)
    _find_furthest(lanes, corners, tile, count)
    _finish(lanes)

"""Which corner of a hull is probably nearest to a point, and how far others lie beyond it.

All that is known of the lanes that are looked at together stays in registers while the corners
pass by.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    every,
    every_four,
    every_wide,
    larger,
    load_lanes,
    load_number,
    select,
)
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.spatial.vectors import dot, subtract
from scene_graph_ros.geometry.tables.vertex_scan import GROUP

__all__ = ["furthest_corner", "scan_corners_of_hull", "scan_corners_of_tile"]

_STRIDE = 4 * GROUP
_GROUP_BITS = 3


@inlined_kernel
def _take_higher(best, way, number, corner):
    """Return (height, number, corner) of the higher of the best corner and another."""
    height = dot(corner, way)
    is_higher = height > best[0]
    x, y, z = best[2]
    return (
        select(is_higher, height, best[0]),
        select(is_higher, number, best[1]),
        (
            select(is_higher, corner[0], x),
            select(is_higher, corner[1], y),
            select(is_higher, corner[2], z),
        ),
    )


def _scanner(corner_of, every_lane):
    """Make a kernel that scans corners: ``corner_of(source, at, k, lane)`` is the k-th of lanes.

    ``every_lane`` repeats a number for as many lanes as are looked at together. The processor goes
    on to the next corner before it has done with the last.
    """

    @inlined_kernel
    def scan(p, source, at, count, lane):
        first = corner_of(source, at, 0, lane)
        way = subtract(p, first)
        best = (dot(first, way), every_lane(0.0), first)
        for k in range(1, count):
            best = _take_higher(best, way, float(k), corner_of(source, at, k, lane))
        _, number, corner = best
        way = subtract(p, corner)
        height = reach = dot(corner, way)
        for k in range(count):
            height = larger(dot(corner_of(source, at, k, lane), way), height)
        return corner, number, way, height <= reach

    return scan


@inlined_kernel
def _corner(blocks, first, k):
    at = first + (k >> _GROUP_BITS) * _STRIDE + (k & (GROUP - 1))
    x, y = load_number(blocks, at), load_number(blocks, at + GROUP)
    return x, y, load_number(blocks, at + 2 * GROUP)


@inlined_kernel
def _corner_of_hull(blocks, first, k, lane):
    x, y, z = _corner(blocks, first, k)
    return every_wide(x), every_wide(y), every_wide(z)


@inlined_kernel
def _corner_of_tile(corners, start, k, lane):
    at = start + k * (3 * LANES) + lane
    x, y = load_lanes(corners, at), load_lanes(corners, at + LANES)
    return x, y, load_lanes(corners, at + 2 * LANES)


scan_corners_of_hull = _scanner(_corner_of_hull, every_wide)
"""Look at the corners of one hull: ``scan_corners_of_hull(p, blocks, first, count, lane)``.

``p`` are wide lanes, the points; the first corner is at the place ``first`` of the blocks. For
each lane is found the corner that lies furthest along the way from the first one to the point, the
first of several. Returned are it, its number, the way from it to the point, and whether no corner
lies further along that.
"""

_scan_tile = _scanner(_corner_of_tile, every)


@inlined_kernel
def scan_corners_of_tile(p, corners, tile, count, lane):
    """Do so of eight lanes, with each lane's hull: corner k is ``corners[tile, k, :, lane + j]``.

    There is a vector to load for each number of a corner: with wide lanes the registers run out.
    """
    return _scan_tile(p, corners, tile * (corners.shape[1] * (3 * LANES)), count, lane)


@inlined_kernel
def furthest_corner(blocks, first, count, way):
    """Return (height, number, corner): of a hull's corners, the furthest along each of four ways.

    The first corner is at the place ``first``; of several, the first is taken.
    """
    x, y, z = _corner(blocks, first, 0)
    corner = every_four(x), every_four(y), every_four(z)
    best = (dot(corner, way), every_four(0.0), corner)
    for k in range(1, count):
        best = _take_higher(best, way, float(k), _corner(blocks, first, k))
    return best

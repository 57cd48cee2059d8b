"""Which corner of a hull is probably nearest to a point, and how far others lie beyond it.

As many lanes as fill a register are looked at together: all that is known of them stays in
registers while the corners pass by.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    every_of_register,
    larger,
    load_number,
    load_register,
    REGISTER,
    select,
    store_lanes,
)
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.spatial.vectors import dot, subtract
from scene_graph_ros.geometry.tables.vertex_scan import GROUP

__all__ = ["scan_corners_of_hull", "scan_corners_of_tile"]

_STRIDE = 4 * GROUP
_GROUP_BITS = 3
_POINT, _NEAREST, _WAY, _HEIGHT, _BEST, _REACH = (LANES * k for k in (0, 7, 14, 17, 18, 19))
"""Numbers of a lane, as in ``hull_lanes``."""


@inlined_kernel
def _load(lanes, at):
    x, y = load_register(lanes, at), load_register(lanes, at + LANES)
    return x, y, load_register(lanes, at + 2 * LANES)


@inlined_kernel
def _store(lanes, at, v):
    store_lanes(lanes, at, v[0])
    store_lanes(lanes, at + LANES, v[1])
    store_lanes(lanes, at + 2 * LANES, v[2])


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


@inlined_kernel
def _keep(lanes, lane, best):
    """Write what is known of the best corner; return (way from it to the point, its height)."""
    _, number, corner = best
    way = subtract(_load(lanes, _POINT + lane), corner)
    reach = dot(corner, way)
    _store(lanes, _NEAREST + lane, corner)
    _store(lanes, _WAY + lane, way)
    store_lanes(lanes, _BEST + lane, number)
    store_lanes(lanes, _REACH + lane, reach)
    return way, reach


def _scanner(corner_of):
    """Make a kernel that scans corners: ``corner_of(source, at, k, lane)`` is the k-th of lanes.

    It has a register for each number of a lane, and all of them at once: the processor goes on to
    the next corner before it has done with the last.
    """

    @lean_kernel
    def scan(lanes, source, at, count):
        for lane in range(0, LANES, REGISTER):
            first = corner_of(source, at, 0, lane)
            way = subtract(_load(lanes, _POINT + lane), first)
            best = (dot(first, way), every_of_register(0.0), first)
            for k in range(1, count):
                best = _take_higher(best, way, float(k), corner_of(source, at, k, lane))
            way, height = _keep(lanes, lane, best)
            for k in range(count):
                height = larger(dot(corner_of(source, at, k, lane), way), height)
            store_lanes(lanes, _HEIGHT + lane, height)

    return scan


@inlined_kernel
def _corner_of_hull(blocks, first, k, lane):
    at = first + (k >> _GROUP_BITS) * _STRIDE + (k & (GROUP - 1))
    x, y = load_number(blocks, at), load_number(blocks, at + GROUP)
    z = load_number(blocks, at + 2 * GROUP)
    return every_of_register(x), every_of_register(y), every_of_register(z)


@inlined_kernel
def _corner_of_tile(corners, start, k, lane):
    return _load(corners, start + k * (3 * LANES) + lane)


scan_corners_of_hull = _scanner(_corner_of_hull)
"""Look at the corners of one hull: ``scan_corners_of_hull(lanes, blocks, first, count)``.

The first corner is at the place ``first`` of the blocks. For each lane is found the corner that
lies furthest along the way from the first one to the point, the first of several: its coordinates,
its number, the way from it to the point, how far it lies along that way, and how far the furthest
corner does.
"""

_scan_tile = _scanner(_corner_of_tile)


@inlined_kernel
def scan_corners_of_tile(lanes, corners, tile, count):
    """Do so with the first corners of each lane's hull, ``corners[tile, k, axis, lane]``."""
    _scan_tile(lanes, corners, tile * (corners.shape[1] * (3 * LANES)), count)

"""Support points of one core in eight directions at once."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import every, root, select, with_sign
from scene_graph_ros.geometry.narrowphase.cores import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    HULL,
    SEGMENT,
    TRIANGLE,
)
from scene_graph_ros.geometry.tables.hull_blocks import vertex, vertex_place

__all__ = ["lane_support"]


@inlined_kernel
def _inverse_root(square):
    """Return 1 / sqrt of lanes, 0 where they are."""
    return select(square > 0.0, 1.0 / root(square), every(0.0))


@inlined_kernel
def _furthest_corners(hulls, hull, d):
    """Return the corners of a hull that lie furthest along directions d."""
    height = every(-math.inf)
    x = y = z = every(0.0)
    for k in range(int(hulls[hull])):
        v = vertex(hulls, vertex_place(hull, k))
        along = v[0] * d[0] + v[1] * d[1] + v[2] * d[2]
        is_higher = along > height
        height = select(is_higher, along, height)
        x, y, z = (
            select(is_higher, v[0], x),
            select(is_higher, v[1], y),
            select(is_higher, v[2], z),
        )
    return x, y, z


@inlined_kernel
def _furthest_of_three(params, d):
    """Return the vertices of a triangle that lie furthest along directions d."""
    x, y, z = every(params[0]), every(params[1]), every(params[2])
    height = params[0] * d[0] + params[1] * d[1] + params[2] * d[2]
    for k in (3, 6):
        along = params[k] * d[0] + params[k + 1] * d[1] + params[k + 2] * d[2]
        is_higher = along > height
        height = select(is_higher, along, height)
        x, y, z = (
            select(is_higher, every(params[k]), x),
            select(is_higher, every(params[k + 1]), y),
            select(is_higher, every(params[k + 2]), z),
        )
    return x, y, z


@inlined_kernel
def lane_support(core, hulls, d):
    """Return points of a core that lie furthest along d, three lanes, in the core's frame.

    Without their radius: see ``cores.support``, which knows the same kinds.
    """
    kind, h = core[0], core[3]
    if kind == BOX:
        return with_sign(h[0], d[0]), with_sign(h[1], d[1]), with_sign(h[2], d[2])
    if kind == HULL:
        return _furthest_corners(hulls, core[1], d)
    if kind == CYLINDER:
        inverse = h[0] * _inverse_root(d[0] * d[0] + d[1] * d[1])
        return inverse * d[0], inverse * d[1], with_sign(h[1], d[2])
    if kind == ELLIPSOID:
        x, y, z = h[0] * d[0], h[1] * d[1], h[2] * d[2]
        inverse = _inverse_root(x * x + y * y + z * z)
        return h[0] * (inverse * x), h[1] * (inverse * y), h[2] * (inverse * z)
    if kind == SEGMENT:
        return every(0.0), every(0.0), with_sign(h[0], d[2])
    if kind == TRIANGLE:
        return _furthest_of_three(h, d)
    return every(h[0]), every(h[1]), every(h[2])

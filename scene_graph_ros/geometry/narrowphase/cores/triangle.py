"""A triangle."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import as_lanes, every, select
from scene_graph_ros.geometry.narrowphase.cores import corners
from scene_graph_ros.geometry.narrowphase.cores.corners import feature_at, vertex_at
from scene_graph_ros.geometry.narrowphase.cores.without import (
    corner_ways,
    edge_count,
    edge_feature,
    edge_of,
    face_count,
    face_feature,
    growth,
    has_plane_across,
    inner_radius,
    is_curved,
    is_listed,
    is_simple,
    lane_vertices,
    local_vertex,
    side,
    vertex_count,
)
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE, NO_FEATURE
from scene_graph_ros.geometry.narrowphase.pair import at_origin
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    cross,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    unit,
)

__all__ = [
    "candidate",
    "clamp_to",
    "corner_ways",
    "edge_count",
    "edge_feature",
    "edge_of",
    "face_count",
    "face_feature",
    "feature_at",
    "growth",
    "has_plane_across",
    "inner_radius",
    "is_curved",
    "is_listed",
    "is_simple",
    "lane_planes",
    "lane_support",
    "lane_vertices",
    "local_vertex",
    "neighbor",
    "plane_count",
    "plane_of",
    "side",
    "support",
    "touched",
    "vertex_count",
]


@lean_kernel
def support(core, hulls, d):
    """Return (point, index) of a corner."""
    params = core[3]
    h0 = params[0] * d[0] + params[1] * d[1] + params[2] * d[2]
    h1 = params[3] * d[0] + params[4] * d[1] + params[5] * d[2]
    h2 = params[6] * d[0] + params[7] * d[1] + params[8] * d[2]
    if h0 >= h1 and h0 >= h2:
        return (params[0], params[1], params[2]), 0
    if h1 >= h2:
        return (params[3], params[4], params[5]), 1
    return (params[6], params[7], params[8]), 2


@inlined_kernel
def lane_support(core, hulls, d):
    """Return corners of it."""
    params = core[3]
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


@lean_kernel
def _corners(placed):
    """Return the corners of a TRIANGLE at pose (R, p)."""
    core, R, p = placed
    c = core[3]
    return (
        add(rotate(R, (c[0], c[1], c[2])), p),
        add(rotate(R, (c[3], c[4], c[5])), p),
        add(rotate(R, (c[6], c[7], c[8])), p),
    )


@inlined_kernel
def plane_count(core, hulls):
    """Return 2: its plane, from either side."""
    return 2


@lean_kernel
def plane_of(core, hulls, k):
    """Return (unit normal, offset from the origin) of its plane; one without an area has any."""
    o, u, v = _corners(at_origin(core))
    up = unit(cross(subtract(u, o), subtract(v, o)), (0.0, 0.0, 1.0))
    out = scale(-1.0, up) if k & 1 else up
    return out, dot(out, o)


@inlined_kernel
def lane_planes(core, hulls, first):
    """Return its plane, from either side."""
    up, offset = plane_of(core, hulls, 0)
    sign = as_lanes((1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    return scale(sign, up), select(sign == 0.0, math.inf, sign * offset)


@inlined_kernel
def clamp_to(placed, feature, simplex, side, a):
    """Return the point a moved onto an edge; its first corner where a is out of the triangle."""
    if feature[0] == LINE:
        return corners.clamp_to_line(feature, a)
    o, u, v = _corners(placed)
    return corners.clamp_to_triangle(o, u, v, a)


@lean_kernel
def touched(placed, hulls, d, tie):
    """Return a corner."""
    core, R, p = placed
    corner, _ = support(core, hulls, rotate_inverse(R, d))
    return vertex_at(add(rotate(R, corner), p))


@lean_kernel
def neighbor(placed, hulls, now, a, d, allowed):
    """Go to an end of an edge, or along one to another corner."""
    return corners.neighbor(now, a, d, touched(placed, hulls, d, 0.0)[1], allowed)


@lean_kernel
def candidate(placed, hulls, simplex, side, d, index):
    """Return the feature of the simplex, a corner, the face, or one of the edges."""
    if index == 0:
        return feature_at(placed, simplex, side, d)
    if index == 1:
        return touched(placed, hulls, d, 0.0)
    o, u, v = _corners(placed)
    if index == 2:
        n = unit(cross(subtract(u, o), subtract(v, o)), d)
        return FACE, o, n if dot(n, d) > 0.0 else scale(-1.0, n), 0.0, 0.0, 0.0
    if index > 5:
        return NO_FEATURE
    x, y = (o, u) if index == 3 else ((u, v) if index == 4 else (v, o))
    h = scale(0.5, subtract(y, x))
    half = norm(h)
    return LINE, add(x, h), unit(h, d), 0.0, -half, half

"""A cylinder along z, around its centre."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import as_lanes, every, select, with_sign
from scene_graph_ros.geometry.narrowphase.cores.corners import clamp_to_line, simplex_corner
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import along, NOTHING
from scene_graph_ros.geometry.narrowphase.cores.kinds import (
    CORNERS_ACROSS_SIDE,
    CURVED,
    ORIGIN,
)
from scene_graph_ros.geometry.narrowphase.cores.lane_roots import inverse_root
from scene_graph_ros.geometry.narrowphase.cores.segment import growth_along
from scene_graph_ros.geometry.narrowphase.cores.without import (
    edge_count,
    edge_feature,
    edge_of,
    face_count,
    is_listed,
    is_simple,
    lane_vertices,
    local_vertex,
    vertex_count,
)
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE, NO_FEATURE, RIM
from scene_graph_ros.geometry.spatial.vectors import (
    axpy,
    column,
    cross,
    dot,
    norm,
    scale,
    subtract,
)
from scene_graph_ros.geometry.tolerances import PARALLEL

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

CAP_SHARE = 0.98
"""A contact of a cap within this share of its radius is first taken for one of its face."""

INSIDE_CONE = 1e-3
"""Radians. A normal further than this from both ends of a rim's quarter turn is a rim's: another
feature must be what is wrong with a contact."""


@lean_kernel
def support(core, hulls, d):
    """Return (point, index) of a point of a rim, or the middle of an end."""
    params = core[3]
    z = math.copysign(params[1], d[2])
    radial = math.sqrt(d[0] * d[0] + d[1] * d[1])
    if radial > 0.0:
        return (params[0] * d[0] / radial, params[0] * d[1] / radial, z), CURVED
    return (0.0, 0.0, z), CURVED


@inlined_kernel
def lane_support(core, hulls, d):
    """Return points of the rims."""
    params = core[3]
    inverse = params[0] * inverse_root(d[0] * d[0] + d[1] * d[1])
    return inverse * d[0], inverse * d[1], with_sign(params[1], d[2])


@lean_kernel
def inner_radius(core, hulls, q, m):
    """Return the radius (m) of the largest ball inside that touches the side or an end at q."""
    h = core[3]
    if abs(m[2]) <= PARALLEL:
        return min(h[0], h[1] - abs(q[2]))
    if abs(m[0]) + abs(m[1]) <= PARALLEL:
        return min(h[1], h[0] - math.sqrt(q[0] * q[0] + q[1] * q[1]))
    return 0.0


@lean_kernel
def growth(core, hulls, q, m, t, u, flat, near):
    """Return the growth of the side, a rim or an end."""
    radius, half = core[3][0], core[3][1]
    _, _, _, _, _, kt, ku, uu = growth_along(half, q, m, t, u, flat)
    across = math.sqrt(m[0] * m[0] + m[1] * m[1])
    if across * radius <= flat:
        rest = max(radius - math.sqrt(q[0] * q[0] + q[1] * q[1]), 0.0)
        return 0.0, 0.0, 0.0, 0.0, 0.0, rest, 0.0, rest
    x, y = m[0] / across, m[1] / across
    if abs(radius * x - q[0]) + abs(radius * y - q[1]) > near:
        return NOTHING
    tt, tu, vv = along(radius * radius, x * t[1] - y * t[0], x * u[1] - y * u[0])
    return radius * across, radius * abs(m[2]), tt, tu, vv, kt, ku, uu


@lean_kernel
def feature(placed, kind, upper):
    """Return a cylinder's side (LINE), or one of its ends' RIM or FACE."""
    core, R, p = placed
    radius, half = core[3][0], core[3][1]
    axis = column(R, 2)
    if kind == LINE:
        return LINE, p, axis, radius, -half, half
    outward = axis if upper else scale(-1.0, axis)
    return kind, axpy(half, outward, p), outward, radius, 0.0, 0.0


@lean_kernel
def feature_at(placed, simplex, side, d):
    """Return the side, a rim or an end that a simplex suggests."""
    core, R, p = placed
    S, lam, count = simplex.S, simplex.lam, simplex.num_corners
    axis = column(R, 2)
    z = 0.0
    extreme = 0.0
    witness = ORIGIN
    for i in range(count):
        q = subtract(simplex_corner(S, i, side), p)
        along = dot(axis, q)
        if along * z < 0.0:
            return feature(placed, LINE, True)
        z = along
        extreme = max(extreme, abs(along))
        witness = axpy(lam[i], q, witness)
    radial = norm(axpy(-dot(axis, witness), axis, witness))
    kind = FACE if radial < CAP_SHARE * core[3][0] else RIM
    return feature(placed, kind, z > 0.0)


@inlined_kernel
def clamp_to(placed, feature, simplex, side, a):
    """Return the point a moved onto the side's line, or from the plane of an end into its disc."""
    if feature[0] == LINE:
        return clamp_to_line(feature, a)
    q = subtract(a, feature[1])
    radial = norm(q)
    return a if radial <= feature[3] else axpy(feature[3] / radial, q, feature[1])


@lean_kernel
def neighbor(placed, hulls, now, a, d, allowed):
    """Follow the contact around the edges of a cylinder's side and caps."""
    core, R, p = placed
    radius, half = core[3][0], core[3][1]
    axis = column(R, 2)
    along = dot(axis, subtract(a, p))
    slope = dot(axis, d)
    if now[0] == LINE:
        if abs(along) > half:
            return feature(placed, RIM, along > 0.0)
        if abs(slope) * half > allowed:
            return feature(placed, RIM, slope > 0.0)
        return now
    upper = dot(axis, now[2]) > 0.0
    if now[0] == FACE:
        tilt = cross(axis, d)
        if norm(subtract(a, now[1])) > radius or norm(tilt) * radius > allowed:
            return feature(placed, RIM, upper)
        return now
    # At the border of a rim's quarter turn, the contact is one of what lies beyond.
    if dot(d, now[2]) < INSIDE_CONE:
        return feature(placed, LINE, upper)
    if norm(cross(axis, d)) < INSIDE_CONE:
        return feature(placed, FACE, upper)
    return now


@inlined_kernel
def is_curved(core):
    """Return True."""
    return True


@inlined_kernel
def has_plane_across(core, k):
    """Return whether the axis is the one through its ends."""
    return k == 2


@inlined_kernel
def plane_count(core, hulls):
    """Return 2: its ends."""
    return 2


@inlined_kernel
def plane_of(core, hulls, k):
    """Return (outward unit normal, offset from the origin) of an end, the upper one first."""
    return (0.0, 0.0, -1.0 if k & 1 else 1.0), core[3][1]


@inlined_kernel
def lane_planes(core, hulls, first):
    """Return its two ends."""
    nothing, beyond = every(0.0), math.inf
    z = as_lanes((1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    return (nothing, nothing, z), select(z == 0.0, beyond, core[3][1])


@inlined_kernel
def corner_ways(core, hulls):
    """Return that corners leave it across its side."""
    return CORNERS_ACROSS_SIDE


@inlined_kernel
def side(placed):
    """Return its side."""
    return feature(placed, LINE, True)


@lean_kernel
def face_feature(placed, hulls, k, d):
    """Return the end that faces along d."""
    R = placed.R
    return feature(placed, FACE, dot(column(R, 2), d) > 0.0)


@lean_kernel
def touched(placed, hulls, d, tie):
    """Return the side where d is across it to a tie, else a rim."""
    core, R = placed.core, placed.R
    slope = dot(column(R, 2), d)
    if abs(slope) * core[3][1] <= tie:
        return feature(placed, LINE, True)
    return feature(placed, RIM, slope > 0.0)


@lean_kernel
def candidate(placed, hulls, simplex, side, d, index):
    """Return the side, the rims or the ends."""
    if index == 0:
        return feature(placed, LINE, True)
    if index <= 2:
        return feature(placed, RIM, index == 1)
    return feature(placed, FACE, index == 3) if index <= 4 else NO_FEATURE

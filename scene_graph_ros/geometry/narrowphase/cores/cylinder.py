"""A cylinder along z, around its centre."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import with_sign
from scene_graph_ros.geometry.narrowphase.cores.corners import simplex_corner
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import along, NOTHING
from scene_graph_ros.geometry.narrowphase.cores.kinds import ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.lane_roots import inverse_root
from scene_graph_ros.geometry.narrowphase.cores.segment import growth as growth_of_segment
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE, RIM
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
    "clamp_to_end",
    "feature",
    "feature_at",
    "growth",
    "inner_radius",
    "lane_support",
    "neighbor",
    "support",
]

CAP_SHARE = 0.98
"""A contact of a cap within this share of its radius is first taken for one of its face."""

INSIDE_CONE = 1e-3
"""Radians. A normal further than this from both ends of a rim's quarter turn is a rim's: another
feature must be what is wrong with a contact."""


@lean_kernel
def support(params, d):
    """Return a point of a rim, or the middle of an end."""
    z = math.copysign(params[1], d[2])
    radial = math.sqrt(d[0] * d[0] + d[1] * d[1])
    if radial > 0.0:
        return (params[0] * d[0] / radial, params[0] * d[1] / radial, z)
    return (0.0, 0.0, z)


@inlined_kernel
def lane_support(params, d):
    """Return points of the rims."""
    inverse = params[0] * inverse_root(d[0] * d[0] + d[1] * d[1])
    return inverse * d[0], inverse * d[1], with_sign(params[1], d[2])


@lean_kernel
def inner_radius(h, q, m):
    """Return the radius (m) of the largest ball inside that touches the side or an end at q."""
    if abs(m[2]) <= PARALLEL:
        return min(h[0], h[1] - abs(q[2]))
    if abs(m[0]) + abs(m[1]) <= PARALLEL:
        return min(h[1], h[0] - math.sqrt(q[0] * q[0] + q[1] * q[1]))
    return 0.0


@lean_kernel
def growth(radius, half, q, m, t, u, flat, near):
    """Return the growth of the side, a rim or an end."""
    _, _, _, _, _, kt, ku, uu = growth_of_segment(half, q, m, t, u, flat)
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
def feature(core, R, p, kind, upper):
    """Return a cylinder's side (LINE), or one of its ends' RIM or FACE."""
    radius, half = core[3][0], core[3][1]
    axis = column(R, 2)
    if kind == LINE:
        return LINE, p, axis, radius, -half, half
    outward = axis if upper else scale(-1.0, axis)
    return kind, axpy(half, outward, p), outward, radius, 0.0, 0.0


@lean_kernel
def feature_at(core, R, p, S, lam, count, side):
    """Return the side, a rim or an end that a simplex suggests."""
    axis = column(R, 2)
    z = 0.0
    extreme = 0.0
    witness = ORIGIN
    for i in range(count):
        q = subtract(simplex_corner(S, i, side), p)
        along = dot(axis, q)
        if along * z < 0.0:
            return feature(core, R, p, LINE, True)
        z = along
        extreme = max(extreme, abs(along))
        witness = axpy(lam[i], q, witness)
    radial = norm(axpy(-dot(axis, witness), axis, witness))
    kind = FACE if radial < CAP_SHARE * core[3][0] else RIM
    return feature(core, R, p, kind, z > 0.0)


@inlined_kernel
def clamp_to_end(end, a):
    """Return the point a of the plane of an end moved into its disc."""
    q = subtract(a, end[1])
    radial = norm(q)
    return a if radial <= end[3] else axpy(end[3] / radial, q, end[1])


@lean_kernel
def neighbor(core, R, p, now, a, d, allowed):
    """Follow the contact around the edges of a cylinder's side and caps."""
    radius, half = core[3][0], core[3][1]
    axis = column(R, 2)
    along = dot(axis, subtract(a, p))
    slope = dot(axis, d)
    if now[0] == LINE:
        if abs(along) > half:
            return feature(core, R, p, RIM, along > 0.0)
        if abs(slope) * half > allowed:
            return feature(core, R, p, RIM, slope > 0.0)
        return now
    upper = dot(axis, now[2]) > 0.0
    if now[0] == FACE:
        tilt = cross(axis, d)
        if norm(subtract(a, now[1])) > radius or norm(tilt) * radius > allowed:
            return feature(core, R, p, RIM, upper)
        return now
    # At the border of a rim's quarter turn, the contact is one of what lies beyond.
    if dot(d, now[2]) < INSIDE_CONE:
        return feature(core, R, p, LINE, upper)
    if norm(cross(axis, d)) < INSIDE_CONE:
        return feature(core, R, p, FACE, upper)
    return now

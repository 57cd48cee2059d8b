"""A ninth kind of core, for tests alone: a cone around z, cut off at both ends.

Its parameters: the radius at -half, the radius at half, the half length (m). With this one file
in the registry, the narrow phase measures it.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import as_lanes, every, select
from scene_graph_ros.geometry.narrowphase.cores import cylinder
from scene_graph_ros.geometry.narrowphase.cores.corners import clamp_to_line, line, simplex_corner
from scene_graph_ros.geometry.narrowphase.cores.kinds import CURVED, ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.lane_roots import inverse_root
from scene_graph_ros.geometry.narrowphase.cores.without import (
    corner_ways,
    edge_count,
    edge_feature,
    edge_of,
    face_count,
    inner_radius,
    is_listed,
    is_simple,
    lane_vertices,
    local_vertex,
    side,
    vertex_count,
)
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE, NO_FEATURE, RIM
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    column,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
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

CAP_SHARE = 0.98
"""A contact of an end within this share of its radius is first taken for one of its face."""


@lean_kernel
def support(core, hulls, d):
    """Return (point, index) of a point of the rim that lies further, or the middle of an end."""
    low, high, half = core[3][0], core[3][1], core[3][2]
    radial = math.sqrt(d[0] * d[0] + d[1] * d[1])
    is_upper = high * radial + half * d[2] >= low * radial - half * d[2]
    r, z = (high, half) if is_upper else (low, -half)
    if radial > 0.0:
        return (r * d[0] / radial, r * d[1] / radial, z), CURVED
    return (0.0, 0.0, z), CURVED


@inlined_kernel
def lane_support(core, hulls, d):
    """Return points of the rims."""
    low, high, half = core[3][0], core[3][1], core[3][2]
    inverse = inverse_root(d[0] * d[0] + d[1] * d[1])
    radial = inverse * (d[0] * d[0] + d[1] * d[1])
    is_upper = high * radial + half * d[2] >= low * radial - half * d[2]
    r = inverse * select(is_upper, every(high), every(low))
    return r * d[0], r * d[1], select(is_upper, every(half), every(-half))


@inlined_kernel
def is_curved(core):
    """Return True."""
    return True


@lean_kernel
def growth(core, hulls, q, m, t, u, flat, near):
    """Return the growth of the disc of the end that q is nearer to: it is a part of the cone."""
    r = core[3][1] if q[2] > 0.0 else core[3][0]
    disc = (core[0], core[1], 0.0, (r, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    if abs(abs(q[2]) - core[3][2]) > flat:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return cylinder.growth(disc, hulls, (q[0], q[1], 0.0), m, t, u, flat, near)


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
    return (0.0, 0.0, -1.0 if k & 1 else 1.0), core[3][2]


@inlined_kernel
def lane_planes(core, hulls, first):
    """Return its two ends."""
    z = as_lanes((1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    nothing = every(0.0)
    return (nothing, nothing, z), select(z == 0.0, math.inf, core[3][2])


@lean_kernel
def _end(placed, kind, upper):
    """Return the RIM or the FACE of an end."""
    core, R, p = placed
    axis = column(R, 2)
    out = axis if upper else scale(-1.0, axis)
    r = core[3][1] if upper else core[3][0]
    return kind, axpy(core[3][2], out, p), out, r, 0.0, 0.0


@lean_kernel
def _line_towards(placed, d):
    """Return the line on the surface that runs from rim to rim where it faces along d."""
    core, R, p = placed
    local = rotate_inverse(R, d)
    length = math.sqrt(local[0] * local[0] + local[1] * local[1])
    x, y = (local[0] / length, local[1] / length) if length > 0.0 else (1.0, 0.0)
    low, high, half = core[3][0], core[3][1], core[3][2]
    a, b = (low * x, low * y, -half), (high * x, high * y, half)
    return line(add(rotate(R, a), p), add(rotate(R, b), p))


@lean_kernel
def feature_at(placed, simplex, side, d):
    """Return a line of the surface, a rim or an end."""
    core, R, p = placed
    S, lam, count = simplex.S, simplex.lam, simplex.num_corners
    axis = column(R, 2)
    z = 0.0
    witness = ORIGIN
    for i in range(count):
        q = subtract(simplex_corner(S, i, side), p)
        along = dot(axis, q)
        if along * z < 0.0:
            return _line_towards(placed, d)
        z = along
        witness = axpy(lam[i], q, witness)
    radial = norm(axpy(-dot(axis, witness), axis, witness))
    r = core[3][1] if z > 0.0 else core[3][0]
    return _end(placed, FACE if radial < CAP_SHARE * r else RIM, z > 0.0)


@lean_kernel
def neighbor(placed, hulls, now, a, d, allowed):
    """Return the same feature."""
    return now


@lean_kernel
def touched(placed, hulls, d, tie):
    """Return the rim that lies further."""
    core, R = placed.core, placed.R
    x, _ = support(core, hulls, rotate_inverse(R, d))
    return _end(placed, RIM, x[2] > 0.0)


@lean_kernel
def face_feature(placed, hulls, k, d):
    """Return the end that faces along d."""
    R = placed.R
    return _end(placed, FACE, dot(column(R, 2), d) > 0.0)


@lean_kernel
def candidate(placed, hulls, simplex, side, d, index):
    """Return a line of the surface, the rims or the ends."""
    if index == 0:
        return _line_towards(placed, d)
    if index <= 2:
        return _end(placed, RIM, index == 1)
    return _end(placed, FACE, index == 3) if index <= 4 else NO_FEATURE


@inlined_kernel
def clamp_to(placed, feature, simplex, side, a):
    """Return the point a moved onto the line, or from the plane of an end into its disc."""
    if feature[0] == LINE:
        return clamp_to_line(feature, a)
    q = subtract(a, feature[1])
    radial = norm(q)
    return a if radial <= feature[3] else axpy(feature[3] / radial, q, feature[1])

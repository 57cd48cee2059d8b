"""An ellipsoid around its centre, its axes those of the frame."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import NOTHING
from scene_graph_ros.geometry.narrowphase.cores.kinds import (
    CORNERS_OF_ELLIPSOID,
    CURVED,
    ORIGIN,
)
from scene_graph_ros.geometry.narrowphase.cores.lane_roots import inverse_root
from scene_graph_ros.geometry.narrowphase.cores.without import (
    clamp_to,
    edge_count,
    edge_feature,
    edge_of,
    face_count,
    face_feature,
    has_plane_across,
    is_listed,
    is_simple,
    lane_planes,
    lane_vertices,
    local_vertex,
    plane_count,
    plane_of,
    side,
    vertex_count,
)
from scene_graph_ros.geometry.narrowphase.features import NO_FEATURE, SMOOTH
from scene_graph_ros.geometry.spatial.vectors import cross, dot, norm, scale, subtract

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
    """Return (point, index) of the point where d is the normal."""
    params = core[3]
    x, y, z = params[0] * d[0], params[1] * d[1], params[2] * d[2]
    length = math.sqrt(x * x + y * y + z * z)
    if length > 0.0:
        return (params[0] * x / length, params[1] * y / length, params[2] * z / length), CURVED
    return (params[0], 0.0, 0.0), CURVED


@inlined_kernel
def lane_support(core, hulls, d):
    """Return the points where d are the normals."""
    params = core[3]
    x, y, z = params[0] * d[0], params[1] * d[1], params[2] * d[2]
    inverse = inverse_root(x * x + y * y + z * z)
    return params[0] * (inverse * x), params[1] * (inverse * y), params[2] * (inverse * z)


@lean_kernel
def inner_radius(core, hulls, q, m):
    """Return the radius (m) of the largest ball inside that touches where m is the normal."""
    h = core[3]
    # The point is that of the surface nearest to x = q (1 + t / axes^2), t >= -least axis^2.
    least = min(h[0], h[1], h[2])
    return least * least / norm((h[0] * m[0], h[1] * m[1], h[2] * m[2]))


@lean_kernel
def growth(core, hulls, q, m, t, u, flat, near):
    """Return the growth around a point of the surface."""
    axes = core[3]
    w = (axes[0] * m[0], axes[1] * m[1], axes[2] * m[2])
    length = norm(w)
    w = scale(1.0 / length, w)
    if norm(subtract((axes[0] * w[0], axes[1] * w[1], axes[2] * w[2]), q)) > near:
        return NOTHING
    mt = (axes[0] * t[0], axes[1] * t[1], axes[2] * t[2])
    mu = (axes[0] * u[0], axes[1] * u[1], axes[2] * u[2])
    x, y = dot(w, mt), dot(w, mu)
    f, g = cross(mt, w), cross(mu, w)
    slope = math.sqrt(x * x + y * y)
    return length, slope, dot(f, f), dot(f, g), dot(g, g), 0.0, 0.0, 0.0


@inlined_kernel
def is_curved(core):
    """Return True."""
    return True


@inlined_kernel
def corner_ways(core, hulls):
    """Return that they are found by an algorithm of its own."""
    return CORNERS_OF_ELLIPSOID


@inlined_kernel
def touched(placed, hulls, d, tie):
    """Return the surface."""
    p = placed.p
    return SMOOTH, p, ORIGIN, 0.0, 0.0, 0.0


@inlined_kernel
def feature_at(placed, simplex, side, d):
    """Return the surface."""
    p = placed.p
    return SMOOTH, p, ORIGIN, 0.0, 0.0, 0.0


@lean_kernel
def neighbor(placed, hulls, now, a, d, allowed):
    """Return the same feature."""
    return now


@inlined_kernel
def candidate(placed, hulls, simplex, side, d, index):
    """Return the surface, once."""
    return touched(placed, hulls, d, 0.0) if index == 0 else NO_FEATURE

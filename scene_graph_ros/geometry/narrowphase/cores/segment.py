"""A segment along z, around its middle."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import as_lanes, every, with_sign
from scene_graph_ros.geometry.narrowphase.cores import corners
from scene_graph_ros.geometry.narrowphase.cores.corners import clamp_to, feature_at, vertex_at
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import along, NOTHING
from scene_graph_ros.geometry.narrowphase.cores.kinds import CORNERS_NOWHERE
from scene_graph_ros.geometry.narrowphase.cores.without import (
    has_plane_across,
    inner_radius,
    is_curved,
    is_listed,
    is_simple,
    plane_count,
    plane_of,
    side,
)
from scene_graph_ros.geometry.narrowphase.features import LINE, NO_FEATURE
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    column,
    rotate,
    rotate_inverse,
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
    "growth_along",
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

PARTS = 4
"""A segment has one edge and no face: directions around it divide the circle of its normals."""


@inlined_kernel
def support(core, hulls, d):
    """Return (point, index) of an end."""
    z = math.copysign(core[3][0], d[2])
    return (0.0, 0.0, z), int(z > 0.0)


@inlined_kernel
def lane_support(core, hulls, d):
    """Return ends of it."""
    return every(0.0), every(0.0), with_sign(core[3][0], d[2])


@inlined_kernel
def growth(core, hulls, q, m, t, u, flat, near):
    """Return the growth of the line."""
    return growth_along(core[3][0], q, m, t, u, flat)


@lean_kernel
def growth_along(half, q, m, t, u, flat):
    """Return the growth of the line of that half length along the third axis."""
    if abs(m[2]) * half > flat:
        return NOTHING
    kt, ku, uu = along(max(half - abs(q[2]), 0.0), t[2], u[2])
    return 0.0, 0.0, 0.0, 0.0, 0.0, kt, ku, uu


@inlined_kernel
def lane_planes(core, hulls, first):
    """Return four directions around it that stand for faces."""
    x = as_lanes((1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    y = as_lanes((0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0))
    beyond = math.inf
    offsets = as_lanes((0.0, 0.0, 0.0, 0.0, beyond, beyond, beyond, beyond))
    return (x, y, every(0.0)), offsets


@inlined_kernel
def edge_of(placed, hulls, k):
    """Return (one face, the next face around, a point of both)."""
    p = placed.p
    return k, (k + 1) % PARTS, p


@inlined_kernel
def lane_vertices(core, hulls, first):
    """Return its ends."""
    half = core[3][0]
    z = as_lanes((-half, half, half, half, half, half, half, half))
    return every(0.0), every(0.0), z


@inlined_kernel
def local_vertex(core, hulls, k):
    """Return an end."""
    half = core[3][0]
    return (0.0, 0.0, half if k & 1 else -half)


@inlined_kernel
def edge_count(core, hulls):
    """Return into how many parts directions around it are divided."""
    return PARTS


@inlined_kernel
def face_count(core, hulls):
    """Return the number of directions around it that stand for faces."""
    return PARTS


@inlined_kernel
def vertex_count(core, hulls):
    """Return 2."""
    return 2


@inlined_kernel
def corner_ways(core, hulls):
    """Return that there are none: its ends are corners."""
    return CORNERS_NOWHERE


@lean_kernel
def edge_feature(placed, hulls, k):
    """Return the line."""
    core, R, p = placed
    half = core[3][0]
    return LINE, p, column(R, 2), 0.0, -half, half


@lean_kernel
def face_feature(placed, hulls, k, d):
    """Return the line: its faces are directions around it."""
    return edge_feature(placed, hulls, k)


@lean_kernel
def touched(placed, hulls, d, tie):
    """Return an end."""
    core, R, p = placed
    end, _ = support(core, hulls, rotate_inverse(R, d))
    return vertex_at(add(rotate(R, end), p))


@lean_kernel
def neighbor(placed, hulls, now, a, d, allowed):
    """Go to an end, or from there to the line."""
    return corners.neighbor(now, a, d, touched(placed, hulls, d, 0.0)[1], allowed)


@lean_kernel
def candidate(placed, hulls, simplex, side, d, index):
    """Return the feature of the simplex, an end, or the line."""
    if index == 0:
        return feature_at(placed, simplex, side, d)
    if index == 1:
        return touched(placed, hulls, d, 0.0)
    return edge_feature(placed, hulls, 0) if index == 2 else NO_FEATURE

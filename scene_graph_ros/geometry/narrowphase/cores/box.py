"""A box around its centre."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import as_lanes, with_sign
from scene_graph_ros.geometry.narrowphase.cores.corners import simplex_corner, vertex_at
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import along
from scene_graph_ros.geometry.narrowphase.cores.kinds import CORNERS_NOWHERE, ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.without import (
    is_curved,
    is_listed,
    is_simple,
    side,
)
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE, NO_FEATURE, NONE, VERTEX
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    column,
    rotate,
    rotate_inverse,
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


@inlined_kernel
def support(core, hulls, d):
    """Return (point, index) of a corner."""
    params = core[3]
    x = math.copysign(params[0], d[0])
    y = math.copysign(params[1], d[1])
    z = math.copysign(params[2], d[2])
    return (x, y, z), int(x > 0.0) + 2 * int(y > 0.0) + 4 * int(z > 0.0)


@inlined_kernel
def lane_support(core, hulls, d):
    """Return corners of it."""
    params = core[3]
    return (
        with_sign(params[0], d[0]),
        with_sign(params[1], d[1]),
        with_sign(params[2], d[2]),
    )


@lean_kernel
def inner_radius(core, hulls, q, m):
    """Return the radius (m) of the largest ball inside that touches a face at q."""
    h = core[3]
    x, y, z = abs(m[0]), abs(m[1]), abs(m[2])
    spare_x, spare_y, spare_z = h[0] - abs(q[0]), h[1] - abs(q[1]), h[2] - abs(q[2])
    if x + y <= PARALLEL:
        return min(h[2], spare_x, spare_y)
    if x + z <= PARALLEL:
        return min(h[1], spare_x, spare_z)
    if y + z <= PARALLEL:
        return min(h[0], spare_y, spare_z)
    return 0.0


@lean_kernel
def growth(core, hulls, q, m, t, u, flat, near):
    """Return the growth of a face, an edge or a corner."""
    h = core[3]
    kt = ku = uu = 0.0
    for c in range(3):
        if abs(m[c]) * h[c] <= flat:
            a, b, d = along(max(h[c] - abs(q[c]), 0.0), t[c], u[c])
            kt, ku, uu = kt + a, ku + b, uu + d
    return 0.0, 0.0, 0.0, 0.0, 0.0, kt, ku, uu


@inlined_kernel
def edge_of(placed, hulls, k):
    """Return (one face, the other face, a point) of an edge."""
    core, R, p = placed
    params = core[3]
    i, j = (k // 4 + 1) % 3, (k // 4 + 2) % 3
    v = axpy(-params[i] if k & 1 else params[i], column(R, i), p)
    v = axpy(-params[j] if k & 2 else params[j], column(R, j), v)
    return 2 * i + (k & 1), 2 * j + (k & 2) // 2, v


@inlined_kernel
def lane_vertices(core, hulls, first):
    """Return its corners."""
    h = core[3]
    return (
        with_sign(h[0], as_lanes((-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0))),
        with_sign(h[1], as_lanes((-1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0))),
        with_sign(h[2], as_lanes((-1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0))),
    )


@inlined_kernel
def local_vertex(core, hulls, k):
    """Return a corner."""
    params = core[3]
    return (
        params[0] if k & 1 else -params[0],
        params[1] if k & 2 else -params[1],
        params[2] if k & 4 else -params[2],
    )


@lean_kernel
def _side_of(value):
    return -1.0 if value < 0.0 else 1.0


@lean_kernel
def feature(placed, free_x, free_y, free_z, corner):
    """Return the vertex, edge or face of a box that contains ``corner`` and the free directions.

    ``corner`` is a corner in the box's frame; it tells the signs of the coordinates not free.
    """
    core, R, p = placed
    h = core[3]
    count = int(free_x) + int(free_y) + int(free_z)
    c = (
        0.0 if free_x else math.copysign(h[0], corner[0]),
        0.0 if free_y else math.copysign(h[1], corner[1]),
        0.0 if free_z else math.copysign(h[2], corner[2]),
    )
    at = add(rotate(R, c), p)
    if count == 0:
        return VERTEX, at, ORIGIN, 0.0, 0.0, 0.0
    if count == 1:
        k = 0 if free_x else (1 if free_y else 2)
        return LINE, at, column(R, k), 0.0, -h[k], h[k]
    if count == 2:
        k = 0 if not free_x else (1 if not free_y else 2)
        return FACE, at, scale(_side_of(c[k]), column(R, k)), 0.0, 0.0, 0.0
    return NONE, at, ORIGIN, 0.0, 0.0, 0.0


@lean_kernel
def feature_at(placed, simplex, side, d):
    """Return the feature that contains all corners of a simplex."""
    R, p = placed.R, placed.p
    S, ids, count = simplex.S, simplex.ids, simplex.num_corners
    owner = side // 3 - 1
    first = ids[0, owner]
    varies = 0
    for i in range(1, count):
        varies |= ids[i, owner] ^ first
    corner = rotate_inverse(R, subtract(simplex_corner(S, 0, side), p))
    return feature(placed, varies & 1 != 0, varies & 2 != 0, varies & 4 != 0, corner)


@lean_kernel
def _clip(x, h):
    return max(-h, min(h, x))


@inlined_kernel
def clamp_to(placed, feature, simplex, side, a):
    """Return the point a moved into the box."""
    core, R, p = placed
    h = core[3]
    q = rotate_inverse(R, subtract(a, p))
    q = (_clip(q[0], h[0]), _clip(q[1], h[1]), _clip(q[2], h[2]))
    return add(rotate(R, q), p)


@lean_kernel
def _is_free(at, corner, slope, h, allowed):
    """Return whether a box's contact may move along one axis, given that coordinate of it.

    ``at``, ``corner`` and ``slope`` are that of the contact, the feature and the direction.
    """
    if abs(corner) < 0.5 * h:
        return abs(at) <= h and abs(slope) * h <= allowed
    return corner * slope < 0.0


@lean_kernel
def neighbor(placed, hulls, now, a, d, allowed):
    """Free the coordinates whose side of the box faces away from d, fix those beyond the box."""
    core, R, p = placed
    h = core[3]
    q = rotate_inverse(R, subtract(a, p))
    c = rotate_inverse(R, subtract(now[1], p))
    n = rotate_inverse(R, d)
    free_x = _is_free(q[0], c[0], n[0], h[0], allowed)
    free_y = _is_free(q[1], c[1], n[1], h[1], allowed)
    free_z = _is_free(q[2], c[2], n[2], h[2], allowed)
    # A coordinate inside the box that has become fixed goes to the side that faces along d.
    corner = (
        n[0] if abs(q[0]) <= h[0] else q[0],
        n[1] if abs(q[1]) <= h[1] else q[1],
        n[2] if abs(q[2]) <= h[2] else q[2],
    )
    return feature(placed, free_x, free_y, free_z, corner)


@inlined_kernel
def edge_count(core, hulls):
    """Return 12."""
    return 12


@inlined_kernel
def face_count(core, hulls):
    """Return 6."""
    return 6


@inlined_kernel
def vertex_count(core, hulls):
    """Return 8."""
    return 8


@inlined_kernel
def has_plane_across(core, k):
    """Return True."""
    return True


@inlined_kernel
def plane_count(core, hulls):
    """Return 6."""
    return 6


@inlined_kernel
def plane_of(core, hulls, k):
    """Return (outward unit normal, offset from the origin) of a face."""
    axis, s = k // 2, -1.0 if k & 1 else 1.0
    out = (s if axis == 0 else 0.0, s if axis == 1 else 0.0, s if axis == 2 else 0.0)
    return out, core[3][axis]


@inlined_kernel
def lane_planes(core, hulls, first):
    """Return its six faces."""
    x, y, z = core[3][0], core[3][1], core[3][2]
    normals = (
        as_lanes((1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        as_lanes((0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.0)),
        as_lanes((0.0, 0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0)),
    )
    return normals, as_lanes((x, x, y, y, z, z, math.inf, math.inf))


@inlined_kernel
def corner_ways(core, hulls):
    """Return that there are none: it has corners itself."""
    return CORNERS_NOWHERE


@lean_kernel
def face_feature(placed, hulls, k, d):
    """Return the face k."""
    axis = k // 2
    s = -1.0 if k & 1 else 1.0
    return feature(placed, axis != 0, axis != 1, axis != 2, (s, s, s))


@lean_kernel
def edge_feature(placed, hulls, k):
    """Return the edge k."""
    axis = k // 4
    s, t = -1.0 if k & 1 else 1.0, -1.0 if k & 2 else 1.0
    if axis == 0:
        return feature(placed, True, False, False, (0.0, s, t))
    if axis == 1:
        return feature(placed, False, True, False, (t, 0.0, s))
    return feature(placed, False, False, True, (s, t, 0.0))


@lean_kernel
def touched(placed, hulls, d, tie):
    """Return a corner."""
    core, R, p = placed
    corner, _ = support(core, hulls, rotate_inverse(R, d))
    return vertex_at(add(rotate(R, corner), p))


@lean_kernel
def candidate(placed, hulls, simplex, side, d, index):
    """Return the feature of the simplex, a corner, one of its edges, or one of its faces."""
    R = placed.R
    if index == 0:
        return feature_at(placed, simplex, side, d)
    if index == 1:
        return touched(placed, hulls, d, 0.0)
    if index > 7:
        return NO_FEATURE
    k = (index - 2) % 3
    is_face = index >= 5
    corner = rotate_inverse(R, d)
    return feature(placed, (k == 0) != is_face, (k == 1) != is_face, (k == 2) != is_face, corner)

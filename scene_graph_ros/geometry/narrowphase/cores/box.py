"""A box around its centre."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import with_sign
from scene_graph_ros.geometry.narrowphase.cores.corners import simplex_corner
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import along
from scene_graph_ros.geometry.narrowphase.cores.kinds import ORIGIN
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE, NONE, VERTEX
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    column,
    dot,
    rotate,
    rotate_inverse,
    scale,
    subtract,
)
from scene_graph_ros.geometry.tolerances import PARALLEL

__all__ = [
    "EDGES",
    "FACES",
    "VERTICES",
    "clamp",
    "edge_of",
    "face_of",
    "feature",
    "feature_at",
    "growth",
    "inner_radius",
    "lane_support",
    "neighbor",
    "support",
    "vertex_of",
]

EDGES = 12
FACES = 6
VERTICES = 8


@inlined_kernel
def support(params, d):
    """Return (point, index) of a corner."""
    x = math.copysign(params[0], d[0])
    y = math.copysign(params[1], d[1])
    z = math.copysign(params[2], d[2])
    return (x, y, z), int(x > 0.0) + 2 * int(y > 0.0) + 4 * int(z > 0.0)


@inlined_kernel
def lane_support(params, d):
    """Return corners of it."""
    return (
        with_sign(params[0], d[0]),
        with_sign(params[1], d[1]),
        with_sign(params[2], d[2]),
    )


@lean_kernel
def inner_radius(h, q, m):
    """Return the radius (m) of the largest ball inside that touches a face at q."""
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
def growth(h, q, m, t, u, flat):
    """Return the growth of a face, an edge or a corner."""
    kt = ku = uu = 0.0
    for c in range(3):
        if abs(m[c]) * h[c] <= flat:
            a, b, d = along(max(h[c] - abs(q[c]), 0.0), t[c], u[c])
            kt, ku, uu = kt + a, ku + b, uu + d
    return 0.0, 0.0, 0.0, 0.0, 0.0, kt, ku, uu


@inlined_kernel
def face_of(params, R, p, f):
    """Return (outward unit normal, offset from the origin) of a face."""
    d = column(R, f // 2)
    if f & 1:
        d = scale(-1.0, d)
    return d, params[f // 2] + dot(p, d)


@inlined_kernel
def edge_of(params, R, p, k):
    """Return (one face, the other face, a point) of an edge."""
    i, j = (k // 4 + 1) % 3, (k // 4 + 2) % 3
    v = axpy(-params[i] if k & 1 else params[i], column(R, i), p)
    v = axpy(-params[j] if k & 2 else params[j], column(R, j), v)
    return 2 * i + (k & 1), 2 * j + (k & 2) // 2, v


@inlined_kernel
def vertex_of(params, k):
    """Return a corner."""
    return (
        params[0] if k & 1 else -params[0],
        params[1] if k & 2 else -params[1],
        params[2] if k & 4 else -params[2],
    )


@lean_kernel
def _side_of(value):
    return -1.0 if value < 0.0 else 1.0


@lean_kernel
def feature(core, R, p, free_x, free_y, free_z, corner):
    """Return the vertex, edge or face of a box that contains ``corner`` and the free directions.

    ``corner`` is a corner in the box's frame; it tells the signs of the coordinates not free.
    """
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
def feature_at(core, R, p, S, ids, count, side):
    """Return the feature that contains all corners of a simplex."""
    owner = side // 3 - 1
    first = ids[0, owner]
    varies = 0
    for i in range(1, count):
        varies |= ids[i, owner] ^ first
    corner = rotate_inverse(R, subtract(simplex_corner(S, 0, side), p))
    return feature(core, R, p, varies & 1 != 0, varies & 2 != 0, varies & 4 != 0, corner)


@lean_kernel
def _clip(x, h):
    return max(-h, min(h, x))


@inlined_kernel
def clamp(h, R, p, a):
    """Return the point a moved into the box."""
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
def neighbor(core, R, p, now, a, d, allowed):
    """Free the coordinates whose side of the box faces away from d, fix those beyond the box."""
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
    return feature(core, R, p, free_x, free_y, free_z, corner)

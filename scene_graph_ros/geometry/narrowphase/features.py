"""The features of cores that touch at a contact, and their support points and curvatures.

A feature is the tuple ``(kind, c, e, r, low, high)`` in A's frame (m):

======== ======================================================================
VERTEX   the point c
LINE     c + s e for low <= s <= high, inflated by r (the side of a cylinder)
RIM      the circle around c of radius r, orthogonal to e, which points outward
FACE     a plane through c with the outward unit normal e; a disc of radius r, or a polygon (0)
SMOOTH   an ellipsoid's surface; only its core and pose tell more
======== ======================================================================

Each feature has a support function of its own, smooth where the core's has a kink: a contact is
where the smooth ones of both features agree with the cores' (equations in ``polish``).
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    ORIGIN,
)
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    column,
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
    "FACE",
    "LINE",
    "NONE",
    "RIM",
    "SMOOTH",
    "VERTEX",
    "box_feature",
    "curved_support",
    "cylinder_feature",
    "feature_at",
    "feature_support",
]

VERTEX = 0
LINE = 1
RIM = 2
FACE = 3
SMOOTH = 4
NONE = 5

CAP_SHARE = 0.98
"""A contact of a cap within this share of its radius is first taken for one of its face."""


@lean_kernel
def cylinder_feature(core, R, p, kind, upper):
    """Return a cylinder's side (LINE), or one of its ends' RIM or FACE."""
    radius, half = core[3][0], core[3][1]
    axis = column(R, 2)
    if kind == LINE:
        return LINE, p, axis, radius, -half, half
    outward = axis if upper else scale(-1.0, axis)
    return kind, axpy(half, outward, p), outward, radius, 0.0, 0.0


@lean_kernel
def _side_of(value):
    return -1.0 if value < 0.0 else 1.0


@lean_kernel
def box_feature(core, R, p, free_x, free_y, free_z, corner):
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
def _point(S, row, side):
    return (S[row, side], S[row, side + 1], S[row, side + 2])


@lean_kernel
def _box_feature_at(core, R, p, S, ids, count, side):
    owner = side // 3 - 1
    first = ids[0, owner]
    varies = 0
    for i in range(1, count):
        varies |= ids[i, owner] ^ first
    corner = rotate_inverse(R, subtract(_point(S, 0, side), p))
    return box_feature(core, R, p, varies & 1 != 0, varies & 2 != 0, varies & 4 != 0, corner)


@lean_kernel
def _cylinder_feature_at(core, R, p, S, lam, count, side):
    axis = column(R, 2)
    z = 0.0
    extreme = 0.0
    witness = ORIGIN
    for i in range(count):
        q = subtract(_point(S, i, side), p)
        along = dot(axis, q)
        if along * z < 0.0:
            return cylinder_feature(core, R, p, LINE, True)
        z = along
        extreme = max(extreme, abs(along))
        witness = axpy(lam[i], q, witness)
    radial = norm(axpy(-dot(axis, witness), axis, witness))
    kind = FACE if radial < CAP_SHARE * core[3][0] else RIM
    return cylinder_feature(core, R, p, kind, z > 0.0)


@lean_kernel
def _polytope_feature_at(S, ids, count, side, d):
    """Return the feature spanned by the distinct corners of one body in a simplex."""
    owner = side // 3 - 1
    a = _point(S, 0, side)
    i = 1
    while i < count and ids[i, owner] == ids[0, owner]:
        i += 1
    if i >= count:
        return VERTEX, a, ORIGIN, 0.0, 0.0, 0.0
    b = _point(S, i, side)
    k = i + 1
    while k < count and (ids[k, owner] == ids[0, owner] or ids[k, owner] == ids[i, owner]):
        k += 1
    e = subtract(b, a)
    if k >= count:
        length = norm(e)
        half = 0.5 * length
        middle = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2]))
        return LINE, middle, unit(e, d), 0.0, -half, half
    n = unit(cross(e, subtract(_point(S, k, side), a)), d)
    return FACE, a, n if dot(n, d) > 0.0 else scale(-1.0, n), 0.0, 0.0, 0.0


@inlined_kernel
def feature_at(core, R, p, S, ids, lam, count, side, d):
    """Return the feature of a core that a simplex of the Minkowski difference points to.

    ``side`` is the first column of the core's points in S (3 for A, 6 for B), ``d`` the direction
    out of the core at the contact.
    """
    kind = core[0]
    if kind == ELLIPSOID:
        return SMOOTH, p, ORIGIN, 0.0, 0.0, 0.0
    if kind == CYLINDER:
        return _cylinder_feature_at(core, R, p, S, lam, count, side)
    if kind == BOX:
        return _box_feature_at(core, R, p, S, ids, count, side)
    return _polytope_feature_at(S, ids, count, side, d)


@inlined_kernel
def feature_support(feature, core, R, d):
    """Return the feature's support point along the unit vector d; on a LINE that at s = 0."""
    kind, c, e, r = feature[0], feature[1], feature[2], feature[3]
    if kind == LINE:
        return axpy(r, d, c)
    if kind == RIM:
        radial = unit(axpy(-dot(d, e), e, d), ORIGIN)
        # Nearly along e, what is left of d is small, and so is no more orthogonal to rounding.
        return axpy(r, axpy(-dot(radial, e), e, radial), c)
    if kind == SMOOTH:
        axes = core[3]
        q = rotate_inverse(R, d)
        x, y, z = axes[0] * q[0], axes[1] * q[1], axes[2] * q[2]
        length = math.sqrt(x * x + y * y + z * z)
        q = (axes[0] * x / length, axes[1] * y / length, axes[2] * z / length)
        return add(rotate(R, q), c)
    return c


@inlined_kernel
def curved_support(feature, core, R, d, t, u):
    """Return (point, tt, tu, uu): the support point along d, and how it moves as d does.

    d need not be a unit vector. tt, tu and uu are rows t H u of the second derivative H of the
    feature's support function at d: at a unit vector, and along vectors orthogonal to it, its
    surface's radii of curvature (m). On a LINE, d has to be orthogonal to it, and s is 0.
    """
    kind, c, e, r = feature[0], feature[1], feature[2], feature[3]
    if kind == SMOOTH:
        axes = core[3]
        q, t, u = rotate_inverse(R, d), rotate_inverse(R, t), rotate_inverse(R, u)
        q = (axes[0] * q[0], axes[1] * q[1], axes[2] * q[2])
        inverse = 1.0 / norm(q)
        q = scale(inverse, q)
        at = add(rotate(R, (axes[0] * q[0], axes[1] * q[1], axes[2] * q[2])), c)
        # With q the unit vector along (axes d): t (1 - q q^T) u, written as cross products.
        tq = cross((axes[0] * t[0], axes[1] * t[1], axes[2] * t[2]), q)
        uq = cross((axes[0] * u[0], axes[1] * u[1], axes[2] * u[2]), q)
        return at, dot(tq, tq) * inverse, dot(tq, uq) * inverse, dot(uq, uq) * inverse
    if kind in (RIM, LINE):
        radial = axpy(-dot(d, e), e, d)
        length = norm(radial)
        if not length > 0.0:
            return c, 0.0, 0.0, 0.0
        inverse = 1.0 / length
        radial = scale(inverse, radial)
        m = cross(e, radial)
        mt, mu = dot(m, t), dot(m, u)
        # Nearly along e, what is left of d is small, and so is no more orthogonal to rounding.
        at = axpy(r, axpy(-dot(radial, e), e, radial), c)
        stretch = r * inverse
        return at, stretch * mt * mt, stretch * mt * mu, stretch * mu * mu
    return c, 0.0, 0.0, 0.0

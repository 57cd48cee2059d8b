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

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import ORIGIN
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    cross,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    unit,
)

__all__ = [
    "FACE",
    "LINE",
    "NONE",
    "NO_FEATURE",
    "RIM",
    "SMOOTH",
    "VERTEX",
    "curved_support",
    "feature_support",
]

VERTEX = 0
LINE = 1
RIM = 2
FACE = 3
SMOOTH = 4
NONE = 5

NO_FEATURE = (NONE, ORIGIN, ORIGIN, 0.0, 0.0, 0.0)
"""Where there is none of what was asked for."""


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

"""Lower bounds of two bodies' distance, by balls and boxes around them, and their directions."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, load_lanes, magnitude, smaller
from scene_graph_ros.geometry.spatial.vectors import dot
from scene_graph_ros.planning.pairs.separation_lanes import between_boxes

__all__ = ["separation", "separations_at"]

_ROUNDING = 1e-14
"""Of the lengths that are subtracted: what rounding may add to a distance."""

_TINY = 1e-300
"""Square metres: smaller squares have lost digits."""


@inlined_kernel
def _dot(X, i, x, y, z, k):
    """Return the component of a vector in W along axis i of a body."""
    return X[i, k] * x + X[4 + i, k] * y + X[8 + i, k] * z


@inlined_kernel
def _extent(bodies, b, X, x, y, z, k):
    """Return the support of a body from its centre along a unit vector in W."""
    lower, upper, extent = bodies.lower[b], bodies.upper[b], 0.0
    for i in range(3):
        extent += 0.5 * (upper[i] - lower[i]) * abs(_dot(X, i, x, y, z, k))
    return min(extent, bodies.radii[b])


@inlined_kernel
def _above_half_space(bodies, a, b, places, k):
    """Return the same as ``separation`` where B is a half space."""
    X, A = places.X_WG[b], places.centers[a]
    nx, ny, nz = X[2, k], X[6, k], X[10, k]
    far = nx * (A[0, k] - X[3, k]) + ny * (A[1, k] - X[7, k]) + nz * (A[2, k] - X[11, k])
    extent = _extent(bodies, a, places.X_WG[a], nx, ny, nz, k)
    return far - extent - _ROUNDING * (abs(far) + extent), (nx, ny, nz)


@inlined_kernel
def separation(bodies, a, b, places, k):
    """Return (distance, n) in configuration k: along n, out of B into A, they are so far apart.

    The largest along the faces' normals of both boxes, and from A's centre to B's box (Gottschalk
    and others, *OBBTree*, 1996, section 5, without the axes of two edges). Never more than the
    truth, also where the bodies overlap.
    """
    if bodies.radii[b] == math.inf:
        return _above_half_space(bodies, a, b, places, k)
    best, n = -math.inf, (0.0, 0.0, 1.0)
    A, B = places.centers[a], places.centers[b]
    x, y, z = A[0, k] - B[0, k], A[1, k] - B[1, k], A[2, k] - B[2, k]
    X_A, X_B = places.X_WG[a], places.X_WG[b]
    beyond, ox, oy, oz = 0.0, 0.0, 0.0, 0.0
    for side in range(2):
        X, other = (X_B, X_A) if side == 0 else (X_A, X_B)
        own, body = (b, a) if side == 0 else (a, b)
        lower, upper = bodies.lower[own], bodies.upper[own]
        for i in range(3):
            ux, uy, uz = X[i, k], X[4 + i, k], X[8 + i, k]
            far, half = ux * x + uy * y + uz * z, 0.5 * (upper[i] - lower[i])
            extent = half + _extent(bodies, body, other, ux, uy, uz, k)
            apart = abs(far) - extent - _ROUNDING * (abs(far) + extent)
            sign = 1.0 if far >= 0.0 else -1.0
            if apart > best:
                best, n = apart, (sign * ux, sign * uy, sign * uz)
            excess = abs(far) - half
            if side == 0 and excess > 0.0:
                beyond += excess * excess
                excess *= sign
                ox, oy, oz = ox + excess * ux, oy + excess * uy, oz + excess * uz
    if beyond > _TINY:
        beyond = math.sqrt(beyond)
        ox, oy, oz = ox / beyond, oy / beyond, oz / beyond
        extent = _extent(bodies, a, X_A, ox, oy, oz, k)
        size = abs(x) + abs(y) + abs(z) + extent
        apart = beyond - extent - _ROUNDING * size
        if apart > best:
            best, n = apart, (ox, oy, oz)
    return best, n


@inlined_kernel
def _three(array, at, step):
    """Return three of a body's numbers in eight configurations."""
    return (
        load_lanes(array, at * LANES),
        load_lanes(array, (at + step) * LANES),
        load_lanes(array, (at + 2 * step) * LANES),
    )


@inlined_kernel
def _box_of(bodies, b, places):
    """Return the arguments of ``between_boxes`` for a body in eight configurations."""
    X, lower, upper = places.X_WG[b], bodies.lower[b], bodies.upper[b]
    axes = _three(X, 0, 4), _three(X, 1, 4), _three(X, 2, 4)
    half = (
        0.5 * (upper[0] - lower[0]),
        0.5 * (upper[1] - lower[1]),
        0.5 * (upper[2] - lower[2]),
    )
    return axes, half, _three(places.centers[b], 0, 1), bodies.radii[b]


@inlined_kernel
def _above_half_spaces(bodies, a, b, places):
    """Return the same as ``separations_at`` where B is a half space."""
    axes, half, p, radius = _box_of(bodies, a, places)
    X = places.X_WG[b]
    n, q = _three(X, 2, 4), _three(X, 3, 4)
    far = dot(n, (p[0] - q[0], p[1] - q[1], p[2] - q[2]))
    along = magnitude(dot(n, axes[0])), magnitude(dot(n, axes[1])), magnitude(dot(n, axes[2]))
    extent = smaller(dot(half, along), radius)
    return far - extent - _ROUNDING * (magnitude(far) + extent)


@inlined_kernel
def separations_at(bodies, a, b, places):
    """Return the bound of ``separation`` for a pair in eight configurations, or a larger one.

    Never more than the truth, also where the bodies overlap.
    """
    if bodies.radii[b] == math.inf:
        return _above_half_spaces(bodies, a, b, places)
    return between_boxes(_box_of(bodies, a, places), _box_of(bodies, b, places))

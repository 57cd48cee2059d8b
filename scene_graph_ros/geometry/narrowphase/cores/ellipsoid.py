"""An ellipsoid around its centre, its axes those of the frame."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.growth_forms import NOTHING
from scene_graph_ros.geometry.narrowphase.cores.lane_roots import inverse_root
from scene_graph_ros.geometry.spatial.vectors import cross, dot, norm, scale, subtract

__all__ = ["growth", "inner_radius", "lane_support", "support"]


@lean_kernel
def support(params, d):
    """Return the point where d is the normal."""
    x, y, z = params[0] * d[0], params[1] * d[1], params[2] * d[2]
    length = math.sqrt(x * x + y * y + z * z)
    if length > 0.0:
        return (params[0] * x / length, params[1] * y / length, params[2] * z / length)
    return (params[0], 0.0, 0.0)


@inlined_kernel
def lane_support(params, d):
    """Return the points where d are the normals."""
    x, y, z = params[0] * d[0], params[1] * d[1], params[2] * d[2]
    inverse = inverse_root(x * x + y * y + z * z)
    return params[0] * (inverse * x), params[1] * (inverse * y), params[2] * (inverse * z)


@lean_kernel
def inner_radius(h, m):
    """Return the radius (m) of the largest ball inside that touches where m is the normal."""
    # The point is that of the surface nearest to x = q (1 + t / axes^2), t >= -least axis^2.
    least = min(h[0], h[1], h[2])
    return least * least / norm((h[0] * m[0], h[1] * m[1], h[2] * m[2]))


@lean_kernel
def growth(axes, q, m, t, u, near):
    """Return the growth around a point of the surface."""
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

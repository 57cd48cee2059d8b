"""Cores with corners, as a simplex of the Minkowski difference knows them."""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import ORIGIN
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE, VERTEX
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, norm, scale, subtract, unit
from scene_graph_ros.geometry.tolerances import EPSILON, POLISH_RESIDUAL

__all__ = [
    "clamp_to",
    "clamp_to_line",
    "clamp_to_triangle",
    "feature_at",
    "line",
    "neighbor",
    "simplex_corner",
    "vertex_at",
]


@inlined_kernel
def vertex_at(a):
    """Return the corner at the point a."""
    return VERTEX, a, ORIGIN, 0.0, 0.0, 0.0


@lean_kernel
def line(a, b):
    """Return the edge between two points."""
    e = subtract(b, a)
    half = 0.5 * norm(e)
    return LINE, axpy(0.5, e, a), unit(e, ORIGIN), 0.0, -half, half


@lean_kernel
def simplex_corner(S, row, side):
    """Return the point of one body in a row of a simplex."""
    return (S[row, side], S[row, side + 1], S[row, side + 2])


@lean_kernel
def feature_at(placed, simplex, side, d):
    """Return the feature spanned by the distinct corners of one body in a simplex."""
    S, ids, count = simplex.S, simplex.ids, simplex.num_corners
    owner = side // 3 - 1
    a = simplex_corner(S, 0, side)
    i = 1
    while i < count and ids[i, owner] == ids[0, owner]:
        i += 1
    if i >= count:
        return VERTEX, a, ORIGIN, 0.0, 0.0, 0.0
    b = simplex_corner(S, i, side)
    k = i + 1
    while k < count and (ids[k, owner] == ids[0, owner] or ids[k, owner] == ids[i, owner]):
        k += 1
    e = subtract(b, a)
    if k >= count:
        length = norm(e)
        half = 0.5 * length
        middle = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2]))
        return LINE, middle, unit(e, d), 0.0, -half, half
    n = unit(cross(e, subtract(simplex_corner(S, k, side), a)), d)
    return FACE, a, n if dot(n, d) > 0.0 else scale(-1.0, n), 0.0, 0.0, 0.0


@lean_kernel
def clamp_to_triangle(o, u, v, a):
    """Return the point a of the plane through o, u and v, or o where it is out of the triangle."""
    e, f = subtract(u, o), subtract(v, o)
    m = cross(e, f)
    q = subtract(a, o)
    mm = dot(m, m)
    s = dot(cross(q, f), m)
    t = dot(cross(e, q), m)
    slack = POLISH_RESIDUAL * EPSILON * mm
    if s < -slack or t < -slack or s + t > mm + slack:
        return o
    return a


@inlined_kernel
def clamp_to_line(feature, a):
    """Return the point a moved along a LINE until it is between its ends."""
    q = subtract(a, feature[1])
    s = dot(feature[2], q)
    return axpy(max(feature[4], min(feature[5], s)) - s, feature[2], a)


@inlined_kernel
def clamp_to(placed, feature, simplex, side, a):
    """Return the point a moved onto a LINE, or into the triangle of a simplex' corners."""
    if feature[0] == LINE:
        return clamp_to_line(feature, a)
    return _clamp_to_simplex(simplex, side, a)


@lean_kernel
def _clamp_to_simplex(simplex, side, a):
    S, ids, count = simplex.S, simplex.ids, simplex.num_corners
    owner = side // 3 - 1
    i = 1
    while i < count and ids[i, owner] == ids[0, owner]:
        i += 1
    k = i + 1
    while k < count and (ids[k, owner] == ids[0, owner] or ids[k, owner] == ids[i, owner]):
        k += 1
    return clamp_to_triangle(
        (S[0, side], S[0, side + 1], S[0, side + 2]),
        (S[i, side], S[i, side + 1], S[i, side + 2]),
        (S[k, side], S[k, side + 1], S[k, side + 2]),
        a,
    )


@lean_kernel
def neighbor(now, a, d, furthest, allowed):
    """Go to an end of an edge, or along an edge to the corner ``furthest`` along d."""
    c = now[1]
    if now[0] == LINE:
        e, half = now[2], now[5]
        s = dot(e, subtract(a, c))
        slope = dot(e, d)
        if abs(s) > half:
            return VERTEX, axpy(math.copysign(half, s), e, c), ORIGIN, 0.0, 0.0, 0.0
        if abs(slope) * half > allowed:
            return VERTEX, axpy(math.copysign(half, slope), e, c), ORIGIN, 0.0, 0.0, 0.0
        return now
    e = subtract(furthest, c)
    if now[0] == FACE:
        if dot(e, d) > allowed or norm(cross(now[2], d)) * norm(e) > allowed:
            return VERTEX, furthest, ORIGIN, 0.0, 0.0, 0.0
        return now
    if dot(e, d) > allowed:
        half = 0.5 * norm(e)
        return LINE, axpy(0.5, e, c), unit(e, d), 0.0, -half, half
    return now

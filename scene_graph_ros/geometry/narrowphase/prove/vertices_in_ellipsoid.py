"""Whether a vertex of a polytope P can leave an ellipsoid Q by less than a known depth.

Among all directions d, D(d) = v . d + h_Q(-d) of a vertex v has at most two minima, both in closed
form but for one root. Along a stationary direction, -d is the outward normal of Q's surface at a
point x whose difference from v is along it: x_i = a_i^2 v_i / (a_i^2 + s), with the semi-axes a_i
and a Lagrange multiplier s, and x on the surface. By the second derivative of the Lagrangian, 1 +
s / a_i^2 along the axes, a minimum has at most one of these negative: s is the one root beyond
-c^2, the least semi-axis squared, or the largest below it, if that is beyond the middle one.

A pair is (Q, P), in Q's frame.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.questions import (
    placed_inner_radius,
    placed_support,
    vertex_count,
    vertex_of,
)
from scene_graph_ros.geometry.narrowphase.pair import body_A, body_B
from scene_graph_ros.geometry.spatial.vectors import axpy, dot, norm, scale, subtract, unit
from scene_graph_ros.geometry.tolerances import NEIGHBORHOOD

__all__ = ["are_vertices_deeper"]

MAX_NEWTON = 40
"""Steps to a root; four to eight are usual. More are needed where two stationary directions are
about to vanish, and what is not found then is not proven."""

LAST_STEP = 1e-8
"""Relative to the root: the depth there is stationary, so the next step would not change it."""

ON_AXIS = 1e-12
"""Relative to the least semi-axis: a vertex in the plane across it is taken to be this far off, as
its two minima are then mirror images of each other."""

RING = 1e-6
"""Relative to the least semi-axis squared: where the second derivative across the middle axis is
less, the minimum may be one of a ring of equal ones."""


@lean_kernel
def _root(g, d, sigma):
    """Return (is found, sigma): where sum (g_i / (sigma + d_i))^2 = 1, going away from 0.

    Between two poles, the inverse square root of the sum is concave, so Newton's steps come to
    the first root from one side (cf. Conn, Gould, Toint, "Trust-Region Methods", 2000, 7.3.3).
    """
    for _ in range(MAX_NEWTON):
        u, v, w = 1.0 / (sigma + d[0]), 1.0 / (sigma + d[1]), 1.0 / (sigma + d[2])
        x, y, z = g[0] * u, g[1] * v, g[2] * w
        x, y, z = x * x, y * y, z * z
        square = x + y + z
        slope = x * u + y * v + z * w
        if not slope * sigma > 0.0:
            return False, sigma  # the sum is larger everywhere
        step = square * (math.sqrt(square) - 1.0) / slope
        sigma += step
        if abs(step) <= LAST_STEP * abs(sigma):
            return True, sigma
    return False, 0.0


@lean_kernel
def _depth_at(axes, v, g, d, sigma):
    """Return (D, direction) where v leaves the ellipsoid, for a root."""
    m = (
        g[0] / ((sigma + d[0]) * axes[0]),
        g[1] / ((sigma + d[1]) * axes[1]),
        g[2] / ((sigma + d[2]) * axes[2]),
    )
    out = scale(-1.0, unit(m, (0.0, 0.0, 1.0)))
    height = norm((axes[0] * out[0], axes[1] * out[1], axes[2] * out[2]))
    return dot(v, out) + height, out


@inlined_kernel
def _over(axis, least):
    """Return (axis / least)^2 - 1."""
    return ((axis - least) / least) * ((axis + least) / least)


@inlined_kernel
def _is_elsewhere(pair, v, depth, d, least, known, tie):
    """Return whether a minimum does not count: too deep, another vertex', or the known one."""
    hulls = pair.hulls
    if depth >= least + tie:
        return True
    x, _ = placed_support(body_B(pair), hulls, d)
    if dot(subtract(x, v), d) > tie:
        return True
    return depth >= least - tie and dot(d, known) > NEIGHBORHOOD


@lean_kernel
def _is_vertex_deeper(pair, v, least, known, tie):
    """Return whether D exceeds ``least`` where v is P's support point and beside the known d.

    Where those directions end is not looked at: D is known there.
    """
    core_Q = pair.core_A
    axes = core_Q[3]
    shortest, longest = min(axes[0], axes[1], axes[2]), max(axes[0], axes[1], axes[2])
    d = (_over(axes[0], shortest), _over(axes[1], shortest), _over(axes[2], shortest))
    square = shortest * shortest
    g = (axes[0] * v[0] / square, axes[1] * v[1] / square, axes[2] * v[2] / square)
    if d[0] == 0.0 and abs(g[0]) < ON_AXIS:
        g = (ON_AXIS, g[1], g[2])
    elif d[1] == 0.0 and abs(g[1]) < ON_AXIS:
        g = (g[0], ON_AXIS, g[2])
    elif d[2] == 0.0 and abs(g[2]) < ON_AXIS:
        g = (g[0], g[1], ON_AXIS)
    first = max(
        abs(g[0]) if d[0] == 0.0 else 0.0,
        abs(g[1]) if d[1] == 0.0 else 0.0,
        abs(g[2]) if d[2] == 0.0 else 0.0,
    )
    middle = d[0] + d[1] + d[2] - max(d[0], d[1], d[2])
    far = max(first, abs(g[0]) - d[0], abs(g[1]) - d[1], abs(g[2]) - d[2])
    is_found, sigma = _root(g, d, far)
    if not is_found:
        return False
    depth, out = _depth_at(axes, v, g, d, sigma)
    if sigma + middle < RING and depth < least + tie:
        return False
    if not _is_elsewhere(pair, v, depth, out, least, known, tie):
        return False
    # The other minimum is deeper than this: s < -c^2.
    if square >= (least + tie) * longest or first >= middle:
        return True
    is_found, sigma = _root(g, d, -first)
    if not is_found or sigma <= -middle:
        return sigma != 0.0  # there is none, or it was not found
    depth, out = _depth_at(axes, v, g, d, sigma)
    return _is_elsewhere(pair, v, depth, out, least, known, tie)


@inlined_kernel
def are_vertices_deeper(pair, y, least, known, tie):
    """Return whether no vertex of P can leave the ellipsoid Q by less; y is Q's witness.

    The directions looked at are those between the normals of the faces around a vertex.
    """
    core_P, hulls = pair.core_B, pair.hulls
    radius = placed_inner_radius(body_A(pair), hulls, y, scale(-1.0, known))
    centre = axpy(radius, known, y)
    for k in range(vertex_count(core_P, hulls)):
        v = vertex_of(body_B(pair), hulls, k)
        if radius - norm(subtract(v, centre)) < least + tie and not _is_vertex_deeper(
            pair, v, least, known, tie
        ):
            return False
    return True

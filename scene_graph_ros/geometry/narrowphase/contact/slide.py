"""Slide the witness points of a contact along their features until they face each other.

A normal fixes a point of a rim only as far as the rim is seen from above: nearly along its axis,
a turn by rounding moves that point by much more. The distance does not feel it, and the other
body tells where the point must be: with the normal kept, the difference of both points has to lie
along it, which is solved by Gauss and Newton's method over the places along the features.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY, ORIGIN
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE, RIM, SMOOTH
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    any_orthogonal,
    axpy,
    cross,
    dot,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    unit,
)

__all__ = ["back_on", "slide", "solve_semidefinite", "tangents"]

STEPS = 4
"""Each squares an error of at most REACH."""

LEAST_SHARE = 1e-12
"""Of the larger singular value's square: below it, sliding across does not bring points closer."""


@lean_kernel
def tangents(feature, n, x):
    """Return two directions in which a point x of a feature with the normal n may slide."""
    kind, c, e = feature[0], feature[1], feature[2]
    if kind == LINE:
        return e, ORIGIN
    if kind == RIM:
        return cross(e, unit(subtract(x, c), ORIGIN)), ORIGIN
    if kind in (FACE, SMOOTH):
        normal = e if kind == FACE else n
        t = any_orthogonal(normal)
        return t, cross(normal, t)
    return ORIGIN, ORIGIN


@lean_kernel
def back_on(feature, core, R, x):
    """Return the point of a feature that a point next to it stands for."""
    kind, c, e = feature[0], feature[1], feature[2]
    if kind == RIM:
        q = subtract(x, c)
        q = unit(axpy(-dot(q, e), e, q), ORIGIN)
        return axpy(feature[3], axpy(-dot(q, e), e, q), c)
    if kind == SMOOTH:
        axes = core[3]
        q = rotate_inverse(R, subtract(x, c))
        q = unit((q[0] / axes[0], q[1] / axes[1], q[2] / axes[2]), ORIGIN)
        return add(rotate(R, (q[0] * axes[0], q[1] * axes[1], q[2] * axes[2])), c)
    return x


@lean_kernel
def solve_semidefinite(m00, m01, m11, g0, g1):
    """Return the least solution y of the symmetric 2 x 2 system M y = g, M having no negative."""
    mean, half = 0.5 * (m00 + m11), 0.5 * (m00 - m11)
    radius = math.sqrt(half * half + m01 * m01)
    low, high = mean - radius, mean + radius
    if not high > 0.0:
        return 0.0, 0.0
    if low > LEAST_SHARE * high:
        determinant = low * high
        return (m11 * g0 - m01 * g1) / determinant, (m00 * g1 - m01 * g0) / determinant
    c, s = half + radius, m01
    if half < 0.0:
        c, s = m01, radius - half
    length = math.sqrt(c * c + s * s)
    along = (c * g0 + s * g1) / (high * length * length) if length > 0.0 else 0.0
    return c * along, s * along


@lean_kernel
def slide(features, n, a, b, enough):
    """Return (a, b) slid along their features until ``a - b`` lies along n to ``enough`` (m)."""
    feature_A, feature_B, core_A, core_B, R = features
    t = any_orthogonal(n)
    u = cross(n, t)
    for _ in range(STEPS):
        rest = subtract(a, b)
        g0, g1 = dot(t, rest), dot(u, rest)
        if math.sqrt(g0 * g0 + g1 * g1) <= enough:
            break
        a0, a1 = tangents(feature_A, scale(-1.0, n), a)
        b0, b1 = tangents(feature_B, n, b)
        m00 = m01 = m11 = 0.0
        for v in (a0, a1, b0, b1):
            vt, vu = dot(v, t), dot(v, u)
            m00, m01, m11 = m00 + vt * vt, m01 + vt * vu, m11 + vu * vu
        y0, y1 = solve_semidefinite(m00, m01, m11, g0, g1)
        y = axpy(y0, t, scale(y1, u))
        a = axpy(-dot(a0, y), a0, axpy(-dot(a1, y), a1, a))
        b = axpy(dot(b0, y), b0, axpy(dot(b1, y), b1, b))
        a = back_on(feature_A, core_A, IDENTITY, a)
        b = back_on(feature_B, core_B, R, b)
    return a, b

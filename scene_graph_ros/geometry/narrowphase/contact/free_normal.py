"""The normal at which two features are stationary, where they leave it free: Newton's method.

For features with support points a(-n) and b(n) the signed distance is the largest value over unit
vectors n of phi(n) = n . (a - b). Its gradient on the sphere is the part of a - b orthogonal to
n, its Hessian -(W_A + W_B + phi 1) with the features' radii of curvature W.

A feature around c has the support function c . d + |M d| with a linear map M: an ellipsoid's
scales by the semi-axes, a rim's and a round line's drop the part along the axis and scale the rest
by the radius, a vertex' is 0. With m = M d / |M d|, its support point has the product
c . t + m . (M t) with any t, and the Hessian of its support function the product
(m x M t) . (m x M u) / |M d| with any two.

The search goes over a plane, or a line, that touches the sphere at a normal n0 not far: x = n0 +
s t + q u is the normal where a - b lies along it, and needs no square root to stay one. As M x is
M n0 + s M t + q M u, each step is done with three images, and asks no core.
"""

import math

from scene_graph_ros.geometry.compiled.expectations import is_rare
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.contact.first_normal import first_normal
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY, ORIGIN
from scene_graph_ros.geometry.narrowphase.features import SMOOTH, VERTEX
from scene_graph_ros.geometry.spatial.vectors import (
    axpy,
    cross,
    dot,
    norm,
    orthogonal_pair,
    rotate_inverse,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["normal_on_circle", "normal_on_sphere"]

MAX_NEWTON = 24
"""Quadratic convergence takes four to six; the rest is for damped steps on needles."""

MAX_HALVINGS = 6
"""In all. More are needed only where the highest phi is at a kink, where a feature ends."""

MAX_STEP = 0.5
"""Radians. A longer Newton step leaves the region that its second derivative describes."""

ROUNDING_LEFT = 2.0
"""Of the pair's size times EPSILON: what rounding leaves of a gradient."""

HELD_UP = 500.0
"""A gradient this many times larger that does not get smaller is one that rounding holds up."""

FAR_OUT = 1.0
"""How far from the point of contact a plane may stand for the sphere."""

WELL_CONDITIONED = 4e-3
"""A Hessian's determinant over its mean eigenvalue's square: where one is 1e-3 of the other."""

CURVATURE_FLOOR = 1e-12
"""Relative to the pair's size: a smaller second derivative does not fix the normal."""


@inlined_kernel
def _stretched(axes, R, d):
    q = rotate_inverse(R, d)
    return (axes[0] * q[0], axes[1] * q[1], axes[2] * q[2])


@inlined_kernel
def _across(e, r, d):
    return scale(r, axpy(-dot(d, e), e, d))


@inlined_kernel
def _images(feature, core, R, n, t, u):
    """Return M n, M t and M u."""
    kind, e, r = feature[0], feature[2], feature[3]
    if kind == SMOOTH:
        axes = core[3]
        return _stretched(axes, R, n), _stretched(axes, R, t), _stretched(axes, R, u)
    if kind == VERTEX:
        return ORIGIN, ORIGIN, ORIGIN
    return _across(e, r, n), _across(e, r, t), _across(e, r, u)


@inlined_kernel
def _two_images(feature, core, R, n, t):
    """Return M n and M t."""
    kind, e, r = feature[0], feature[2], feature[3]
    if kind == SMOOTH:
        axes = core[3]
        return _stretched(axes, R, n), _stretched(axes, R, t)
    if kind == VERTEX:
        return ORIGIN, ORIGIN
    return _across(e, r, n), _across(e, r, t)


@inlined_kernel
def _direction(w):
    """Return (1 / |w|, w / |w|), all 0 where w is 0."""
    length = norm(w)
    inverse = 1.0 / length if length > 0.0 else 0.0
    return inverse, scale(inverse, w)


@inlined_kernel
def _on_plane(along, t, u, s, q):
    """Return products of a feature's support point, less c, with n0, t and u, and its curvatures.

    along, t, u: the images of n0, t and u.
    """
    inverse, m = _direction(axpy(s, t, axpy(q, u, along)))
    f, g = cross(m, t), cross(m, u)
    second = (dot(f, f) * inverse, dot(f, g) * inverse, dot(g, g) * inverse)
    return (dot(along, m), dot(t, m), dot(u, m)), second


@inlined_kernel
def _on_line(along, t, s):
    """Return the same of a line along t: the products with n0 and t, and the curvature."""
    inverse, m = _direction(axpy(s, t, along))
    f = cross(m, t)
    return dot(along, m), dot(t, m), dot(f, f) * inverse


@lean_kernel
def _newton_step(g, h, floor):
    """Return the step that ascends along one eigendirection, for any sign of h."""
    return max(-MAX_STEP, min(MAX_STEP, g / max(abs(h), floor)))


@lean_kernel
def _stiff_step(g0, g1, h00, h01, h11, floor):
    """Return the step (along t, along u) for the negated Hessian h, one eigenvector by another.

    The eigenvalues enter by their magnitude, so the step ascends also at a saddle.
    """
    mean = 0.5 * (h00 + h11)
    half = 0.5 * (h00 - h11)
    radius = math.sqrt(half * half + h01 * h01)
    # Unit eigenvector of the larger eigenvalue, from the better conditioned of two formulas.
    c, s = half + radius, h01
    if half < 0.0:
        c, s = h01, radius - half
    length = math.sqrt(c * c + s * s)
    if length > 0.0:
        c, s = c / length, s / length
    else:
        c, s = 1.0, 0.0
    along = _newton_step(c * g0 + s * g1, mean + radius, floor)
    across = _newton_step(c * g1 - s * g0, mean - radius, floor)
    return c * along - s * across, s * along + c * across


@inlined_kernel
def _least_curvature(s, q, tt, tu, uu):
    """Return the smallest eigenvalue of H at n = x / |x|, x = n0 + s t + q u, along its tangents.

    tt, tu, uu: H at x along t and u, whose parts orthogonal to n have the products 1 - s^2 / x^2,
    - s q / x^2 and 1 - q^2 / x^2; their determinant is 1 / x^2.
    """
    square = 1.0 + s * s + q * q
    middle = 0.5 * (tt * (1.0 + s * s) + uu * (1.0 + q * q) + 2.0 * tu * s * q)
    determinant = square * (tt * uu - tu * tu)
    root = math.sqrt(max(middle * middle - determinant, 0.0))
    return math.sqrt(square) * (middle - root)


@inlined_kernel
def normal_on_sphere(features, n, size):
    """Return (x, curvature) of two features that leave the normal free; x is along it, near n.

    ``curvature`` is the smallest eigenvalue of W_A + W_B there (m).
    """
    between = subtract(features.A[1], features.B[1])
    enough = ROUNDING_LEFT * EPSILON * size
    floor = CURVATURE_FLOOR * size
    n = first_normal(features, n, size)
    t, u = orthogonal_pair(n)
    c = (dot(n, between), dot(t, between), dot(u, between))
    n_A, t_A, u_A = _images(features.A, features.core_A, IDENTITY, n, t, u)
    n_B, t_B, u_B = _images(features.B, features.core_B, features.R, n, t, u)
    s = q = 0.0
    error = math.inf
    best = n
    curvature = (s, q, 0.0, 0.0, 0.0)
    ds = dq = 0.0
    highest = -math.inf
    halvings = 0
    for _ in range(MAX_NEWTON):
        a, (A00, A01, A11) = _on_plane(n_A, t_A, u_A, s, q)
        b, (B00, B01, B11) = _on_plane(n_B, t_B, u_B, s, q)
        level, along_t, along_u = c[0] - a[0] - b[0], c[1] - a[1] - b[1], c[2] - a[2] - b[2]
        phi = (level + s * along_t + q * along_u) / math.sqrt(1.0 + s * s + q * q)
        if is_rare(phi < highest - HELD_UP * enough):
            halvings += 1
            if halvings > MAX_HALVINGS:
                break
            ds, dq = 0.5 * ds, 0.5 * dq  # the step was too long: half of it leads back
            s, q = s - ds, q - dq
            continue
        highest = phi
        g0, g1 = along_t - s * level, along_u - q * level
        tt, tu, uu = A00 + B00, A01 + B01, A11 + B11
        left = g0 * g0 + g1 * g1
        if left < error:
            error = left
            best = axpy(s, t, axpy(q, u, n))
            curvature = (s, q, tt, tu, uu)
        elif error < HELD_UP * HELD_UP * enough * enough:
            break
        if left <= enough * enough:
            break
        st, sq = s * tt + q * tu, s * tu + q * uu
        h00, h01 = tt + s * st + level, tu + s * sq
        h10, h11 = tu + q * st, uu + q * sq + level
        determinant = h00 * h11 - h01 * h10
        mean = 0.5 * (h00 + h11)
        if mean > 0.0 and determinant > WELL_CONDITIONED * mean * mean:
            inverse = 1.0 / determinant
            ds, dq = (h11 * g0 - h01 * g1) * inverse, (h00 * g1 - h10 * g0) * inverse
            square = ds * ds + dq * dq
            if is_rare(square > MAX_STEP * MAX_STEP):
                shorter = MAX_STEP / math.sqrt(square)
                ds, dq = ds * shorter, dq * shorter
            s, q = s + ds, q + dq
            if s * s + q * q <= FAR_OUT * FAR_OUT:
                continue
        elif s == 0.0 and q == 0.0:
            s, q = ds, dq = _stiff_step(g0, g1, h00, h01, h11, floor)
            continue
        n = unit(axpy(s, t, axpy(q, u, n)), n)
        t, u = orthogonal_pair(n)
        c = (dot(n, between), dot(t, between), dot(u, between))
        n_A, t_A, u_A = _images(features.A, features.core_A, IDENTITY, n, t, u)
        n_B, t_B, u_B = _images(features.B, features.core_B, features.R, n, t, u)
        s = q = 0.0
    s, q, tt, tu, uu = curvature
    return best, _least_curvature(s, q, tt, tu, uu)


@inlined_kernel
def normal_on_circle(features, e, n, size):
    """Return (n, stiffness): the unit normal orthogonal to e, and phi's negated second derivative.

    n: where to begin.
    """
    between = subtract(features.A[1], features.B[1])
    enough = ROUNDING_LEFT * EPSILON * size
    floor = CURVATURE_FLOOR * size
    across, _ = orthogonal_pair(e)
    n = unit(axpy(-dot(n, e), e, n), across)
    t = cross(e, n)
    c_n, c_t = dot(n, between), dot(t, between)
    n_A, t_A = _two_images(features.A, features.core_A, IDENTITY, n, t)
    n_B, t_B = _two_images(features.B, features.core_B, features.R, n, t)
    s = 0.0
    error = math.inf
    best = n
    curvature, stretch, level = 0.0, 1.0, 0.0
    for _ in range(MAX_NEWTON):
        a_n, a_t, A = _on_line(n_A, t_A, s)
        b_n, b_t, B = _on_line(n_B, t_B, s)
        along_n, along_t = c_n - a_n - b_n, c_t - a_t - b_t
        g = along_t - s * along_n
        square = 1.0 + s * s
        h = (A + B) * square + along_n
        if abs(g) < error:
            error = abs(g)
            best = axpy(s, t, n)
            curvature, stretch, level = A + B, square, along_n + s * along_t
        elif error < HELD_UP * enough:
            break
        if abs(g) <= enough:
            break
        s += _newton_step(g, h, floor)
        if is_rare(abs(s) > FAR_OUT):
            n = axpy(s, t, n)
            n = unit(axpy(-dot(n, e), e, n), best)
            t = cross(e, n)
            c_n, c_t = dot(n, between), dot(t, between)
            n_A, t_A = _two_images(features.A, features.core_A, IDENTITY, n, t)
            n_B, t_B = _two_images(features.B, features.core_B, features.R, n, t)
            s = 0.0
    length = math.sqrt(stretch)
    return (
        unit(axpy(-dot(best, e), e, best), n),
        stretch * length * curvature + level / length,
    )

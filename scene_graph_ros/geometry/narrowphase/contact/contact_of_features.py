"""Exact contacts on known features, by Newton's method over the unit normal.

For features with support points a(-n) and b(n) the signed distance is the largest value over unit
vectors n of phi(n) = n . (a - b). Its gradient on the sphere is the part of a - b orthogonal to
n, its Hessian -(W_A + W_B + phi 1) with the features' radii of curvature W. That stays well
conditioned through touching (phi = 0), because n is an unknown and not a ratio of small numbers.
An edge or a cylinder's side forces n to be orthogonal to it, a face fixes n altogether.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY
from scene_graph_ros.geometry.narrowphase.features import (
    curved_support,
    FACE,
    feature_support,
    LINE,
)
from scene_graph_ros.geometry.spatial.vectors import (
    any_orthogonal,
    axpy,
    cross,
    dot,
    norm,
    orthogonal_pair,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import EPSILON, PARALLEL_LINES

__all__ = ["contact_of_features"]

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

SMALL_ANGLE = 0.1
"""Sine of an angle: the cross product of unit vectors this close to parallel loses a digit."""


@lean_kernel
def _newton_step(g, h, floor):
    """Return the step that ascends along one eigendirection, whatever the sign of h."""
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
def _on_sphere(features, n, size):
    """Return (n, stiffness, a, b) of two features whose normal is free.

    Newton's method goes over a plane that touches the sphere at a normal n0 not far: x = n0 + s t
    + q u is the normal where a - b lies along it, and needs no square root to stay one.
    """
    feature_A, feature_B, core_A, core_B, R = features
    enough = ROUNDING_LEFT * EPSILON * size
    floor = CURVATURE_FLOOR * size
    t, u = orthogonal_pair(n)
    s = q = 0.0
    x = n
    error = math.inf
    best = (x, n, n)
    curvature = (s, q, 0.0, 0.0, 0.0)
    ds = dq = 0.0
    highest = -math.inf
    halvings = 0
    for _ in range(MAX_NEWTON):
        a, A00, A01, A11 = curved_support(feature_A, core_A, IDENTITY, scale(-1.0, x), t, u)
        b, B00, B01, B11 = curved_support(feature_B, core_B, R, x, t, u)
        rest = subtract(a, b)
        level = dot(n, rest)
        phi = dot(x, rest) / norm(x)
        if phi < highest - HELD_UP * enough:
            halvings += 1
            if halvings > MAX_HALVINGS:
                break
            ds, dq = 0.5 * ds, 0.5 * dq  # the step was too long: half of it leads back
            s, q = s - ds, q - dq
            x = axpy(s, t, axpy(q, u, n))
            continue
        highest = phi
        g0, g1 = dot(t, rest) - s * level, dot(u, rest) - q * level
        tt, tu, uu = A00 + B00, A01 + B01, A11 + B11
        left = g0 * g0 + g1 * g1
        if left < error:
            error = left
            best = (x, a, b)
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
            if square > MAX_STEP * MAX_STEP:
                shorter = MAX_STEP / math.sqrt(square)
                ds, dq = ds * shorter, dq * shorter
            s, q = s + ds, q + dq
            x = axpy(s, t, axpy(q, u, n))
            if s * s + q * q <= FAR_OUT * FAR_OUT:
                continue
        elif s == 0.0 and q == 0.0:
            s, q = ds, dq = _stiff_step(g0, g1, h00, h01, h11, floor)
            x = axpy(s, t, axpy(q, u, n))
            continue
        n = unit(x, n)
        t, u = orthogonal_pair(n)
        s = q = 0.0
        x = n
    s, q, tt, tu, uu = curvature
    n = unit(best[0], n)
    low = _least_curvature(s, q, tt, tu, uu) + dot(n, subtract(best[1], best[2]))
    return n, low, best[1], best[2]


@inlined_kernel
def _normal_on_circle(features, e, n, size):
    """Return (n, negated second derivative) where n is kept orthogonal to e."""
    feature_A, feature_B, core_A, core_B, R = features
    enough = ROUNDING_LEFT * EPSILON * size
    error = math.inf
    n = unit(axpy(-dot(n, e), e, n), any_orthogonal(e))
    best = n
    best_low = 0.0
    for _ in range(MAX_NEWTON):
        t = cross(e, n)
        a, A, _, _ = curved_support(feature_A, core_A, IDENTITY, scale(-1.0, n), t, t)
        b, B, _, _ = curved_support(feature_B, core_B, R, n, t, t)
        rest = subtract(a, b)
        g = dot(t, rest)
        h = A + B + dot(n, rest)
        if abs(g) < error:
            error = abs(g)
            best = n
            best_low = h
        elif error < HELD_UP * enough:
            break
        if abs(g) <= enough:
            break
        n = axpy(_newton_step(g, h, CURVATURE_FLOOR * size), t, n)
        n = unit(axpy(-dot(n, e), e, n), best)
    return best, best_low


@lean_kernel
def _are_parallel(feature_A, feature_B, m):
    """Return whether two lines have no common normal but rounding; m is e x f.

    The ends of a line are rounded as much as they are far from the origin, so the direction of a
    short line is known to fewer digits. Lines that are taken for parallel are so to that rounding.
    """
    a, b = feature_A[1], feature_B[1]
    short = min(feature_A[5], feature_B[5])
    long = max(feature_A[5], feature_B[5])
    reach = dot(a, a) + dot(b, b) + long * long
    return dot(m, m) * short * short <= PARALLEL_LINES * PARALLEL_LINES * reach


@lean_kernel
def _across_lines(e, f, m, n):
    """Return the unit vector across the lines e and f, on the side of n; m is e x f.

    A cross product of nearly parallel vectors is rounding by as much as it is short, also along
    them. The difference of such vectors is exact, and so what of it is across e leaves no more of
    the normal along either line than rounding.
    """
    if norm(m) < SMALL_ANGLE:
        w = subtract(f, scale(math.copysign(1.0, dot(e, f)), e))
        m = cross(e, unit(axpy(-dot(w, e), e, w), m))
    m = unit(m, n)
    return m if dot(m, n) > 0.0 else scale(-1.0, m)


@inlined_kernel
def _is_turning(feature):
    """Return whether a feature leaves the normal two degrees of freedom."""
    return feature[0] != FACE and feature[0] != LINE


@inlined_kernel
def _normal(features, n, size):
    """Return (n, stiffness) of two features, one of them a FACE or a LINE."""
    feature_A, feature_B = features.A, features.B
    if feature_A[0] == FACE:
        return scale(-1.0, feature_A[2]), math.inf
    if feature_B[0] == FACE:
        return feature_B[2], math.inf
    e = feature_A[2] if feature_A[0] == LINE else feature_B[2]
    if feature_A[0] == LINE and feature_B[0] == LINE:
        m = cross(e, feature_B[2])
        if not _are_parallel(feature_A, feature_B, m):
            return _across_lines(e, feature_B[2], m, n), math.inf
    return _normal_on_circle(features, e, n, size)


@inlined_kernel
def contact_of_features(features, n, a, b, size):
    """Return (n, stiffness, a, b): the stationary contact of two features near the unit vector n.

    ``stiffness`` is the smallest eigenvalue of the negated Hessian over the free directions (m):
    positive at a strict local maximum of phi, ``inf`` where the features leave no freedom. See
    ``_contact_points`` for the witnesses.
    """
    feature_A, feature_B = features.A, features.B
    if _is_turning(feature_A) and _is_turning(feature_B):
        return _on_sphere(features, n, size)
    n, stiffness = _normal(features, n, size)
    a, b = _contact_points(features, n, a, b)
    return n, stiffness, a, b


@lean_kernel
def _line_parameters(feature_A, feature_B, a, b):
    """Return where two lines through a and b come closest; mid of the overlap for parallels."""
    e, f = feature_A[2], feature_B[2]
    rest = subtract(b, a)
    cosine = dot(e, f)
    m = cross(e, f)
    if not _are_parallel(feature_A, feature_B, m):
        # The error of t along nearly parallel lines is large; s must have the same.
        t = dot(cross(rest, e), m) / dot(m, m)
        return dot(e, axpy(t, f, rest)), t
    start = dot(e, rest)
    sign = 1.0 if cosine > 0.0 else -1.0
    end = start + sign * feature_B[4]
    other = start + sign * feature_B[5]
    low = max(feature_A[4], min(end, other))
    high = min(feature_A[5], max(end, other))
    s = 0.5 * (low + high)
    return s, sign * (s - start)


@lean_kernel
def _on_face(face, line, b, near):
    """Return the point of a line along a face, b at s = 0, that is beside ``near``.

    Over a disc it is the middle of what the line shares with it: at a tangent no other is right,
    as the line leaves the disc quadratically.
    """
    e = line[2]
    if face[3] == 0.0:
        return axpy(dot(e, subtract(near, b)), e, b)
    q = subtract(b, face[1])
    q = axpy(-dot(q, face[2]), face[2], q)
    foot = -dot(q, e)
    nearest = norm(axpy(foot, e, q))
    half = math.sqrt(max((face[3] - nearest) * (face[3] + nearest), 0.0))
    return axpy(0.5 * (max(line[4], foot - half) + min(line[5], foot + half)), e, b)


@lean_kernel
def _middle_of_discs(face_A, face_B):
    """Return the middle of what two parallel discs share, on the line of their centres, in A's."""
    q = subtract(face_B[1], face_A[1])
    q = axpy(-dot(q, face_A[2]), face_A[2], q)
    length = norm(q)
    if not length > 0.0:
        return face_A[1]
    low, high = max(-face_A[3], length - face_B[3]), min(face_A[3], length + face_B[3])
    return axpy(0.5 * (low + high) / length, q, face_A[1])


@inlined_kernel
def _contact_points(features, n, a, b):
    """Return the witness points (a, b) of two features for their normal n.

    The a and b given are near: they are used where the features leave the points a choice (a line
    or a face on a polygon); on a disc, the middle of what is shared is taken. Nothing is clamped:
    the caller checks that the points lie on the bodies.
    """
    feature_A, feature_B, core_A, core_B, R = features
    flat_A, flat_B = feature_A[0] == FACE, feature_B[0] == FACE
    if flat_A and flat_B:
        if feature_A[3] > 0.0 and feature_B[3] > 0.0:
            b = _middle_of_discs(feature_B, feature_A)
    else:
        if not flat_A:
            near = a
            a = feature_support(feature_A, core_A, IDENTITY, scale(-1.0, n))
            if flat_B and feature_A[0] == LINE:
                a = _on_face(feature_B, feature_A, a, near)
        if not flat_B:
            near = b
            b = feature_support(feature_B, core_B, R, n)
            if flat_A and feature_B[0] == LINE:
                b = _on_face(feature_A, feature_B, b, near)
    if flat_A:
        return axpy(dot(n, subtract(feature_A[1], b)), n, b), b
    if flat_B:
        return a, axpy(dot(n, subtract(feature_B[1], a)), n, a)
    if feature_A[0] == LINE:
        if feature_B[0] == LINE:
            s, t = _line_parameters(feature_A, feature_B, a, b)
            return axpy(s, feature_A[2], a), axpy(t, feature_B[2], b)
        return axpy(dot(feature_A[2], subtract(b, a)), feature_A[2], a), b
    if feature_B[0] == LINE:
        return a, axpy(dot(feature_B[2], subtract(a, b)), feature_B[2], b)
    return a, b

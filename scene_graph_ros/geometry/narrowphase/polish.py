"""Exact contacts on known features, by Newton's method over the unit normal.

For features with support points a(-n) and b(n) the signed distance is the largest value over unit
vectors n of phi(n) = n . (a - b). Its gradient on the sphere is the part of a - b orthogonal to
n, its Hessian -(W_A + W_B + phi 1) with the features' radii of curvature W. That stays well
conditioned through touching (phi = 0), because n is an unknown and not a ratio of small numbers.
An edge or a cylinder's side forces n to be orthogonal to it, a face fixes n altogether.
"""

import math

from scene_graph_ros.geometry.jit import lean_kernel
from scene_graph_ros.geometry.narrowphase.cores import IDENTITY
from scene_graph_ros.geometry.narrowphase.features import (
    curvature,
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
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import EPSILON, PARALLEL_LINES

__all__ = ["MAX_NEWTON", "contact_normal", "contact_points"]

MAX_NEWTON = 24
"""Quadratic convergence takes four to six; the rest is for damped steps on needles."""

MAX_STEP = 0.5
"""Radians. A longer Newton step leaves the region that its second derivative describes."""

CURVATURE_FLOOR = 1e-12
"""Relative to the pair's size: a smaller second derivative does not fix the normal."""

SMALL_ANGLE = 0.1
"""Sine of an angle: the cross product of unit vectors this close to parallel loses a digit."""


@lean_kernel
def _newton_step(g, h, floor):
    """Return the step that ascends along one eigendirection, whatever the sign of h."""
    return max(-MAX_STEP, min(MAX_STEP, g / max(abs(h), floor)))


@lean_kernel
def _plane_step(g0, g1, h00, h01, h11, floor):
    """Return (step along t, along u, smallest eigenvalue) for the negated Hessian h.

    The eigenvalues enter by their magnitude, so the step ascends also at a saddle.
    """
    mean = 0.5 * (h00 + h11)
    half = 0.5 * (h00 - h11)
    radius = math.sqrt(half * half + h01 * h01)
    low, high = mean - radius, mean + radius
    if low > 1e-3 * high:
        determinant = h00 * h11 - h01 * h01
        s = (h11 * g0 - h01 * g1) / determinant
        q = (h00 * g1 - h01 * g0) / determinant
        length = math.sqrt(s * s + q * q)
        if length > MAX_STEP:
            s, q = s * MAX_STEP / length, q * MAX_STEP / length
        return s, q, low
    # Unit eigenvector of the larger eigenvalue, from the better conditioned of two formulas.
    c, s = half + radius, h01
    if half < 0.0:
        c, s = h01, radius - half
    length = math.sqrt(c * c + s * s)
    if length > 0.0:
        c, s = c / length, s / length
    else:
        c, s = 1.0, 0.0
    along = _newton_step(c * g0 + s * g1, high, floor)
    across = _newton_step(c * g1 - s * g0, low, floor)
    return c * along - s * across, s * along + c * across, low


@lean_kernel
def _normal_on_sphere(feature_A, feature_B, core_A, core_B, R, n, size):
    """Return (is converged, n, smallest eigenvalue of the negated Hessian)."""
    enough = EPSILON * size
    error = math.inf
    best = n
    low = 0.0
    best_low = 0.0
    for _ in range(MAX_NEWTON):
        d = scale(-1.0, n)
        rest = subtract(
            feature_support(feature_A, core_A, IDENTITY, d),
            feature_support(feature_B, core_B, R, n),
        )
        phi = dot(n, rest)
        t = any_orthogonal(n)
        u = cross(n, t)
        g0, g1 = dot(t, rest), dot(u, rest)
        A = curvature(feature_A, core_A, IDENTITY, d, t, u)
        B = curvature(feature_B, core_B, R, n, t, u)
        s, q, low = _plane_step(
            g0, g1, A[0] + B[0] + phi, A[1] + B[1], A[2] + B[2] + phi, CURVATURE_FLOOR * size
        )
        length = math.sqrt(g0 * g0 + g1 * g1)
        if length < error:
            error = length
            best = n
            best_low = low
        elif error < 1e3 * enough:
            break
        if length <= enough:
            break
        n = unit(axpy(s, t, axpy(q, u, n)), n)
    return best, best_low


@lean_kernel
def _normal_on_circle(feature_A, feature_B, core_A, core_B, R, e, n, size):
    """Return (n, negated second derivative) where n is kept orthogonal to e."""
    enough = EPSILON * size
    error = math.inf
    n = unit(axpy(-dot(n, e), e, n), any_orthogonal(e))
    best = n
    best_low = 0.0
    for _ in range(MAX_NEWTON):
        d = scale(-1.0, n)
        rest = subtract(
            feature_support(feature_A, core_A, IDENTITY, d),
            feature_support(feature_B, core_B, R, n),
        )
        t = cross(e, n)
        g = dot(t, rest)
        A = curvature(feature_A, core_A, IDENTITY, d, t, t)
        B = curvature(feature_B, core_B, R, n, t, t)
        h = A[0] + B[0] + dot(n, rest)
        if abs(g) < error:
            error = abs(g)
            best = n
            best_low = h
        elif error < 1e3 * enough:
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


@lean_kernel
def contact_normal(feature_A, feature_B, core_A, core_B, R, n, size):
    """Return (n, stiffness): the stationary normal of two features near the unit vector n.

    ``stiffness`` is the smallest eigenvalue of the negated Hessian over the free directions (m):
    positive at a strict local maximum of phi, ``inf`` where the features leave no freedom.
    """
    if feature_A[0] == FACE:
        return scale(-1.0, feature_A[2]), math.inf
    if feature_B[0] == FACE:
        return feature_B[2], math.inf
    if feature_A[0] == LINE:
        e = feature_A[2]
        if feature_B[0] == LINE:
            m = cross(e, feature_B[2])
            if not _are_parallel(feature_A, feature_B, m):
                return _across_lines(e, feature_B[2], m, n), math.inf
        return _normal_on_circle(feature_A, feature_B, core_A, core_B, R, e, n, size)
    if feature_B[0] == LINE:
        e = feature_B[2]
        return _normal_on_circle(feature_A, feature_B, core_A, core_B, R, e, n, size)
    return _normal_on_sphere(feature_A, feature_B, core_A, core_B, R, n, size)


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


@lean_kernel
def contact_points(feature_A, feature_B, core_A, core_B, R, n, a, b):
    """Return the witness points (a, b) of two features for their normal n.

    The a and b given are near: they are used where the features leave the points a choice (a line
    or a face on a polygon); on a disc, the middle of what is shared is taken. Nothing is clamped:
    the caller checks that the points lie on the bodies.
    """
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

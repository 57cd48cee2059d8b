"""Exact contacts on known features: their normal, and from it where they touch.

Vertices, rims and smooth surfaces leave the normal free, an edge or a cylinder's side forces it to
be orthogonal to it, a face fixes it altogether. A free normal is found by Newton's method
(``free_normal``). That stays well conditioned through touching, because the normal is an unknown
and not a ratio of small numbers.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.contact.free_normal import (
    normal_on_circle,
    normal_on_sphere,
)
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY
from scene_graph_ros.geometry.narrowphase.features import FACE, feature_support, LINE
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, norm, scale, subtract, unit
from scene_graph_ros.geometry.tolerances import PARALLEL_LINES

__all__ = ["contact_of_features"]

SMALL_ANGLE = 0.1
"""Sine of an angle: the cross product of unit vectors this close to parallel loses a digit."""


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
    them. The difference of such vectors is exact, and so its part across e leaves no more of
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
    return normal_on_circle(features, e, n, size)


@inlined_kernel
def contact_of_features(features, n, a, b, size):
    """Return (n, stiffness, a, b): the stationary contact of two features near the unit vector n.

    ``stiffness`` is the smallest eigenvalue of the negated Hessian over the free directions (m):
    positive at a strict local maximum of phi, ``inf`` where the features leave no freedom. See
    ``_contact_points`` for the witnesses.
    """
    feature_A, feature_B = features.A, features.B
    if _is_turning(feature_A) and _is_turning(feature_B):
        x, curvature = normal_on_sphere(features, n, size)
        n = unit(x, n)
        a = feature_support(feature_A, features.core_A, IDENTITY, scale(-1.0, x))
        b = feature_support(feature_B, features.core_B, features.R, x)
        return n, curvature + dot(n, subtract(a, b)), a, b
    n, stiffness = _normal(features, n, size)
    a, b = _contact_points(features, n, a, b)
    return n, stiffness, a, b


@lean_kernel
def _line_parameters(feature_A, feature_B, a, b):
    """Return the closest points of two lines through a and b; mid of the overlap for parallels."""
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

    Over a disc it is the middle of the line's part over it: at a tangent no other is right,
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
    """Return the middle of two parallel discs' overlap, on the line of their centres, in A's."""
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
    or a face on a polygon); on a disc, the middle of the overlap is taken. Nothing is clamped:
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

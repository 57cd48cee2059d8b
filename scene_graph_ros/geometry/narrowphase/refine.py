"""From a simplex of GJK or EPA to the exact contact: guess features, polish, check, switch.

A guess is accepted only with a certificate: the witness points lie on the cores, and their
difference is, up to rounding, the separation of both cores' support points along the normal. For
cores apart that proves the distance (it is an upper and a lower bound at once); for overlapping
ones it proves that the depth is stationary.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    IDENTITY,
    is_curved,
    ORIGIN,
    placed_support,
    support,
    TRIANGLE,
    triangle_corners,
)
from scene_graph_ros.geometry.narrowphase.features import (
    box_feature,
    cylinder_feature,
    FACE,
    feature_at,
    LINE,
    NONE,
    RIM,
    VERTEX,
)
from scene_graph_ros.geometry.narrowphase.polish import contact_of_features
from scene_graph_ros.geometry.narrowphase.slide import slide
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    column,
    cross,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import EPSILON, POLISH_RESIDUAL

__all__ = [
    "AMPLIFIED",
    "clamp",
    "contact",
    "refine",
    "refine_inlined",
    "separation",
    "separation_inlined",
]

MAX_SWITCHES = 8
"""A cylinder has three kinds of features and a box three; a path through them is this short."""


AMPLIFIED = 16.0
"""How much more than usual may be left of a contact when nothing better is found: a rim that is
seen foreshortened, or lines at a small angle, amplify rounding."""

SLIDE_REACH = 1e-6
"""Relative to the pair's size: witnesses of right features miss each other by less, as a rim seen
along its axis to 1e-10 rad amplifies rounding; more says that the features are wrong."""

INSIDE_CONE = 1e-3
"""Radians. A normal further than this from both ends of a rim's quarter turn is a rim's: another
feature must be what is wrong with a contact."""


@inlined_kernel
def separation_inlined(core_A, core_B, R, p, hulls, n):
    """Return the gap between A and B along n: a lower bound of their distance for every n."""
    a, _ = support(core_A, hulls, scale(-1.0, n), -1)
    b, _ = placed_support(core_B, hulls, R, p, n, -1)
    return dot(n, subtract(a, b))


@lean_kernel
def separation(core_A, core_B, R, p, hulls, n):
    """Do the same as ``separation_inlined``, as a call."""
    return separation_inlined(core_A, core_B, R, p, hulls, n)


@lean_kernel
def _clip(x, h):
    return max(-h, min(h, x))


@lean_kernel
def _clamp_to_triangle(o, u, v, a):
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


@lean_kernel
def _clamp_to_simplex(S, ids, count, side, a):
    """Do the same for the triangle of the core's corners in a simplex."""
    owner = side // 3 - 1
    i = 1
    while i < count and ids[i, owner] == ids[0, owner]:
        i += 1
    k = i + 1
    while k < count and (ids[k, owner] == ids[0, owner] or ids[k, owner] == ids[i, owner]):
        k += 1
    return _clamp_to_triangle(
        (S[0, side], S[0, side + 1], S[0, side + 2]),
        (S[i, side], S[i, side + 1], S[i, side + 2]),
        (S[k, side], S[k, side + 1], S[k, side + 2]),
        a,
    )


@inlined_kernel
def clamp(core, R, p, feature, S, ids, count, side, a):
    """Return the point a moved onto the feature's extent on the core."""
    kind = core[0]
    if feature[0] == VERTEX or kind == ELLIPSOID or feature[0] == RIM:
        return a
    if feature[0] == FACE and feature[4] > 0.0:  # its row is known: see all_features
        return a
    h = core[3]
    if kind == BOX:
        q = rotate_inverse(R, subtract(a, p))
        q = (_clip(q[0], h[0]), _clip(q[1], h[1]), _clip(q[2], h[2]))
        return add(rotate(R, q), p)
    if feature[0] == LINE:
        q = subtract(a, feature[1])
        s = dot(feature[2], q)
        return axpy(max(feature[4], min(feature[5], s)) - s, feature[2], a)
    if kind == CYLINDER:
        q = subtract(a, feature[1])
        radial = norm(q)
        return a if radial <= feature[3] else axpy(feature[3] / radial, q, feature[1])
    if kind == TRIANGLE:
        o, u, v = triangle_corners(core, R, p)
        return _clamp_to_triangle(o, u, v, a)
    return _clamp_to_simplex(S, ids, count, side, a)


@lean_kernel
def _switch_cylinder(core, R, p, feature, a, d, allowed):
    """Follow the contact around the edges of a cylinder's side and caps."""
    radius, half = core[3][0], core[3][1]
    axis = column(R, 2)
    along = dot(axis, subtract(a, p))
    slope = dot(axis, d)
    if feature[0] == LINE:
        if abs(along) > half:
            return cylinder_feature(core, R, p, RIM, along > 0.0)
        if abs(slope) * half > allowed:
            return cylinder_feature(core, R, p, RIM, slope > 0.0)
        return feature
    upper = dot(axis, feature[2]) > 0.0
    if feature[0] == FACE:
        tilt = cross(axis, d)
        if norm(subtract(a, feature[1])) > radius or norm(tilt) * radius > allowed:
            return cylinder_feature(core, R, p, RIM, upper)
        return feature
    # At the border of a rim's quarter turn, the contact is one of what lies beyond.
    if dot(d, feature[2]) < INSIDE_CONE:
        return cylinder_feature(core, R, p, LINE, upper)
    if norm(cross(axis, d)) < INSIDE_CONE:
        return cylinder_feature(core, R, p, FACE, upper)
    return feature


@lean_kernel
def _is_free(at, corner, slope, h, allowed):
    """Return whether a box's contact may move along one axis, given that coordinate of it.

    ``at``, ``corner`` and ``slope`` are that of the contact, the feature and the direction.
    """
    if abs(corner) < 0.5 * h:
        return abs(at) <= h and abs(slope) * h <= allowed
    return corner * slope < 0.0


@lean_kernel
def _switch_box(core, R, p, feature, a, d, allowed):
    """Free the coordinates whose side of the box faces away from d, fix those beyond the box."""
    h = core[3]
    q = rotate_inverse(R, subtract(a, p))
    c = rotate_inverse(R, subtract(feature[1], p))
    n = rotate_inverse(R, d)
    free_x = _is_free(q[0], c[0], n[0], h[0], allowed)
    free_y = _is_free(q[1], c[1], n[1], h[1], allowed)
    free_z = _is_free(q[2], c[2], n[2], h[2], allowed)
    # A coordinate inside the box that has become fixed goes to the side that faces along d.
    corner = (
        n[0] if abs(q[0]) <= h[0] else q[0],
        n[1] if abs(q[1]) <= h[1] else q[1],
        n[2] if abs(q[2]) <= h[2] else q[2],
    )
    return box_feature(core, R, p, free_x, free_y, free_z, corner)


@lean_kernel
def _switch_polytope(feature, a, d, furthest, allowed):
    """Go to an end of an edge, or along an edge to the corner ``furthest`` along d."""
    c = feature[1]
    if feature[0] == LINE:
        e, half = feature[2], feature[5]
        s = dot(e, subtract(a, c))
        slope = dot(e, d)
        if abs(s) > half:
            return VERTEX, axpy(math.copysign(half, s), e, c), ORIGIN, 0.0, 0.0, 0.0
        if abs(slope) * half > allowed:
            return VERTEX, axpy(math.copysign(half, slope), e, c), ORIGIN, 0.0, 0.0, 0.0
        return feature
    e = subtract(furthest, c)
    if feature[0] == FACE:
        if dot(e, d) > allowed or norm(cross(feature[2], d)) * norm(e) > allowed:
            return VERTEX, furthest, ORIGIN, 0.0, 0.0, 0.0
        return feature
    if dot(e, d) > allowed:
        half = 0.5 * norm(e)
        return LINE, axpy(0.5, e, c), unit(e, d), 0.0, -half, half
    return feature


@lean_kernel
def _switch(core, hulls, R, p, feature, a, d, allowed):
    """Return the neighboring feature that a rejected contact at a, outward d, points to."""
    if core[0] == CYLINDER:
        return _switch_cylinder(core, R, p, feature, a, d, allowed)
    if core[0] == BOX:
        return _switch_box(core, R, p, feature, a, d, allowed)
    if core[0] == ELLIPSOID:
        return feature
    furthest, _ = placed_support(core, hulls, R, p, d, -1)
    return _switch_polytope(feature, a, d, furthest, allowed)


@lean_kernel
def _corner_feature(core, hulls, R, p, feature, d):
    """Return the corner of a polytope that lies furthest along d; ``feature`` if it has none."""
    if is_curved(core):
        return feature
    corner, _ = placed_support(core, hulls, R, p, d, -1)
    return VERTEX, corner, ORIGIN, 0.0, 0.0, 0.0


@inlined_kernel
def contact_inlined(
    feature_A, feature_B, core_A, core_B, R, p, hulls, n, a, b, size, S, ids, count
):
    """Return (n, stiffness, free a, free b, a, b, distance, error) of two features' contact.

    The free points are those of the features before they are clamped to their extent.
    """
    n, stiffness, a_free, b_free = contact_of_features(
        feature_A, feature_B, core_A, core_B, R, n, a, b, size
    )
    distance = separation_inlined(core_A, core_B, R, p, hulls, n)
    a = clamp(core_A, IDENTITY, ORIGIN, feature_A, S, ids, count, 3, a_free)
    b = clamp(core_B, R, p, feature_B, S, ids, count, 6, b_free)
    error = norm(axpy(-distance, n, subtract(a, b)))
    enough = EPSILON * size
    if POLISH_RESIDUAL * enough < error <= SLIDE_REACH * size:
        a_free, b_free = slide(feature_A, feature_B, core_A, core_B, R, n, a_free, b_free, enough)
        q_A = clamp(core_A, IDENTITY, ORIGIN, feature_A, S, ids, count, 3, a_free)
        q_B = clamp(core_B, R, p, feature_B, S, ids, count, 6, b_free)
        rest = norm(axpy(-distance, n, subtract(q_A, q_B)))
        if rest < error:
            a, b, error = q_A, q_B, rest
    return n, stiffness, a_free, b_free, a, b, distance, error


@lean_kernel
def contact(feature_A, feature_B, core_A, core_B, R, p, hulls, n, a, b, size, S, ids, count):
    """Do the same as ``contact_inlined``, as a call."""
    return contact_inlined(
        feature_A, feature_B, core_A, core_B, R, p, hulls, n, a, b, size, S, ids, count
    )


@lean_kernel
def _unproven(nearly, n, a, b, highest, allowed):
    """Return what ``refine`` does without a proof, from the contact that came nearest to one."""
    error = norm(axpy(-highest, n, subtract(a, b)))
    if nearly[4] < error and nearly[3] >= highest - allowed:
        return False, nearly[0], nearly[1], nearly[2], nearly[3], nearly[4], nearly[5]
    return False, n, a, b, highest, error, 0.0


@inlined_kernel
def refine_inlined(core_A, core_B, R, p, hulls, n, a, b, size, S, ids, lam, count, guesses):
    """Return (is proven, n, a, b, distance, error, stiffness) of the contact near a simplex.

    n, a, b: the normal and the witness points known so far; without a proof a and b come back
    with that normal of all tried which separates the cores most, or as the contact that separates
    them as much and misses a proof by less. ``error`` bounds the distance's error (m) where the
    cores are apart; ``stiffness`` is that of ``polish``. The first guess are the features that
    the simplex spans; with two ``guesses`` then the corners of polytopes that lie furthest along
    the normal.
    """
    d = scale(-1.0, n)
    allowed = POLISH_RESIDUAL * EPSILON * size
    start = best = n
    highest = -math.inf
    nearly = (n, a, b, highest, math.inf, 0.0)
    for guess in range(guesses):
        feature_A = feature_at(core_A, IDENTITY, ORIGIN, S, ids, lam, count, 3, d)
        feature_B = feature_at(core_B, R, p, S, ids, lam, count, 6, n)
        if guess > 0:
            feature_A = _corner_feature(core_A, hulls, IDENTITY, ORIGIN, feature_A, d)
            feature_B = _corner_feature(core_B, hulls, R, p, feature_B, n)
        before_A, before_B = feature_A, feature_B
        for _ in range(MAX_SWITCHES):
            if feature_A[0] == NONE or feature_B[0] == NONE:
                break
            m, stiffness, a_free, b_free, q_A, q_B, distance, error = contact_inlined(
                feature_A, feature_B, core_A, core_B, R, p, hulls, n, a, b, size, S, ids, count
            )
            if error <= allowed:
                return True, m, q_A, q_B, distance, error, stiffness
            if highest == -math.inf:
                highest = separation(core_A, core_B, R, p, hulls, start)
            if error < nearly[4]:
                nearly = (m, q_A, q_B, distance, error, stiffness)
            if distance > highest:
                best, highest = m, distance
            next_A = _switch(
                core_A, hulls, IDENTITY, ORIGIN, feature_A, a_free, scale(-1.0, m), allowed
            )
            next_B = _switch(core_B, hulls, R, p, feature_B, b_free, m, allowed)
            is_same = next_A == feature_A and next_B == feature_B
            if is_same or (next_A == before_A and next_B == before_B):  # to and fro
                break
            before_A, before_B = feature_A, feature_B
            feature_A, feature_B = next_A, next_B
    if nearly[4] <= AMPLIFIED * allowed:
        return True, nearly[0], nearly[1], nearly[2], nearly[3], nearly[4], nearly[5]
    if highest == -math.inf:
        highest = separation(core_A, core_B, R, p, hulls, start)
    return _unproven(nearly, best, a, b, highest, allowed)


@lean_kernel
def refine(core_A, core_B, R, p, hulls, n, a, b, size, S, ids, lam, count, guesses):
    """Do the same as ``refine_inlined``, as a call."""
    return refine_inlined(core_A, core_B, R, p, hulls, n, a, b, size, S, ids, lam, count, guesses)

"""From a simplex of GJK or EPA to the exact contact: guess features, polish, check, switch.

A guess is accepted only with a certificate: the witness points lie on the cores, and their
difference is, up to rounding, the separation of both cores' support points along the normal. For
cores apart that proves the distance (it is an upper and a lower bound at once); for overlapping
ones it proves that the depth is stationary.
"""

from scene_graph_ros.geometry.jit import lean_kernel
from scene_graph_ros.geometry.narrowphase.cores import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    IDENTITY,
    ORIGIN,
    placed_support,
    SEGMENT,
    support,
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
from scene_graph_ros.geometry.narrowphase.polish import contact_normal, contact_points
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
)
from scene_graph_ros.geometry.tolerances import EPSILON, POLISH_RESIDUAL

__all__ = ["refine", "separation"]

MAX_SWITCHES = 5
"""A cylinder has three kinds of features and a box three; a path through them is this short."""


@lean_kernel
def separation(core_A, core_B, R, p, hulls, n):
    """Return the gap between A and B along n: a lower bound of their distance for every n."""
    a, _ = support(core_A, hulls, scale(-1.0, n), -1)
    b, _ = placed_support(core_B, hulls, R, p, n, -1)
    return dot(n, subtract(a, b))


@lean_kernel
def _clip(x, h):
    return max(-h, min(h, x))


@lean_kernel
def _clamp_to_triangle(S, ids, count, side, a):
    """Return a, or a corner of its simplex where a lies outside of the simplex' triangle."""
    owner = side // 3 - 1
    i = 1
    while i < count and ids[i, owner] == ids[0, owner]:
        i += 1
    k = i + 1
    while k < count and (ids[k, owner] == ids[0, owner] or ids[k, owner] == ids[i, owner]):
        k += 1
    o = (S[0, side], S[0, side + 1], S[0, side + 2])
    e = subtract((S[i, side], S[i, side + 1], S[i, side + 2]), o)
    f = subtract((S[k, side], S[k, side + 1], S[k, side + 2]), o)
    m = cross(e, f)
    q = subtract(a, o)
    mm = dot(m, m)
    u = dot(cross(q, f), m)
    v = dot(cross(e, q), m)
    slack = POLISH_RESIDUAL * EPSILON * mm
    if u < -slack or v < -slack or u + v > mm + slack:
        return o
    return a


@lean_kernel
def _clamp(core, R, p, feature, S, ids, count, side, a):
    """Return the point a moved onto the feature's extent on the core."""
    kind = core[0]
    if feature[0] == VERTEX or kind == ELLIPSOID or feature[0] == RIM:
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
    return _clamp_to_triangle(S, ids, count, side, a)


@lean_kernel
def _switch_cylinder(core, R, p, feature, a, d):
    axis = column(R, 2)
    along = dot(axis, subtract(a, p))
    if feature[0] == LINE:
        if abs(along) <= core[3][1]:
            return feature
        return cylinder_feature(core, R, p, RIM, along > 0.0)
    upper = dot(axis, feature[2]) > 0.0
    if feature[0] == FACE:
        if norm(subtract(a, feature[1])) <= core[3][0]:
            return feature
        return cylinder_feature(core, R, p, RIM, upper)
    if dot(d, feature[2]) < 0.0:
        return cylinder_feature(core, R, p, LINE, upper)
    return cylinder_feature(core, R, p, FACE, upper)


@lean_kernel
def _switch_box(core, R, p, feature, a, d):
    """Free the coordinates whose side of the box faces away from d, fix those beyond the box."""
    h = core[3]
    q = rotate_inverse(R, subtract(a, p))
    c = rotate_inverse(R, subtract(feature[1], p))
    q_d = rotate_inverse(R, d)
    free_x = abs(q[0]) <= h[0] if c[0] * c[0] < 0.25 * h[0] * h[0] else c[0] * q_d[0] < 0.0
    free_y = abs(q[1]) <= h[1] if c[1] * c[1] < 0.25 * h[1] * h[1] else c[1] * q_d[1] < 0.0
    free_z = abs(q[2]) <= h[2] if c[2] * c[2] < 0.25 * h[2] * h[2] else c[2] * q_d[2] < 0.0
    return box_feature(core, R, p, free_x, free_y, free_z, q)


@lean_kernel
def _switch(core, R, p, feature, a, d):
    """Return the neighboring feature that a rejected contact at a, outward d, points to."""
    if core[0] == CYLINDER:
        return _switch_cylinder(core, R, p, feature, a, d)
    if core[0] == BOX:
        return _switch_box(core, R, p, feature, a, d)
    if feature[0] == LINE:
        s = dot(feature[2], subtract(a, feature[1]))
        if s < feature[4] or s > feature[5]:
            end = axpy(feature[5] if s > 0.0 else feature[4], feature[2], feature[1])
            return VERTEX, end, ORIGIN, 0.0, 0.0, 0.0
    elif feature[0] == VERTEX and core[0] == SEGMENT:
        return LINE, p, column(R, 2), 0.0, -core[3][0], core[3][0]
    return feature


@lean_kernel
def refine(core_A, core_B, R, p, hulls, n, a, b, size, S, ids, lam, count):
    """Return (is proven, n, a, b, distance, error, stiffness) of the contact near a simplex.

    n, a, b: the normal and the witness points known so far; without a proof a and b come back
    with that normal of all tried which separates the cores most. ``error`` bounds the distance's
    error (m) where the cores are apart; ``stiffness`` is that of ``polish.contact_normal``.
    """
    d = scale(-1.0, n)
    feature_A = feature_at(core_A, IDENTITY, ORIGIN, S, ids, lam, count, 3, d)
    feature_B = feature_at(core_B, R, p, S, ids, lam, count, 6, n)
    allowed = POLISH_RESIDUAL * EPSILON * size
    best = n
    highest = separation(core_A, core_B, R, p, hulls, n)
    for _ in range(MAX_SWITCHES):
        if feature_A[0] == NONE or feature_B[0] == NONE:
            break
        m, stiffness = contact_normal(feature_A, feature_B, core_A, core_B, R, n, size)
        a_free, b_free = contact_points(feature_A, feature_B, core_A, core_B, R, m, a, b)
        q_A = _clamp(core_A, IDENTITY, ORIGIN, feature_A, S, ids, count, 3, a_free)
        q_B = _clamp(core_B, R, p, feature_B, S, ids, count, 6, b_free)
        distance = separation(core_A, core_B, R, p, hulls, m)
        error = norm(axpy(-distance, m, subtract(q_A, q_B)))
        if error <= allowed:
            return True, m, q_A, q_B, distance, error, stiffness
        if distance > highest:
            best, highest = m, distance
        next_A = _switch(core_A, IDENTITY, ORIGIN, feature_A, a_free, scale(-1.0, m))
        next_B = _switch(core_B, R, p, feature_B, b_free, m)
        if next_A == feature_A and next_B == feature_B:
            break
        feature_A, feature_B = next_A, next_B
    error = norm(axpy(-highest, best, subtract(a, b)))
    return False, best, a, b, highest, error, 0.0

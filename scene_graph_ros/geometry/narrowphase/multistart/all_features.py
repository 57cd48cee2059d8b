"""Multi-start over features: every pair of features that two cores could touch by is solved.

Where many features nearly tie, as in nearly coaxial cylinders, neither a simplex nor a rejected
contact tells which pair it is. There are few: each is polished, and of those that prove
themselves the one that separates the cores most is taken.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.contact.hull_border import edge_before, is_beyond_face
from scene_graph_ros.geometry.narrowphase.contact.refine import AMPLIFIED, contact, separation
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY
from scene_graph_ros.geometry.narrowphase.cores.questions import candidate, clamp
from scene_graph_ros.geometry.narrowphase.features import (
    curved_support,
    feature_support,
    NONE,
    RIM,
    SMOOTH,
)
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.multistart.nearest_places import nearest_places
from scene_graph_ros.geometry.narrowphase.pair import (
    A_SIDE,
    B_SIDE,
    body_A,
    body_B,
    Contact,
    Features,
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
from scene_graph_ros.geometry.tolerances import EPSILON, NEAR_CONTACT, POLISH_RESIDUAL

__all__ = ["contact_of_all_features"]

_ALL_FEATURES = int(Mechanism.ALL_FEATURES)
_NEAREST_PLACES = int(Mechanism.NEAREST_PLACES)
_BESIDE_AXIS = int(Mechanism.BESIDE_AXIS)

CANDIDATES = 10
"""A box has a corner, three edges and three faces along a direction; the simplex gives one. Of a
hull's corner, the first edges are tried."""

AXIS_STEPS = 96
"""Steps that first multiply and then halve a bracket of numbers of any size."""

ROUNDS = 3
"""Directions that all features are tried from."""


@lean_kernel
def _has_places(feature_A, feature_B):
    """Return whether both features are corners, lines or rims."""
    return feature_A[0] <= RIM and feature_B[0] <= RIM


@lean_kernel
def _crossing(feature_A, feature_B, start):
    """Return a crossing of two discs' rims, one above the other, seen along A's axis.

    ``start`` is 1 or -1, as there are two; (is found, the point of A's rim).
    """
    c, e, r = feature_A[1], feature_A[2], feature_A[3]
    q = subtract(feature_B[1], c)
    q = axpy(-dot(q, e), e, q)
    length = norm(q)
    if not length > 0.0:
        return False, c
    along = 0.5 * (length + (r - feature_B[3]) * (r + feature_B[3]) / length)
    square = (r - along) * (r + along)
    if not square > 0.0:
        return False, c
    q = scale(1.0 / length, q)
    return True, axpy(along, q, axpy(start * math.sqrt(square), cross(e, q), c))


@lean_kernel
def _contact_of_places(features, pair, n, a, b, size, simplex):
    """Return the contact of corners, lines or rims that are apart.

    Discs at a tiny angle touch where their rims cross, far from wherever GJK has come.
    """
    best = Contact(n, a, b, 0.0, math.inf, math.inf)
    for start in range(-1, 2):
        x, y = a, b
        if start != 0:
            if not (features.A[0] == RIM and features.B[0] == RIM):
                continue
            found, x = _crossing(features.A, features.B, start)
            y = x
            if not found:
                continue
        m, x, y = nearest_places(features, n, x, y, size)
        x = clamp(body_A(pair), features.A, simplex, A_SIDE, x)
        y = clamp(body_B(pair), features.B, simplex, B_SIDE, y)
        distance = separation(pair, m)
        error = norm(axpy(-distance, m, subtract(x, y)))
        if error < best.error:
            best = Contact(m, x, y, distance, error, math.inf)
    return best


@lean_kernel
def _beside_axis(k00, k01, k11, g0, g1, radius):
    """Return (is found, x, y): v = (x, y) with (K + s) v = g and s |v| = radius, K + s positive.

    s |v| grows with s, up to |g|.
    """
    half = 0.5 * (k00 - k11)
    low = max(math.sqrt(half * half + k01 * k01) - 0.5 * (k00 + k11), 0.0)
    high = low + radius
    x = y = 0.0
    is_bracketed = False
    for _ in range(AXIS_STEPS):
        s = 0.5 * (low + high) if is_bracketed else high
        determinant = (k00 + s) * (k11 + s) - k01 * k01
        x = ((k11 + s) * g0 - k01 * g1) / determinant
        y = ((k00 + s) * g1 - k01 * g0) / determinant
        if s * math.sqrt(x * x + y * y) > radius:
            high, is_bracketed = s, True
        elif is_bracketed:
            low = s
        else:
            low, high = s, 4.0 * high
    return is_bracketed, x, y


@lean_kernel
def _from_axis(features, n):
    """Return (is found, a normal beside a rim's axis at which it touches a smooth feature there).

    That is an ellipsoid, or another rim. Along its axis a rim has no support point, so no step
    leads away from there. Next to it the gap along n + v is, to second order, that along n plus
    g . v - r |v| - v . K v / 2, with r the rim's radius; the v of its maximum solves
    (K + s) v = g, where s |v| = r.
    """
    feature_A, feature_B, core_A, core_B, R = features
    is_A = feature_A[0] == RIM
    if is_A and feature_B[0] == RIM:
        is_A = abs(dot(n, feature_A[2])) >= abs(dot(n, feature_B[2]))
    rim, other, core = feature_B, feature_A, core_A
    if is_A:
        rim, other, core = feature_A, feature_B, core_B
    if rim[0] != RIM or not (other[0] == SMOOTH or other[0] == RIM):
        return False, n
    d = scale(-1.0, rim[2])
    n = d if is_A else rim[2]
    R_other = R if is_A else IDENTITY
    rest = subtract(rim[1], feature_support(other, core, R_other, d))
    if not is_A:
        rest = scale(-1.0, rest)
    t = any_orthogonal(n)
    u = cross(n, t)
    g0, g1 = dot(t, rest), dot(u, rest)
    if not g0 * g0 + g1 * g1 > rim[3] * rim[3]:
        return False, n
    _, k00, k01, k11 = curved_support(other, core, R_other, d, t, u)
    phi = dot(n, rest)
    k00, k11 = k00 + phi, k11 + phi
    is_found, x, y = _beside_axis(k00, k01, k11, g0, g1, rim[3])
    return is_found, unit(axpy(x, t, axpy(y, u, n)), n)


@lean_kernel
def _contact_and_how(features, pair, n, a, b, size, simplex, allowed):
    """Return (contact, by) of two features: over normals, places, or from beside a rim's axis."""
    by = _ALL_FEATURES
    found = contact(features.A, features.B, pair, n, a, b, size, simplex)
    is_apart = found.distance > NEAR_CONTACT * size
    if found.error > allowed and is_apart and _has_places(features.A, features.B):
        by = _NEAREST_PLACES
        found = _contact_of_places(features, pair, n, a, b, size, simplex)
    is_found, start = False, n
    if found.error > allowed:
        is_found, start = _from_axis(features, n)
    if is_found:
        by = _BESIDE_AXIS
        found = contact(features.A, features.B, pair, start, a, b, size, simplex)
    return found, by


@lean_kernel
def _polish_from(pair, n, a, b, size, simplex):
    """Do the same as ``contact_of_all_features`` from one direction; return also the best."""
    A, B, hulls = body_A(pair), body_B(pair), pair.hulls
    allowed = AMPLIFIED * POLISH_RESIDUAL * EPSILON * size
    proven, decided_by = False, _ALL_FEATURES
    best, x, y, highest = n, a, b, separation(pair, n) - allowed
    ahead, furthest = n, highest + allowed
    d = scale(-1.0, n)
    for i in range(CANDIDATES):
        feature_A = candidate(A, hulls, simplex, A_SIDE, d, i)
        if feature_A[0] == NONE:
            continue
        for j in range(CANDIDATES):
            feature_B = candidate(B, hulls, simplex, B_SIDE, n, j)
            if feature_B[0] == NONE:
                continue
            features = Features(feature_A, feature_B, pair.core_A, pair.core_B, pair.R)
            found, how = _contact_and_how(features, pair, n, a, b, size, simplex, allowed)
            if found.distance > furthest:
                ahead, furthest = found.n, found.distance
            edge_A = edge_before(A, hulls, feature_A, found.a, allowed)
            edge_B = edge_before(B, hulls, feature_B, found.b, allowed)
            if edge_A[0] != feature_A[0] or edge_B[0] != feature_B[0]:
                how = _ALL_FEATURES
                found = contact(edge_A, edge_B, pair, n, a, b, size, simplex)
                if is_beyond_face(A, hulls, edge_A, found.a, allowed) or is_beyond_face(
                    B, hulls, edge_B, found.b, allowed
                ):
                    continue
            if found.distance >= highest and found.error <= allowed:
                proven, best, x, y, highest = True, found.n, found.a, found.b, found.distance
                decided_by = how
    return proven, best, x, y, highest, ahead, decided_by


@lean_kernel
def contact_of_all_features(pair, n, a, b, size, simplex):
    """Return (is proven, n, a, b, distance, by) of the contact that separates two cores most.

    Starts from the normal n and the witnesses a, b. The right edges may be those of other
    corners, where faces are nearly parallel: without a proof, it starts again from the direction
    of all tried that separates the cores most.
    """
    m = n
    for _ in range(ROUNDS):
        proven, best, x, y, highest, ahead, decided_by = _polish_from(pair, m, a, b, size, simplex)
        if proven or (ahead[0] == m[0] and ahead[1] == m[1] and ahead[2] == m[2]):
            break
        m = ahead
    return proven, best, x, y, highest, decided_by

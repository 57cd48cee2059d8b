"""A contact of two cores in short: by a look at all features, or by lifting one off the other.

Overlapping polytopes and cylinders have few directions in which they can be least deep, and these
are all visited (``other_depths``). Other cores are lifted apart, to see where they part.

Moved apart along a direction, overlapping cores have a distance, and GJK finds it in a few steps
since it is not small. The features nearest then are most often those of least depth, and the same
for cores that are apart by little. They are polished at the true poses, and the result is taken
only with a proof: the polish' own where the cores are apart, that of ``inner_ball``, of
``covering`` or of ``other_depths`` where they overlap. Where ``covering`` finds a direction that
is less deep, they are lifted along that. All else is left to GJK and EPA at the true poses.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY, ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.questions import (
    edge_count,
    has_plane_across,
    is_curved,
    is_listed,
    is_simple,
    placed_support,
    plane_count,
    plane_of,
    side,
    support,
)
from scene_graph_ros.geometry.narrowphase.covering import look_everywhere
from scene_graph_ros.geometry.narrowphase.features import NONE
from scene_graph_ros.geometry.narrowphase.gjk import CONVERGED, FAR, gjk_inlined, OVERLAP
from scene_graph_ros.geometry.narrowphase.inner_ball import is_least_depth
from scene_graph_ros.geometry.narrowphase.known_features import contact_of_known
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.other_depths import (
    are_polytopes_or_cylinders,
    LESS,
    look_for_less,
    NONE_LESS,
    UNDECIDED,
)
from scene_graph_ros.geometry.narrowphase.refine import (
    refine_inlined,
    separation,
    separation_inlined,
)
from scene_graph_ros.geometry.narrowphase.simplex import simplex_normal, weighted_points
from scene_graph_ros.geometry.spatial.vectors import (
    axpy,
    column,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    transpose,
    unit,
)
from scene_graph_ros.geometry.tolerances import (
    EPSILON,
    FLAT_MINIMUM,
    GJK_ROUNDING,
    POLISH_RESIDUAL,
    TIE,
)

__all__ = ["NO_ANSWER", "lifted_contact"]

_OPEN = int(Mechanism.OPEN)
_SEPARATED = int(Mechanism.SEPARATED)
_GJK = int(Mechanism.GJK)
_LIFTED = int(Mechanism.LIFTED)
_CRITICAL_DIRECTIONS = int(Mechanism.CRITICAL_DIRECTIONS)
_INNER_BALL = int(Mechanism.INNER_BALL)
_COVER = int(Mechanism.COVER)

NO_ANSWER = (_OPEN, 0.0, ORIGIN, ORIGIN, ORIGIN, math.inf)
"""What ``lifted_contact`` returns where it is not tried."""

LIFT = 0.5
"""How far cores are moved apart, relative to the distance of their origins or to their depth."""

LIFTS = 4
"""Where a contact is not exact, cores are lifted once more, along the normal it found; and along
each direction that is found to be less deep."""

FIRST_GUESS = 0.05
"""Relative gap at which the lifted cores' distance tells well enough which features are near."""

NEXT_GUESS = FIRST_GUESS * FIRST_GUESS
"""The same where it did not, or from a direction that is less deep."""


@inlined_kernel
def _try(core_A, core_B, R, p, hulls, n, distance, best):
    """Return the larger of the known separation and that along the line of n, and its normal."""
    if dot(n, p) > 0.0:
        n = scale(-1.0, n)
    along = separation_inlined(core_A, core_B, R, p, hulls, n)
    return (along, n) if along > distance else (distance, best)


@inlined_kernel
def _try_faces(core_A, core_B, R, p, hulls, distance, best):
    """Return the larger of the known separation and those along the normals of A's faces."""
    for k in range(plane_count(core_A, hulls)):
        out, offset = plane_of(core_A, hulls, k)
        if dot(out, p) > 0.0:  # the others face away from B
            b, _ = placed_support(core_B, hulls, R, p, scale(-1.0, out), -1)
            along = dot(out, b) - offset
            if along > distance:
                distance, best = along, scale(-1.0, out)
    return distance, best


@inlined_kernel
def _across_cylinder(core_B, R, p):
    """Return the direction across the axis of a cylinder A in which a curved B may leave it."""
    if side(core_B, R, p)[0] != NONE:
        axis = column(R, 2)
        return unit((-axis[1], axis[0], 0.0), (1.0, 0.0, 0.0))
    return unit((-p[0], -p[1], 0.0), (1.0, 0.0, 0.0))


@inlined_kernel
def _first_direction(core_A, core_B, R, p, hulls):
    """Return (separation, n) of the best of the line of origins and the normals of planes."""
    n = unit(scale(-1.0, p), (1.0, 0.0, 0.0))
    distance = separation_inlined(core_A, core_B, R, p, hulls, n)
    if is_listed(core_A) and distance < 0.0:
        distance, n = _try_faces(core_A, core_B, R, p, hulls, distance, n)
    if is_listed(core_B) and distance < 0.0:
        q = scale(-1.0, rotate_inverse(R, p))
        m = rotate_inverse(R, scale(-1.0, n))
        distance, m = _try_faces(core_B, core_A, transpose(R), q, hulls, distance, m)
        n = rotate(R, scale(-1.0, m))
    for k in range(3):
        if has_plane_across(core_A, k):
            axis = column(IDENTITY, k)
            distance, n = _try(core_A, core_B, R, p, hulls, axis, distance, n)
        if has_plane_across(core_B, k):
            axis = column(R, k)
            distance, n = _try(core_A, core_B, R, p, hulls, axis, distance, n)
    if side(core_A, IDENTITY, ORIGIN)[0] != NONE and is_curved(core_B):
        across = _across_cylinder(core_B, R, p)
        distance, n = _try(core_A, core_B, R, p, hulls, across, distance, n)
    return distance, n


@inlined_kernel
def _lift(core_A, core_B, R, p, hulls, n, distance, guess, S, ids, lam):
    """Return (rows in the simplex, its closest point, the separation along it, size).

    All at true poses; no rows: no answer, and a separation of -inf: it is not known.
    """
    height = LIFT * max(norm(p), abs(distance))
    shift = max(height - distance, 0.0)
    status, count, v, lower, size = gjk_inlined(
        core_A,
        core_B,
        R,
        axpy(-shift, n, p),
        hulls,
        scale(height, n),
        0,
        math.inf,
        guess if is_curved(core_A) or is_curved(core_B) else 0.0,
        0.0,
        S,
        ids,
        lam,
    )
    if status == OVERLAP:
        return 0, v, -math.inf, size
    for i in range(count):
        for c in range(3):
            S[i, c] -= shift * n[c]
            S[i, 6 + c] += shift * n[c]
    along = lower - shift * dot(n, unit(v, n)) if status == CONVERGED else -math.inf
    return count, v, along, size


@inlined_kernel
def _searched(core_A, core_B, R, p, hulls, n, distance, S, ids):
    """Return (is proven, n, a, b, distance, error) of the least depth of all directions.

    n: one that is not much deeper, which saves most of the others. Without a proof, n and the
    distance along it are the best found.
    """
    a, _ = support(core_A, hulls, scale(-1.0, n), -1)
    b, _ = placed_support(core_B, hulls, R, p, n, -1)
    size = norm(a) + norm(b) + norm(p)
    known = scale(0.0, n)
    depth = (1.0 + TIE * EPSILON) * (TIE * EPSILON * size - distance)
    verdict, m, where, index = look_for_less(
        core_A, core_B, R, p, hulls, a, b, known, depth, size, S
    )
    if verdict == LESS:
        n = m
        distance = separation_inlined(core_A, core_B, R, p, hulls, n)
        if distance < 0.0:  # or else they are apart, and the search ended there
            proven, m, a, b, found, error, stiffness = contact_of_known(
                core_A, core_B, R, p, hulls, n, where, index, size, S, ids
            )
            if proven and found < 0.0 and stiffness >= FLAT_MINIMUM * size:
                return True, m, a, b, found, error
    return False, n, a, b, distance, math.inf


@inlined_kernel
def _others(core_A, core_B, R, p, hulls, a, b, n, depth, size, S):
    """Return (verdict, m) as ``look_everywhere`` does for a stationary depth, and by what."""
    if is_least_depth(core_A, core_B, R, p, hulls, a, b, n, depth, size):
        return NONE_LESS, n, _INNER_BALL
    if are_polytopes_or_cylinders(core_A, core_B, hulls):
        return UNDECIDED, n, _OPEN  # all was visited before, in vain
    verdict, m = look_everywhere(core_A, core_B, R, p, hulls, a, b, n, depth, size, S)
    decided_by = _COVER
    if verdict == UNDECIDED and (edge_count(core_A, hulls) > 0 or edge_count(core_B, hulls) > 0):
        verdict, m, _, _ = look_for_less(core_A, core_B, R, p, hulls, a, b, n, depth, size, S)
        decided_by = _CRITICAL_DIRECTIONS
    return verdict, m, decided_by


@inlined_kernel
def _lifted(core_A, core_B, R, p, hulls, limit, n, distance, S, ids, lam):
    """Do the same as ``lifted_contact`` by lifting, first along n, ``distance`` being along it."""
    a = b = (0.0, 0.0, 0.0)
    guess = FIRST_GUESS
    for _ in range(LIFTS):
        count, v, along, size = _lift(core_A, core_B, R, p, hulls, n, distance, guess, S, ids, lam)
        if count == 0:
            break
        a, b = weighted_points(S, lam, count)
        n = unit(v, n)
        if along > limit:
            return _SEPARATED, along, a, b, n, math.inf
        proven, n, a, b, distance, error, stiffness = refine_inlined(
            core_A, core_B, R, p, hulls, n, a, b, size, S, ids, lam, count, 1
        )
        guess = NEXT_GUESS
        if not proven:
            continue
        if distance >= 0.0:
            return _LIFTED, distance, a, b, n, error
        if stiffness < FLAT_MINIMUM * size:
            break
        verdict, m, decided_by = _others(core_A, core_B, R, p, hulls, a, b, n, -distance, size, S)
        if verdict == NONE_LESS:
            return decided_by, distance, a, b, n, error
        if verdict != LESS:
            break
        n = m
        distance = separation(core_A, core_B, R, p, hulls, n)
    return _OPEN, distance, a, b, n, math.inf


@inlined_kernel
def _apart_polytopes(core_A, core_B, R, p, hulls, limit, n, distance, S, ids, lam):
    """Do the same as ``lifted_contact`` for polytopes that are ``distance`` > 0 apart along n.

    Nothing needs to be polished: GJK's last simplex is exact, unless it is so slender that its
    weights and its nearest point tell different witnesses.
    """
    status, count, v, lower, size = gjk_inlined(
        core_A, core_B, R, p, hulls, scale(distance, n), 0, limit, 0.0, 0.0, S, ids, lam
    )
    n = simplex_normal(S, count, v)
    a, b = weighted_points(S, lam, count)
    if status == FAR:
        return _SEPARATED, lower, a, b, n, math.inf
    distance = norm(v)
    error = distance - lower
    misfit = norm(axpy(-distance, n, subtract(a, b)))
    if (
        status == OVERLAP
        or error > GJK_ROUNDING * EPSILON * size
        or misfit > POLISH_RESIDUAL * EPSILON * size
    ):
        return _OPEN, distance, a, b, n, math.inf
    return _GJK, distance, a, b, n, error


@inlined_kernel
def lifted_contact(core_A, core_B, R, p, hulls, limit, S, ids, lam):
    """Return (decided by, distance, a, b, n, error) of two cores, where that is soon proven.

    What decided is a ``Mechanism``. ``SEPARATED``: the cores are ``distance`` > ``limit`` apart
    along n, or more in other directions. ``OPEN``: no more is known than before. Any other: the
    distance is exact to ``error`` (m) and the normal unique.
    """
    a = b = (0.0, 0.0, 0.0)
    if not (is_simple(core_A, hulls) and is_simple(core_B, hulls)):
        return _OPEN, 0.0, a, b, a, math.inf
    distance, n = _first_direction(core_A, core_B, R, p, hulls)
    if distance < 0.0 and are_polytopes_or_cylinders(core_A, core_B, hulls):
        proven, n, a, b, distance, error = _searched(
            core_A, core_B, R, p, hulls, n, distance, S, ids
        )
        if proven:
            return _CRITICAL_DIRECTIONS, distance, a, b, n, error
    if distance > limit:
        return _SEPARATED, distance, a, b, n, math.inf
    if distance > 0.0 and not (is_curved(core_A) or is_curved(core_B)):
        return _apart_polytopes(core_A, core_B, R, p, hulls, limit, n, distance, S, ids, lam)
    return _lifted(core_A, core_B, R, p, hulls, limit, n, distance, S, ids, lam)

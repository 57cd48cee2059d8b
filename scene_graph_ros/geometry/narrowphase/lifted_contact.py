"""Fast path: propose a contact, refine it, and return it only with a proof.

Overlapping polytopes and cylinders have few directions in which they can be least deep, and these
are all visited (``critical_directions``). Other cores are lifted apart, to see where they part.

Moved apart along a direction, overlapping cores have a distance, and GJK finds it in a few steps
since it is not small. The features nearest then are most often those of least depth, and the same
for cores that are apart by little. They are polished at the true poses, and the result is taken
only with a proof: both bounds where the cores are apart, that of ``inner_ball``, ``cover`` or
``critical_directions`` where they overlap. Where ``cover`` finds a direction that is less deep,
they are lifted along that. All else is left to GJK and EPA at the true poses.
"""

import math
from typing import NamedTuple

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import any_of, every, LANES, select
from scene_graph_ros.geometry.narrowphase.contact.contact_of_known import contact_of_known
from scene_graph_ros.geometry.narrowphase.contact.refine import (
    refine_inlined,
    separation_inlined,
)
from scene_graph_ros.geometry.narrowphase.cores.kinds import CORNERS_OF_ELLIPSOID, ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.questions import (
    corner_ways,
    edge_count,
    is_curved,
    is_listed,
    is_simple,
    lane_planes,
    lane_support,
    placed_support,
    plane_count,
    side,
    support,
)
from scene_graph_ros.geometry.narrowphase.features import NONE
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.pair import (
    body_A,
    body_B,
    Contact,
    Pair,
    Simplex,
    swapped,
    Vector,
)
from scene_graph_ros.geometry.narrowphase.propose.gjk import CONVERGED, FAR, gjk_inlined, OVERLAP
from scene_graph_ros.geometry.narrowphase.propose.simplex import simplex_normal, weighted_points
from scene_graph_ros.geometry.narrowphase.prove.cover import cover
from scene_graph_ros.geometry.narrowphase.prove.critical_directions import (
    are_polytopes_or_cylinders,
    least_depth,
    LESS,
    NONE_LESS,
    UNDECIDED,
)
from scene_graph_ros.geometry.narrowphase.prove.inner_ball import is_least_depth
from scene_graph_ros.geometry.spatial.vectors import (
    axpy,
    column,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tables.vertex_scan import lane_of_largest
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

SMOOTH_GUESS, FIRST_GUESS = 0.1, 0.02
"""Relative gaps at which the lifted cores' distance tells well enough which features are near:
with an ellipsoid, and without."""

NEXT_GUESS = 0.0025
"""The same where it did not, or from a direction that is less deep."""


class Direction(NamedTuple):
    """A unit normal n, the support points along it, which they are, and how far apart (m)."""

    distance: float
    n: Vector
    a: Vector
    b: Vector
    index_A: int
    index_B: int


@inlined_kernel
def _along_inlined(pair, n):
    """Return a Direction: how far A and B are apart along n, and where."""
    a, index_A = support(pair.core_A, pair.hulls, scale(-1.0, n))
    b, index_B = placed_support(body_B(pair), pair.hulls, n)
    return Direction(dot(n, subtract(a, b)), n, a, b, index_A, index_B)


@lean_kernel
def _along(pair, n):
    """Do the same as ``_along_inlined``, as a call."""
    return _along_inlined(pair, n)


@inlined_kernel
def _try(pair, n, best):
    """Return the direction with the larger separation: the best so far, or the line of n."""
    if dot(n, pair.p) > 0.0:
        n = scale(-1.0, n)
    found = _along_inlined(pair, n)
    return found if found.distance > best.distance else best


@inlined_kernel
def _try_planes(pair, distance, n):
    """Return the largest of the known separation and those across A's planes, and its normal."""
    for first in range(0, plane_count(pair.core_A, pair.hulls), LANES):
        out, offset = lane_planes(pair.core_A, pair.hulls, first)
        d = rotate_inverse(pair.R, scale(-1.0, out))
        along = dot(out, pair.p) - dot(d, lane_support(pair.core_B, pair.hulls, d)) - offset
        if any_of(along > distance):
            k = lane_of_largest(select(along > distance, along, every(-math.inf)))
            distance, n = along[k], (-out[0][k], -out[1][k], -out[2][k])
    return distance, n


@inlined_kernel
def _across_cylinder(pair):
    """Return the direction across the axis of a cylinder A in which a curved B may leave it."""
    p = pair.p
    if side(body_B(pair))[0] != NONE:
        axis = column(pair.R, 2)
        return unit((-axis[1], axis[0], 0.0), (1.0, 0.0, 0.0))
    return unit((-p[0], -p[1], 0.0), (1.0, 0.0, 0.0))


@inlined_kernel
def _first_direction(pair):
    """Return the best Direction of the line of origins and the normals of planes."""
    core_A, core_B, R, p, hulls = pair
    best = _along_inlined(pair, unit(scale(-1.0, p), (1.0, 0.0, 0.0)))
    distance, n = best.distance, best.n
    if plane_count(core_A, hulls) > 0 and not (is_listed(core_A) and distance >= 0.0):
        distance, n = _try_planes(pair, distance, n)
    if plane_count(core_B, hulls) > 0 and not (is_listed(core_B) and distance >= 0.0):
        along, m = _try_planes(swapped(pair), distance, n)
        if along > distance:
            distance, n = along, rotate(R, scale(-1.0, m))
    if distance > best.distance:
        best = _along(pair, n)
    if side(body_A(pair))[0] != NONE and is_curved(core_B):
        best = _try(pair, _across_cylinder(pair), best)
    return best


@inlined_kernel
def _begin(first, shift, work):
    """Write the support points of a Direction, moved apart by ``shift``, into the first row.

    Return the point of C that they are.
    """
    S, n = work.S, first.n
    b = axpy(-shift, n, first.b)
    w = subtract(first.a, b)
    for c in range(3):
        S[0, c] = w[c]
        S[0, 3 + c] = first.a[c]
        S[0, 6 + c] = b[c]
    work.ids[0, 0], work.ids[0, 1] = first.index_A, first.index_B
    work.lam[0] = 1.0
    return w


@inlined_kernel
def _is_smooth(core, hulls):
    return corner_ways(core, hulls) == CORNERS_OF_ELLIPSOID


@inlined_kernel
def _lift(pair, first, guess, work):
    """Return (rows in the simplex, its closest point, the separation along it, size).

    All at true poses; no rows: no answer, and a separation of -inf: it is not known.
    """
    core_A, core_B, R, p, hulls = pair
    S, n, distance = work.S, first.n, first.distance
    height = LIFT * max(norm(p), abs(distance))
    shift = max(height - distance, 0.0)
    apart = Pair(core_A, core_B, R, axpy(-shift, n, p), hulls)
    gap = guess if is_curved(core_A) or is_curved(core_B) else 0.0
    w = _begin(first, shift, work)
    status, count, v, lower, size = gjk_inlined(apart, w, 1, math.inf, gap, 0.0, work)
    if status == OVERLAP or not height > 0.0:
        return 0, v, -math.inf, size
    for i in range(count):
        for c in range(3):
            S[i, c] -= shift * n[c]
            S[i, 6 + c] += shift * n[c]
    along = lower - shift * dot(n, unit(v, n)) if status == CONVERGED else -math.inf
    return count, v, along, size


@inlined_kernel
def _searched(pair, n, distance, work):
    """Return (is proven, contact) of the least depth of all directions.

    n: one that is not much deeper, which saves most of the others. Without a proof, n and the
    distance along it are the best found.
    """
    a, _ = support(pair.core_A, pair.hulls, scale(-1.0, n))
    b, _ = placed_support(body_B(pair), pair.hulls, n)
    size = norm(a) + norm(b) + norm(pair.p)
    known = scale(0.0, n)
    depth = (1.0 + TIE * EPSILON) * (TIE * EPSILON * size - distance)
    verdict, m, where, index = least_depth(pair, a, b, known, depth, size, work.S)
    if verdict == LESS:
        n = m
        distance = separation_inlined(pair, n)
        if distance < 0.0:  # or else they are apart, and the search ended there
            proven, found = contact_of_known(pair, n, where, index, size, work)
            if proven and found.distance < 0.0 and found.stiffness >= FLAT_MINIMUM * size:
                return True, found
    return False, Contact(n, a, b, distance, math.inf, 0.0)


@inlined_kernel
def _others(pair, a, b, n, depth, size, S):
    """Return (verdict, m) as ``cover`` does for a stationary depth, and the mechanism."""
    core_A, core_B, hulls = pair.core_A, pair.core_B, pair.hulls
    if is_least_depth(pair, a, b, n, depth, size):
        return NONE_LESS, n, _INNER_BALL
    if are_polytopes_or_cylinders(pair):
        return UNDECIDED, n, _OPEN  # all was visited before, in vain
    verdict, m = cover(pair, a, b, n, depth, size, S)
    decided_by = _COVER
    if verdict == UNDECIDED and (edge_count(core_A, hulls) > 0 or edge_count(core_B, hulls) > 0):
        verdict, m, _, _ = least_depth(pair, a, b, n, depth, size, S)
        decided_by = _CRITICAL_DIRECTIONS
    return verdict, m, decided_by


@inlined_kernel
def _lifted(pair, limit, first, work):
    """Do the same as ``lifted_contact`` by lifting, along ``first`` to begin with."""
    n, a, b, distance = first.n, first.a, first.b, first.distance
    guess = FIRST_GUESS
    if _is_smooth(pair.core_A, pair.hulls) or _is_smooth(pair.core_B, pair.hulls):
        guess = SMOOTH_GUESS
    for _ in range(LIFTS):
        count, v, along, size = _lift(pair, first, guess, work)
        if count == 0:
            break
        simplex = Simplex(work.S, work.ids, work.lam, count)
        a, b = weighted_points(simplex)
        n = unit(v, n)
        if along > limit:
            return _SEPARATED, along, a, b, n, math.inf
        proven, found = refine_inlined(pair, n, a, b, size, simplex, 1)
        n, a, b, distance = found.n, found.a, found.b, found.distance
        guess = NEXT_GUESS
        if not proven:
            first = _along(pair, n)
            continue
        if distance >= 0.0:
            return _LIFTED, distance, a, b, n, found.error
        if found.stiffness < FLAT_MINIMUM * size:
            break
        verdict, m, decided_by = _others(pair, a, b, n, -distance, size, work.S)
        if verdict == NONE_LESS:
            return decided_by, distance, a, b, n, found.error
        if verdict != LESS:
            break
        first = _along(pair, m)
        n, distance = m, first.distance
    return _OPEN, distance, a, b, n, math.inf


@inlined_kernel
def _apart_polytopes(pair, limit, first, work):
    """Do the same as ``lifted_contact`` for polytopes that are apart along ``first``.

    Nothing needs to be polished: GJK's last simplex is exact, unless it is so slender that its
    weights and its nearest point tell different witnesses.
    """
    w = _begin(first, 0.0, work)
    status, count, v, lower, size = gjk_inlined(pair, w, 1, limit, 0.0, 0.0, work)
    simplex = Simplex(work.S, work.ids, work.lam, count)
    n = simplex_normal(simplex, v)
    a, b = weighted_points(simplex)
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
def lifted_contact(pair, limit, work):
    """Return (decided by, distance, a, b, n, error) of two cores, where that is soon proven.

    The deciding algorithm is a ``Mechanism``. ``SEPARATED``: the cores are ``distance`` >
    ``limit`` apart along n, or more in other directions. ``OPEN``: no more is known than before.
    Any other: the distance is exact to ``error`` (m) and the normal unique.
    """
    core_A, core_B, hulls = pair.core_A, pair.core_B, pair.hulls
    a = b = (0.0, 0.0, 0.0)
    if not (is_simple(core_A, hulls) and is_simple(core_B, hulls)):
        return _OPEN, 0.0, a, b, a, math.inf
    first = _first_direction(pair)
    if first.distance < 0.0 and are_polytopes_or_cylinders(pair):
        proven, found = _searched(pair, first.n, first.distance, work)
        if proven:
            return _CRITICAL_DIRECTIONS, found.distance, found.a, found.b, found.n, found.error
        first = _along(pair, found.n)
    if first.distance > limit:
        return _SEPARATED, first.distance, a, b, first.n, math.inf
    if first.distance > 0.0 and not (is_curved(core_A) or is_curved(core_B)):
        return _apart_polytopes(pair, limit, first, work)
    return _lifted(pair, limit, first, work)

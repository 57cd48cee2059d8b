"""Cores that overlap or nearly touch, and that no fast path decides: EPA, then multi-start."""

import math

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel, merged_kernel
from scene_graph_ros.geometry.narrowphase.apart import contact_apart
from scene_graph_ros.geometry.narrowphase.contact.refine import separation
from scene_graph_ros.geometry.narrowphase.cores.questions import is_curved, is_listed
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.multistart.restarts import (
    contact_from_many_starts,
    separation_of_faces,
)
from scene_graph_ros.geometry.narrowphase.pair import Pair, Simplex
from scene_graph_ros.geometry.narrowphase.propose.epa import (
    COARSE_GAP,
    epa,
    epa_with_room,
    FINE_GAP,
    LARGE,
    MEDIUM,
)
from scene_graph_ros.geometry.narrowphase.propose.simplex import CONTAINS, weighted_points
from scene_graph_ros.geometry.narrowphase.propose.tetrahedron import (
    expand_to_tetrahedron,
    thickness,
)
from scene_graph_ros.geometry.spatial.vectors import axpy, norm, scale, subtract
from scene_graph_ros.geometry.tolerances import EPSILON, POLISH_RESIDUAL, TIE

__all__ = ["near_contact"]

_OPEN = int(Mechanism.OPEN)
_GJK = int(Mechanism.GJK)
_EPA = int(Mechanism.EPA)

THICK = 0.05
"""Heights over the size: a tetrahedron that GJK found around the origin is what EPA starts from,
unless it is thinner, as planes of slender faces are known to fewer digits."""

LIFT = 0.25
"""Of the pair's largest coordinate: how far apart cores are moved to find their witnesses."""


@kernel
def _overlap(pair, tolerance, count, work):
    """Return (distance, a, b, n, unique, gap, decided by) of cores that touch or overlap."""
    a, b = weighted_points(Simplex(work.S, work.ids, work.lam, count if count < 4 else 0))
    thick, size = thickness(work.S) if count == CONTAINS else (0.0, 0.0)
    if thick < THICK:
        rank, n, size = expand_to_tetrahedron(pair, count, work)
        if rank < 3:
            distance = min(separation(pair, n), 0.0)
            return distance, a, b, n, False, 0.0, _EPA
    settle_gap = 0.0
    has_hull = is_listed(pair.core_A) or is_listed(pair.core_B)
    if is_curved(pair.core_A) or is_curved(pair.core_B):
        settle_gap = FINE_GAP if has_hull else COARSE_GAP
    decided_by, n, a, b, depth, lower, unique = epa(pair, size, settle_gap, tolerance, work)
    if decided_by == _OPEN:
        expand_to_tetrahedron(pair, 0, work)
        corners = LARGE if has_hull else MEDIUM
        decided_by, n, a, b, depth, lower, unique = epa_with_room(
            pair, size, settle_gap, tolerance, corners, work
        )
    return -depth, a, b, n, unique, max(depth - lower, 0.0), decided_by


@lean_kernel
def _witnesses(pair, n, depth, size, work):
    """Return (rest, a, b): the witnesses of a depth whose direction n is known, and their misfit.

    Moved along n until they are well apart, the cores have the same witnesses and normal, but
    their distance fixes them: touching cores have many nearly equal ones.
    """
    core_A, core_B, R, p, hulls = pair
    shift = depth + LIFT * size
    lifted = Pair(core_A, core_B, R, axpy(-shift, n, p), hulls)
    start = scale(LIFT * size, n)
    _, is_overlapping, _, _, _, found = contact_apart(lifted, start, math.inf, 0.0, work)
    a, b = found.a, axpy(shift, n, found.b)
    rest = norm(axpy(depth, n, subtract(a, b)))
    return math.inf if is_overlapping else rest, a, b


@merged_kernel
def near_contact(pair, tolerance, count, work, size, known):
    """Return (distance, a, b, n, unique, gap, decided by) of cores that overlap or nearly touch.

    Rounding may stop GJK early there; EPA works on both sides of contact. ``known`` is the
    answer of ``contact_apart``: (is overlapping, separation along n, contact).
    """
    is_overlapping, lower, apart = known
    depth, q_A, q_B, m, unique, error, decided_by = _overlap(pair, tolerance, count, work)
    rest = norm(axpy(-depth, m, subtract(q_A, q_B)))
    beside = separation_of_faces(pair, m)
    if beside > depth + TIE * EPSILON * size:
        error = max(error, beside - depth)
    if tolerance == 0.0 and max(rest, error) > POLISH_RESIDUAL * EPSILON * size:
        simplex = Simplex(work.S, work.ids, work.lam, min(count, 3))
        proven, other, x, y, least, by = contact_from_many_starts(pair, m, q_A, q_B, size, simplex)
        if proven:
            error = max(error + depth - least, 0.0)
            depth, q_A, q_B, m, rest = least, x, y, other, 0.0
            decided_by = by
    allowed = max(POLISH_RESIDUAL * EPSILON * size, tolerance)
    if rest > allowed:
        if not (is_overlapping or depth > lower):
            by = _GJK if apart.error <= allowed else _OPEN
            return apart.distance, apart.a, apart.b, apart.n, True, apart.error, by
        if not is_overlapping:
            # EPA's normal separates more, but GJK's witnesses may fit it better.
            misfit = norm(axpy(-depth, m, subtract(apart.a, apart.b)))
            error = max(error, misfit)
            if misfit < rest:
                rest, q_A, q_B = misfit, apart.a, apart.b
        misfit, a, b = _witnesses(pair, m, -depth, size, work)
        if misfit < rest:
            q_A, q_B = a, b
    return depth, q_A, q_B, m, unique, error, decided_by

"""Signed distance of any two convex cores with radii: GJK where they are apart, EPA where not."""

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel, merged_kernel
from scene_graph_ros.geometry.narrowphase.all_features import polish_all
from scene_graph_ros.geometry.narrowphase.cores.questions import is_curved, is_listed
from scene_graph_ros.geometry.narrowphase.epa import (
    COARSE_GAP,
    epa,
    FINE_GAP,
    LARGE,
    MEDIUM,
    SMALL,
)
from scene_graph_ros.geometry.narrowphase.gjk import FAR, gjk, OVERLAP, STALLED
from scene_graph_ros.geometry.narrowphase.lift import lifted_contact
from scene_graph_ros.geometry.narrowphase.lift_by_kind import lifted_contact_by_kind
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.polytope_rows import FIRST_FACE, MAX_FACES
from scene_graph_ros.geometry.narrowphase.refine import refine, separation
from scene_graph_ros.geometry.narrowphase.restarts import (
    polish_from_everywhere,
    separation_of_faces,
)
from scene_graph_ros.geometry.narrowphase.simplex import CONTAINS, simplex_normal, weighted_points
from scene_graph_ros.geometry.narrowphase.tetrahedron import expand_to_tetrahedron, thickness
from scene_graph_ros.geometry.spatial.vectors import axpy, dot, norm, scale, subtract
from scene_graph_ros.geometry.tolerances import (
    EPSILON,
    GJK_ROUNDING,
    NEAR_CONTACT,
    POLISH_RESIDUAL,
    TIE,
)

__all__ = ["Workspace", "convex_distance", "convex_distance_in", "new_workspace"]

_OPEN = int(Mechanism.OPEN)
_SEPARATED = int(Mechanism.SEPARATED)
_GJK = int(Mechanism.GJK)
_REFINED = int(Mechanism.REFINED)
_EPA = int(Mechanism.EPA)

FIRST_GAP = 1e-3
"""Relative gap at which GJK's contact of curved cores is first polished; squared each time."""

ATTEMPTS = 4

THICK = 0.05
"""Heights over the size: a tetrahedron that GJK found around the origin is what EPA starts from,
unless it is thinner, as planes of slender faces are known to fewer digits."""

ROWS = FIRST_FACE + MAX_FACES
"""Of the workspace: the simplex, the corners beside it, directions of ``other_depths`` or cells of
``covering``."""

Workspace = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]
"""A simplex and more (ROWS, 9), its weights (4,), and the indices of its corners."""

LIFT = 0.25
"""Of the pair's largest coordinate: how far apart cores are moved to find their witnesses."""


def new_workspace() -> Workspace:
    """Return a workspace for ``convex_distance_in``, for one thread."""
    return np.empty((ROWS, 9)), np.empty(4), np.empty((FIRST_FACE, 2), np.int64)


@lean_kernel
def _finish(core_A, core_B, distance, a, b, n, unique, gap, decided_by):
    """Add the radii, and split what rounding left of a - b = distance n between a and b."""
    rest = subtract(axpy(-distance, n, a), b)
    p_ACa = axpy(-core_A[2], n, axpy(-0.5, rest, a))
    p_ACb = axpy(core_B[2], n, axpy(0.5, rest, b))
    return distance - core_A[2] - core_B[2], p_ACa, p_ACb, n, unique, gap, decided_by


@lean_kernel
def _far(core_A, core_B, lower, n):
    """Return the answer for cores that are further apart than was asked for."""
    phi = lower - core_A[2] - core_B[2]
    return phi, (0.0, 0.0, 0.0), scale(-phi, n), n, False, math.inf, _SEPARATED


@kernel
def _overlap(core_A, core_B, R, p, hulls, tolerance, count, S, ids, lam):
    """Return (distance, a, b, n, unique, gap, decided by) of cores that touch or overlap."""
    a, b = weighted_points(S, lam, count if count < 4 else 0)
    thick, size = thickness(S) if count == CONTAINS else (0.0, 0.0)
    if thick < THICK:
        rank, n, size = expand_to_tetrahedron(core_A, core_B, R, p, hulls, count, S, ids)
        if rank < 3:
            distance = min(separation(core_A, core_B, R, p, hulls, n), 0.0)
            return distance, a, b, n, False, 0.0, _EPA
    settle_gap = 0.0
    has_hull = is_listed(core_A) or is_listed(core_B)
    if is_curved(core_A) or is_curved(core_B):
        settle_gap = FINE_GAP if has_hull else COARSE_GAP
    decided_by, n, a, b, depth, lower, unique = epa(
        core_A, core_B, R, p, hulls, size, settle_gap, tolerance, SMALL, S, ids, lam
    )
    if decided_by == _OPEN:
        expand_to_tetrahedron(core_A, core_B, R, p, hulls, 0, S, ids)
        decided_by, n, a, b, depth, lower, unique = epa(
            core_A,
            core_B,
            R,
            p,
            hulls,
            size,
            settle_gap,
            tolerance,
            LARGE if has_hull else MEDIUM,
            S,
            ids,
            lam,
        )
    return -depth, a, b, n, unique, max(depth - lower, 0.0), decided_by


@lean_kernel
def _apart(core_A, core_B, R, p, hulls, v, limit, tolerance, S, ids, lam):
    """Run GJK from v and polish its contact.

    Returns (decided by, is overlapping, count, distance, lower, size, a, b, n, gap), with
    ``count`` rows in the last simplex. ``OPEN``: the cores overlap, or the contact could not be
    proven, and what is known are the bounds ``lower``, the separation along n, and ``distance``.
    ``SEPARATED``: nothing is known but that ``lower`` exceeds the ``limit``.
    """
    radius = core_A[2] + core_B[2]
    curved = is_curved(core_A) or is_curved(core_B)
    relative_gap = FIRST_GAP if curved else 0.0
    count = 0
    a = b = n = (0.0, 0.0, 0.0)
    distance, lower, size, gap = math.inf, -math.inf, 0.0, math.inf
    for _ in range(ATTEMPTS):
        status, count, v, lower, size = gjk(
            core_A, core_B, R, p, hulls, v, count, limit, relative_gap, tolerance, S, ids, lam
        )
        if status == OVERLAP:
            return _OPEN, True, count, distance, lower, size, a, b, n, gap
        n = simplex_normal(S, count, v)
        if status == FAR:
            return _SEPARATED, False, count, math.inf, lower, size, a, b, n, gap
        a, b = weighted_points(S, lam, count)
        distance = math.sqrt(dot(v, v))
        gap = distance - lower
        if 0.0 < tolerance >= gap and (lower > radius or distance <= radius):
            return _GJK, False, count, distance, lower, size, a, b, n, gap
        misfit = norm(axpy(-distance, n, subtract(a, b)))
        is_exact = max(gap / GJK_ROUNDING, misfit / POLISH_RESIDUAL) <= EPSILON * size
        if not curved and is_exact:
            break
        proven, n, a, b, lower, error, _ = refine(
            core_A, core_B, R, p, hulls, n, a, b, size, S, ids, lam, count, 1
        )
        # Where lines of contact cross behind each other, a contact can be proven that overlaps.
        if proven and lower >= -POLISH_RESIDUAL * EPSILON * size:
            return _REFINED, False, count, lower, lower, size, a, b, n, error
        gap = max(error, distance - lower)
        if status == STALLED:
            break
        relative_gap *= relative_gap
    decided_by = _GJK if gap <= POLISH_RESIDUAL * EPSILON * size else _OPEN
    return decided_by, False, count, distance, lower, size, a, b, n, gap


@lean_kernel
def _lifted(core_A, core_B, R, p, hulls, n, depth, size, S, ids, lam):
    """Return (rest, a, b): the witnesses of a depth whose direction n is known, and their misfit.

    Moved along n until they are well apart, the cores have the same witnesses and normal, but
    their distance fixes them: what touches has many nearly equal ones.
    """
    shift = depth + LIFT * size
    _, is_overlapping, _, _, _, _, a, b, _, _ = _apart(
        core_A,
        core_B,
        R,
        axpy(-shift, n, p),
        hulls,
        scale(LIFT * size, n),
        math.inf,
        0.0,
        S,
        ids,
        lam,
    )
    b = axpy(shift, n, b)
    rest = norm(axpy(depth, n, subtract(a, b)))
    return math.inf if is_overlapping else rest, a, b


@merged_kernel
def _near_contact(core_A, core_B, R, p, hulls, tolerance, count, S, ids, lam, size, known):
    """Return (distance, a, b, n, unique, gap, decided by) of cores that overlap or nearly touch.

    Rounding may stop GJK early there; EPA works on both sides of contact. ``known`` is what GJK
    found: (is overlapping, distance, separation along n, a, b, n, gap).
    """
    is_overlapping, distance, lower, a, b, n, gap = known
    depth, q_A, q_B, m, unique, error, decided_by = _overlap(
        core_A, core_B, R, p, hulls, tolerance, count, S, ids, lam
    )
    rest = norm(axpy(-depth, m, subtract(q_A, q_B)))
    beside = separation_of_faces(core_A, core_B, R, p, hulls, m)
    if beside > depth + TIE * EPSILON * size:
        error = max(error, beside - depth)
    if tolerance == 0.0 and max(rest, error) > POLISH_RESIDUAL * EPSILON * size:
        proven, other, x, y, least, by = polish_from_everywhere(
            core_A, core_B, R, p, hulls, m, q_A, q_B, size, S, ids, lam, min(count, 3)
        )
        if proven:
            error = max(error + depth - least, 0.0)
            depth, q_A, q_B, m, rest = least, x, y, other, 0.0
            decided_by = by
    allowed = max(POLISH_RESIDUAL * EPSILON * size, tolerance)
    if rest > allowed:
        if not (is_overlapping or depth > lower):
            return distance, a, b, n, True, gap, _GJK if gap <= allowed else _OPEN
        if not is_overlapping:
            # EPA's normal separates more, but GJK's witnesses may fit it better.
            misfit = norm(axpy(-depth, m, subtract(a, b)))
            error = max(error, misfit)
            if misfit < rest:
                rest, q_A, q_B = misfit, a, b
        misfit, a, b = _lifted(core_A, core_B, R, p, hulls, m, -depth, size, S, ids, lam)
        if misfit < rest:
            q_A, q_B = a, b
    return depth, q_A, q_B, m, unique, error, decided_by


@lean_kernel
def _in_full(core_A, core_B, R_AB, p_AB, hulls, max_distance, tolerance, S, lam, ids):
    """Return what ``convex_distance`` does by GJK, and by EPA where they overlap."""
    v = scale(-1.0, p_AB)
    if not dot(v, v) > 0.0:
        v = (1.0, 0.0, 0.0)
    limit = max_distance + core_A[2] + core_B[2]
    decided_by, is_overlapping, count, distance, lower, size, a, b, n, gap = _apart(
        core_A, core_B, R_AB, p_AB, hulls, v, limit, tolerance, S, ids, lam
    )
    if decided_by == _SEPARATED:
        return _far(core_A, core_B, lower, n)
    unique = True
    if decided_by == _OPEN and (is_overlapping or min(lower, distance) <= NEAR_CONTACT * size):
        known = (is_overlapping, distance, lower, a, b, n, gap)
        distance, a, b, n, unique, gap, decided_by = _near_contact(
            core_A, core_B, R_AB, p_AB, hulls, tolerance, count, S, ids, lam, size, known
        )
    elif decided_by == _OPEN and tolerance == 0.0:
        proven, m, x, y, least, by = polish_all(
            core_A, core_B, R_AB, p_AB, hulls, n, a, b, size, S, ids, lam, min(count, 3)
        )
        if proven:
            distance, n, a, b, gap = least, m, x, y, 0.0
            decided_by = by
    return _finish(core_A, core_B, distance, a, b, n, unique, gap, decided_by)


@merged_kernel
def _lifted_or_in_full(
    lifted, core_A, core_B, R_AB, p_AB, hulls, max_distance, tolerance, S, lam, ids
):
    """Return what ``convex_distance`` does, given what ``lifted_contact`` found."""
    decided_by, distance, a, b, n, gap = lifted
    if decided_by == _SEPARATED:
        return _far(core_A, core_B, distance, n)
    if decided_by != _OPEN:
        return _finish(core_A, core_B, distance, a, b, n, True, gap, decided_by)
    return _in_full(core_A, core_B, R_AB, p_AB, hulls, max_distance, tolerance, S, lam, ids)


@merged_kernel
def convex_distance_in(work, core_A, core_B, R_AB, p_AB, hulls, max_distance, tolerance):
    """Do the same as ``convex_distance`` in a ``Workspace``, sooner for cores of shapes in order.

    More code is compiled for that, and once more for every caller: it is for the loop over all
    pairs of a scene.
    """
    S, lam, ids = work
    limit = max_distance + core_A[2] + core_B[2]
    lifted = lifted_contact_by_kind(core_A, core_B, R_AB, p_AB, hulls, limit, S, ids, lam)
    return _lifted_or_in_full(
        lifted, core_A, core_B, R_AB, p_AB, hulls, max_distance, tolerance, S, lam, ids
    )


@kernel
def convex_distance(core_A, core_B, R_AB, p_AB, hulls, max_distance, tolerance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique, gap, decided by) of two ``cores.kinds``.

    Positions are in A's frame, from its origin (m). ``gap`` is the difference of the upper and
    the lower bound of the distance; the answer is taken as soon as it is at most ``tolerance``
    (m) and the sign is certain, or polished to rounding with 0. What ``lifted_contact`` proves is
    always exact: it takes no longer than a looser answer. A ``phi`` beyond ``max_distance`` is
    only a lower bound, and comes without witnesses. What decided it is a ``Mechanism``.
    """
    S, lam = np.empty((ROWS, 9)), np.empty(4)
    ids = np.empty((FIRST_FACE, 2), np.int64)
    limit = max_distance + core_A[2] + core_B[2]
    lifted = lifted_contact(core_A, core_B, R_AB, p_AB, hulls, limit, S, ids, lam)
    return _lifted_or_in_full(
        lifted, core_A, core_B, R_AB, p_AB, hulls, max_distance, tolerance, S, lam, ids
    )

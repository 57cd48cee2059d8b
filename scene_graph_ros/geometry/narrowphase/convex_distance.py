"""Signed distance of any two convex cores with radii: GJK where they are apart, EPA where not."""

import math

import numpy as np

from scene_graph_ros.geometry.jit import kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores import HULL, is_curved
from scene_graph_ros.geometry.narrowphase.epa import COARSE_GAP, epa, FINE_GAP, LARGE, SMALL
from scene_graph_ros.geometry.narrowphase.gjk import FAR, gjk, OVERLAP, STALLED
from scene_graph_ros.geometry.narrowphase.refine import refine, separation
from scene_graph_ros.geometry.narrowphase.simplex import weighted_points
from scene_graph_ros.geometry.narrowphase.tetrahedron import expand_to_tetrahedron
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, norm, scale, subtract, unit
from scene_graph_ros.geometry.tolerances import (
    EPSILON,
    GJK_ROUNDING,
    NEAR_CONTACT,
    POLISH_RESIDUAL,
)

__all__ = ["convex_distance"]

FIRST_GAP = 1e-3
"""Relative gap at which GJK's contact of curved cores is first polished; squared each time."""

ATTEMPTS = 4


@lean_kernel
def _simplex_normal(S, count, v):
    """Return the unit direction of v, from the simplex where that is more accurate."""
    n = unit(v, (0.0, 0.0, 1.0))
    if count == 3:
        e = (S[1, 0] - S[0, 0], S[1, 1] - S[0, 1], S[1, 2] - S[0, 2])
        f = (S[2, 0] - S[0, 0], S[2, 1] - S[0, 1], S[2, 2] - S[0, 2])
        m = unit(cross(e, f), n)
        n = m if dot(m, n) > 0.0 else scale(-1.0, m)
    return n


@lean_kernel
def _finish(core_A, core_B, distance, a, b, n, unique, gap):
    """Add the radii, and split what rounding left of a - b = distance n between a and b."""
    rest = subtract(axpy(-distance, n, a), b)
    p_ACa = axpy(-core_A[2], n, axpy(-0.5, rest, a))
    p_ACb = axpy(core_B[2], n, axpy(0.5, rest, b))
    return distance - core_A[2] - core_B[2], p_ACa, p_ACb, n, unique, gap


@kernel
def _overlap(core_A, core_B, R, p, hulls, tolerance, count, S, ids, lam):
    """Return (distance, a, b, n, unique, gap) of cores that touch or overlap."""
    a, b = weighted_points(S, lam, count if count < 4 else 0)
    rank, n, size = expand_to_tetrahedron(core_A, core_B, R, p, hulls, count, S, ids)
    if rank < 3:
        distance = min(separation(core_A, core_B, R, p, hulls, n), 0.0)
        return distance, a, b, n, False, 0.0
    settle_gap = 0.0
    if is_curved(core_A) or is_curved(core_B):
        settle_gap = FINE_GAP if core_A[0] == HULL or core_B[0] == HULL else COARSE_GAP
    done, n, a, b, depth, lower, unique = epa(
        core_A, core_B, R, p, hulls, size, settle_gap, tolerance, SMALL, S, ids, lam
    )
    if not done:
        expand_to_tetrahedron(core_A, core_B, R, p, hulls, 0, S, ids)
        done, n, a, b, depth, lower, unique = epa(
            core_A, core_B, R, p, hulls, size, settle_gap, tolerance, LARGE, S, ids, lam
        )
    return -depth, a, b, n, unique, max(depth - lower, 0.0)


@kernel
def convex_distance(core_A, core_B, R_AB, p_AB, hulls, max_distance, tolerance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique, gap) of two cores (see ``cores``).

    Positions are in A's frame, from its origin (m). ``gap`` is the difference of the upper and
    the lower bound of the distance; the answer is taken as soon as it is at most ``tolerance``
    (m) and the sign is certain, or polished to rounding with 0. A ``phi`` beyond ``max_distance``
    is only a lower bound, and comes without witnesses.
    """
    S = np.empty((24, 9))
    ids = np.empty((24, 2), np.int64)
    lam = np.empty(4)
    v = scale(-1.0, p_AB)
    if not dot(v, v) > 0.0:
        v = (1.0, 0.0, 0.0)
    radius = core_A[2] + core_B[2]
    limit = max_distance + radius
    curved = is_curved(core_A) or is_curved(core_B)
    relative_gap = FIRST_GAP if curved else 0.0
    count = 0
    distance, gap = 0.0, 0.0
    for _ in range(ATTEMPTS):
        status, count, v, lower, size = gjk(
            core_A,
            core_B,
            R_AB,
            p_AB,
            hulls,
            v,
            count,
            limit,
            relative_gap,
            tolerance,
            S,
            ids,
            lam,
        )
        if status in (FAR, OVERLAP):
            break
        a, b = weighted_points(S, lam, count)
        n = _simplex_normal(S, count, v)
        distance = math.sqrt(dot(v, v))
        gap = distance - lower
        if 0.0 < tolerance >= gap and (lower > radius or distance <= radius):
            return _finish(core_A, core_B, distance, a, b, n, True, gap)
        if not curved and gap <= GJK_ROUNDING * EPSILON * size:
            break
        proven, n, a, b, lower, gap, _ = refine(
            core_A, core_B, R_AB, p_AB, hulls, n, a, b, size, S, ids, lam, count, 1
        )
        if proven:
            return _finish(core_A, core_B, lower, a, b, n, True, gap)
        if status == STALLED:
            break
        relative_gap *= relative_gap
    if status == FAR:
        n = unit(v, (0.0, 0.0, 1.0))
        phi = lower - core_A[2] - core_B[2]
        return phi, (0.0, 0.0, 0.0), scale(-phi, n), n, False, math.inf
    allowed = POLISH_RESIDUAL * EPSILON * size
    if status == OVERLAP or (gap > allowed and distance <= NEAR_CONTACT * size):
        # Nearly touching, where rounding may stop GJK early: EPA works on both sides of contact.
        depth, q_A, q_B, m, unique, error = _overlap(
            core_A, core_B, R_AB, p_AB, hulls, tolerance, count, S, ids, lam
        )
        rest = norm(axpy(-depth, m, subtract(q_A, q_B)))
        if status == OVERLAP or rest <= allowed:
            return _finish(core_A, core_B, depth, q_A, q_B, m, unique, error)
    return _finish(core_A, core_B, distance, a, b, n, True, gap)

"""Signed distance of any two convex cores with radii: GJK where they are apart, EPA where not."""

import math

import numpy as np

from scene_graph_ros.geometry.jit import kernel
from scene_graph_ros.geometry.narrowphase.cores import is_curved, placed_support, support
from scene_graph_ros.geometry.narrowphase.epa import LARGE, SMALL, epa, expand_to_tetrahedron
from scene_graph_ros.geometry.narrowphase.gjk import FAR, OVERLAP, gjk
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, scale, subtract, unit

__all__ = ["convex_distance"]


@kernel
def _witnesses(S, lam, count):
    """Return the points of A and B that the weights of a simplex stand for."""
    ax, ay, az, bx, by, bz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(count):
        ax += lam[i] * S[i, 3]
        ay += lam[i] * S[i, 4]
        az += lam[i] * S[i, 5]
        bx += lam[i] * S[i, 6]
        by += lam[i] * S[i, 7]
        bz += lam[i] * S[i, 8]
    return (ax, ay, az), (bx, by, bz)


@kernel
def _separation(core_A, core_B, R, p, hulls, n):
    """Return the gap between A and B along n: a lower bound of their distance for every n."""
    a, _ = support(core_A, hulls, scale(-1.0, n), -1)
    b, _ = placed_support(core_B, hulls, R, p, n, -1)
    return dot(n, subtract(a, b))


@kernel
def _simplex_normal(S, count, v):
    """Return the unit direction of v, from the simplex where that is more accurate."""
    n = unit(v, (0.0, 0.0, 1.0))
    if count == 3:
        e = (S[1, 0] - S[0, 0], S[1, 1] - S[0, 1], S[1, 2] - S[0, 2])
        f = (S[2, 0] - S[0, 0], S[2, 1] - S[0, 1], S[2, 2] - S[0, 2])
        m = unit(cross(e, f), n)
        n = m if dot(m, n) > 0.0 else scale(-1.0, m)
    return n


@kernel
def _finish(core_A, core_B, distance, a, b, n, unique, gap):
    """Add the radii, and split what rounding left of a - b = distance n between a and b."""
    rest = subtract(axpy(-distance, n, a), b)
    p_ACa = axpy(-core_A[2], n, axpy(-0.5, rest, a))
    p_ACb = axpy(core_B[2], n, axpy(0.5, rest, b))
    return distance - core_A[2] - core_B[2], p_ACa, p_ACb, n, unique, gap


@kernel
def _overlap(core_A, core_B, R, p, hulls, count, S, ids, lam):
    """Return (distance, a, b, n, unique, gap) of cores that touch or overlap."""
    a, b = _witnesses(S, lam, count if count < 4 else 0)
    rank, n, size = expand_to_tetrahedron(core_A, core_B, R, p, hulls, count, S, ids)
    if rank < 3:
        distance = min(_separation(core_A, core_B, R, p, hulls, n), 0.0)
        return distance, a, b, n, False, 0.0
    relative_gap = 1e-10 if is_curved(core_A) or is_curved(core_B) else 0.0
    done, count, n, depth, lower = epa(
        core_A, core_B, R, p, hulls, size, relative_gap, SMALL, S, ids, lam
    )
    if not done:
        expand_to_tetrahedron(core_A, core_B, R, p, hulls, 0, S, ids)
        done, count, n, depth, lower = epa(
            core_A, core_B, R, p, hulls, size, relative_gap, LARGE, S, ids, lam
        )
    a, b = _witnesses(S, lam, count)
    return -depth, a, b, n, True, depth - lower


@kernel
def convex_distance(core_A, core_B, R_AB, p_AB, hulls, max_distance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique, gap) of two cores (see ``cores``).

    Positions are in A's frame, from its origin (m). ``gap`` is the difference of the upper and
    the lower bound of the distance. A ``phi`` beyond ``max_distance`` is only a lower bound, and
    comes without witnesses.
    """
    S = np.empty((24, 9))
    ids = np.empty((24, 2), np.int64)
    lam = np.empty(4)
    v = scale(-1.0, p_AB)
    if not dot(v, v) > 0.0:
        v = (1.0, 0.0, 0.0)
    limit = max_distance + core_A[2] + core_B[2]
    status, count, v, lower, size = gjk(
        core_A, core_B, R_AB, p_AB, hulls, v, 0, limit, 1e-12, S, ids, lam
    )
    if status == FAR:
        n = unit(v, (0.0, 0.0, 1.0))
        phi = lower - core_A[2] - core_B[2]
        return phi, (0.0, 0.0, 0.0), scale(-phi, n), n, False, math.inf
    if status == OVERLAP:
        distance, a, b, n, unique, gap = _overlap(
            core_A, core_B, R_AB, p_AB, hulls, count, S, ids, lam
        )
    else:
        a, b = _witnesses(S, lam, count)
        n = _simplex_normal(S, count, v)
        distance = math.sqrt(dot(v, v))
        gap = distance - lower
        unique = True
    return _finish(core_A, core_B, distance, a, b, n, unique, gap)

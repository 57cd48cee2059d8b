"""Depth of two overlapping cores by the expanding polytope algorithm (EPA).

A polytope inside C = {a - b} grows at the face nearest to the origin. That face's distance is a
lower bound of the depth, the extent of C along any face's normal an upper one. The distances are
signed, so the origin may start outside the polytope, as it does by rounding when A and B touch.
"""

import math

import numpy as np

from scene_graph_ros.geometry.jit import kernel
from scene_graph_ros.geometry.narrowphase.gjk import store_support
from scene_graph_ros.geometry.narrowphase.polytope import (
    CLOSED,
    MAX_HORIZON,
    add_corner,
    nearest_face,
    start_tetrahedron,
)
from scene_graph_ros.geometry.narrowphase.simplex import closest_on_simplex
from scene_graph_ros.geometry.spatial.vectors import any_orthogonal, cross, dot, scale, unit
from scene_graph_ros.geometry.tolerances import EPSILON, FLAT_SIMPLEX, GJK_ROUNDING

__all__ = ["LARGE", "SMALL", "epa", "expand_to_tetrahedron"]

SMALL = 96
"""Corners of the first workspace: enough for primitives, and it stays in the first-level cache."""

LARGE = 1024
"""Corners of the second workspace, for large hulls whose faces nearly tie."""


@kernel
def _copy_row(S, ids, source, target):
    for c in range(9):
        S[target, c] = S[source, c]
    ids[target, 0] = ids[source, 0]
    ids[target, 1] = ids[source, 1]


@kernel
def _distance_off(S, row, rank, e, n):
    """Return how far a row is from corner 0 (rank 1), the line along e (2), the plane of n (3)."""
    q = (S[row, 0] - S[0, 0], S[row, 1] - S[0, 1], S[row, 2] - S[0, 2])
    if rank == 3:
        return abs(dot(q, n))
    if rank == 2:
        q = cross(e, q)
    return math.sqrt(dot(q, q))


@kernel
def _probe(rank, trial, e, u, n):
    """Return the direction of a trial: the axes for rank 1, those around e for 2, n for 3."""
    sign = 1.0 if trial % 2 == 0 else -1.0
    if rank == 1:
        axis = trial // 2
        x, y, z = 0.0, 0.0, 0.0
        if axis == 0:
            x = sign
        elif axis == 1:
            y = sign
        else:
            z = sign
        return (x, y, z)
    if rank == 2:
        return scale(sign, u) if trial < 2 else scale(sign, cross(e, u))
    return scale(sign, n)


@kernel
def expand_to_tetrahedron(core_A, core_B, R, p, hulls, count, S, ids):
    """Find four corners of C that span a volume; return (rank, normal, size).

    Starts from the ``count`` rows of a simplex. Rank 3 is a tetrahedron in rows 0 to 3; where C
    is flat the rank is its dimension, and ``normal`` a unit vector orthogonal to it.
    """
    e = (1.0, 0.0, 0.0)
    u = (0.0, 1.0, 0.0)
    n = (0.0, 0.0, 1.0)
    size = 0.0
    if count == 0:
        store_support(core_A, core_B, R, p, hulls, n, S, ids, 0, (-1, -1))
        count = 1
    for rank in range(1, 4):
        row = count
        for trial in range(8 - 2 * rank if rank < 3 else 2):
            store_support(
                core_A, core_B, R, p, hulls, _probe(rank, trial, e, u, n), S, ids, row, (-1, -1)
            )
            row += 1
        best = 0
        furthest = 0.0
        for k in range(rank, row):
            off = _distance_off(S, k, rank, e, n)
            if off > furthest:
                best = k
                furthest = off
            for c in range(9):
                size = max(size, abs(S[k, c]))
        if furthest <= FLAT_SIMPLEX * size:
            return rank - 1, n, size
        if best != rank:
            # The row that gives way is not lost: it may serve the next rank.
            _copy_row(S, ids, rank, row)
            _copy_row(S, ids, best, rank)
            _copy_row(S, ids, row, best)
        count = row
        q = (S[rank, 0] - S[0, 0], S[rank, 1] - S[0, 1], S[rank, 2] - S[0, 2])
        if rank == 1:
            e = unit(q, e)
            u = any_orthogonal(e)
            n = u
        elif rank == 2:
            n = unit(cross(e, q), n)
    return 3, n, size


@kernel
def _equals_corner(S, corner):
    for i in range(corner):
        if S[i, 0] == S[corner, 0] and S[i, 1] == S[corner, 1] and S[i, 2] == S[corner, 2]:
            return True
    return False


@kernel
def _normal(planes, f):
    return (planes[f, 0], planes[f, 1], planes[f, 2])


@kernel
def _reduce(S, ids, faces, f, S_out, ids_out, lam):
    """Copy a face into ``S_out`` and reduce it to the part nearest to the origin."""
    for k in range(3):
        row = faces[f, k]
        for c in range(9):
            S_out[k, c] = S[row, c]
        ids_out[k, 0] = ids[row, 0]
        ids_out[k, 1] = ids[row, 1]
    count, _ = closest_on_simplex(S_out, ids_out, lam, 3)
    return count


@kernel
def epa(core_A, core_B, R, p, hulls, size, relative_gap, capacity, S0, ids0, lam):
    """Grow the tetrahedron in rows 0 to 3 of ``S0`` until the depth is known.

    Returns (is finished, count, n, depth, lower bound): the unit direction n of least depth (out
    of B into A), the extent of C along it, which bounds the depth from above, and the bound from
    below. Rows 0 to count of ``S0`` become the face of C that the direction belongs to, ``lam``
    the weights of its point nearest to the origin. Not finished: the workspace of ``capacity``
    corners was exhausted, or rounding broke the surface; the bounds hold all the same.
    """
    S = np.empty((capacity, 9))
    ids = np.empty((capacity, 2), np.int64)
    faces = np.empty((2 * capacity, 8), np.int64)
    planes = np.empty((2 * capacity, 4))
    stack = np.empty(2 * capacity, np.int64)
    horizon = np.empty(MAX_HORIZON, np.int64)
    for i in range(4):
        for c in range(9):
            S[i, c] = S0[i, c]
        ids[i, 0] = ids0[i, 0]
        ids[i, 1] = ids0[i, 1]
    face_count = start_tetrahedron(S, faces, planes)
    rounding = GJK_ROUNDING * EPSILON * size
    depth = math.inf
    lower = -math.inf
    best = (0.0, 0.0, 1.0)
    count = 0
    hints = (-1, -1)
    for corner in range(4, capacity):
        f = nearest_face(faces, planes, face_count)
        if f < 0:
            return False, count, best, depth, lower
        lower = max(lower, planes[f, 3])
        if faces[f, CLOSED] == 1:
            # Its extent is already known to be its distance, so nothing nearer exists.
            return True, _reduce(S, ids, faces, f, S0, ids0, lam), best, depth, lower
        n = scale(-1.0, _normal(planes, f))
        w, hints = store_support(core_A, core_B, R, p, hulls, n, S, ids, corner, hints)
        extent = -dot(n, w)
        if extent < depth:
            depth = extent
            best = n
        if depth - planes[f, 3] <= max(relative_gap * abs(depth), rounding):
            return True, _reduce(S, ids, faces, f, S0, ids0, lam), n, extent, lower
        if _equals_corner(S, corner):
            faces[f, CLOSED] = 1
            planes[f, 3] = extent
            continue
        count = _reduce(S, ids, faces, f, S0, ids0, lam)
        face_count = add_corner(S, faces, planes, face_count, f, corner, rounding, stack, horizon)
        if face_count < 0:
            return False, count, best, depth, lower
    return False, count, best, depth, lower

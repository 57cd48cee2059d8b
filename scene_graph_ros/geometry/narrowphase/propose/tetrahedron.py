"""Four corners of the Minkowski difference that span a volume: where EPA starts from."""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.propose.gjk import store_support
from scene_graph_ros.geometry.spatial.vectors import any_orthogonal, cross, dot, scale, unit
from scene_graph_ros.geometry.tolerances import FLAT_SIMPLEX

__all__ = ["expand_to_tetrahedron", "thickness"]


@lean_kernel
def _copy_row(S, ids, source, target):
    for c in range(9):
        S[target, c] = S[source, c]
    ids[target, 0] = ids[source, 0]
    ids[target, 1] = ids[source, 1]


@lean_kernel
def _distance_off(S, row, rank, e, n):
    """Return a row's distance from corner 0 (rank 1), the line along e (2), the plane of n (3)."""
    q = (S[row, 0] - S[0, 0], S[row, 1] - S[0, 1], S[row, 2] - S[0, 2])
    if rank == 3:
        return abs(dot(q, n))
    if rank == 2:
        q = cross(e, q)
    return math.sqrt(dot(q, q))


@lean_kernel
def thickness(S):
    """Return (the least of a tetrahedron's three heights over its size, size); rows 0 to 3 of S.

    The heights are those of corner 1 over corner 0, of corner 2 over their line, and of corner 3
    over the plane of the three.
    """
    size = 0.0
    for k in range(4):
        for c in range(9):
            size = max(size, abs(S[k, c]))
    e = unit((S[1, 0] - S[0, 0], S[1, 1] - S[0, 1], S[1, 2] - S[0, 2]), (1.0, 0.0, 0.0))
    q = (S[2, 0] - S[0, 0], S[2, 1] - S[0, 1], S[2, 2] - S[0, 2])
    n = unit(cross(e, q), e)
    least = min(
        _distance_off(S, 1, 1, e, n), _distance_off(S, 2, 2, e, n), _distance_off(S, 3, 3, e, n)
    )
    return least / size, size


@lean_kernel
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


@lean_kernel
def expand_to_tetrahedron(pair, count, work):
    """Find four corners of C that span a volume; return (rank, normal, size).

    Starts from the ``count`` rows of a simplex. Rank 3 is a tetrahedron in rows 0 to 3; where C
    is flat the rank is its dimension, and ``normal`` a unit vector orthogonal to it.
    """
    S, ids = work.S, work.ids
    e = (1.0, 0.0, 0.0)
    u = (0.0, 1.0, 0.0)
    n = (0.0, 0.0, 1.0)
    size = 0.0
    if count == 0:
        store_support(pair, n, work, 0)
        count = 1
    for rank in range(1, 4):
        row = count
        for trial in range(8 - 2 * rank if rank < 3 else 2):
            store_support(pair, _probe(rank, trial, e, u, n), work, row)
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

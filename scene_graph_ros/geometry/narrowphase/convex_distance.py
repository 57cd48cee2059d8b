"""Signed distance of any two convex cores with radii: the strategy of the narrow phase.

First the fast path (``lifted_contact``): a proposal, refined, returned only with its proof. Else
GJK (``apart``) where cores are apart, and EPA with multi-start (``near_contact``) where they
overlap or nearly touch. ``docs/narrowphase.md`` says how often each decides.
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel, merged_kernel
from scene_graph_ros.geometry.narrowphase.apart import contact_apart
from scene_graph_ros.geometry.narrowphase.lifted_contact import lifted_contact
from scene_graph_ros.geometry.narrowphase.lifted_contact_by_kind import lifted_contact_by_kind
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.multistart.all_features import contact_of_all_features
from scene_graph_ros.geometry.narrowphase.near_contact import near_contact
from scene_graph_ros.geometry.narrowphase.pair import Pair, Simplex, Workspace
from scene_graph_ros.geometry.narrowphase.prove.cover import NUMBERS_OF_COVER
from scene_graph_ros.geometry.narrowphase.prove.polytope_faces import FIRST_FACE, NUMBERS_OF_FACES
from scene_graph_ros.geometry.spatial.vectors import axpy, dot, scale, subtract
from scene_graph_ros.geometry.tolerances import NEAR_CONTACT

__all__ = ["convex_distance", "convex_distance_in", "new_workspace"]

_OPEN = int(Mechanism.OPEN)
_SEPARATED = int(Mechanism.SEPARATED)

ROWS = -(-max(NUMBERS_OF_FACES, NUMBERS_OF_COVER) // 9)
"""Of the workspace: a simplex and corners beside it, critical directions, or cells of a cover."""


def new_workspace() -> Workspace:
    """Return a workspace for ``convex_distance_in``, for one thread."""
    return Workspace(np.empty((ROWS, 9)), np.empty((FIRST_FACE, 2), np.int64), np.empty(4))


@lean_kernel
def _finish(pair, distance, a, b, n, unique, gap, decided_by):
    """Add the radii, and split the rounding error of a - b = distance n between a and b."""
    radius_A, radius_B = pair.core_A[2], pair.core_B[2]
    rest = subtract(axpy(-distance, n, a), b)
    p_ACa = axpy(-radius_A, n, axpy(-0.5, rest, a))
    p_ACb = axpy(radius_B, n, axpy(0.5, rest, b))
    return distance - radius_A - radius_B, p_ACa, p_ACb, n, unique, gap, decided_by


@lean_kernel
def _far(pair, lower, n):
    """Return the answer for cores that are further apart than was asked for."""
    phi = lower - pair.core_A[2] - pair.core_B[2]
    return phi, (0.0, 0.0, 0.0), scale(-phi, n), n, False, math.inf, _SEPARATED


@lean_kernel
def _in_full(pair, limit, tolerance, work):
    """Return the answer of ``convex_distance`` by GJK, and by EPA where they overlap."""
    v = scale(-1.0, pair.p)
    if not dot(v, v) > 0.0:
        v = (1.0, 0.0, 0.0)
    decided_by, is_overlapping, count, lower, size, found = contact_apart(
        pair, v, limit, tolerance, work
    )
    n, a, b, distance, gap, _ = found
    if decided_by == _SEPARATED:
        return _far(pair, lower, n)
    unique = True
    if decided_by == _OPEN and (is_overlapping or min(lower, distance) <= NEAR_CONTACT * size):
        known = (is_overlapping, lower, found)
        distance, a, b, n, unique, gap, decided_by = near_contact(
            pair, tolerance, count, work, size, known
        )
    elif decided_by == _OPEN and tolerance == 0.0:
        simplex = Simplex(work.S, work.ids, work.lam, min(count, 3))
        proven, m, x, y, least, by = contact_of_all_features(pair, n, a, b, size, simplex)
        if proven:
            distance, n, a, b, gap, decided_by = least, m, x, y, 0.0, by
    return _finish(pair, distance, a, b, n, unique, gap, decided_by)


@merged_kernel
def _lifted_or_in_full(lifted, pair, limit, tolerance, work):
    """Return the answer of ``convex_distance``, given that of ``lifted_contact``."""
    decided_by, distance, a, b, n, gap = lifted
    if decided_by == _SEPARATED:
        return _far(pair, distance, n)
    if decided_by != _OPEN:
        return _finish(pair, distance, a, b, n, True, gap, decided_by)
    return _in_full(pair, limit, tolerance, work)


@merged_kernel
def convex_distance_in(work, core_A, core_B, R_AB, p_AB, hulls, max_distance, tolerance):
    """Do the same as ``convex_distance`` in a ``Workspace``, sooner for cores of shapes in order.

    More code is compiled for that, and once more for every caller: it is for the loop over all
    pairs of a scene.
    """
    pair = Pair(core_A, core_B, R_AB, p_AB, hulls)
    limit = max_distance + core_A[2] + core_B[2]
    lifted = lifted_contact_by_kind(pair, limit, work)
    return _lifted_or_in_full(lifted, pair, limit, tolerance, work)


@kernel
def convex_distance(core_A, core_B, R_AB, p_AB, hulls, max_distance, tolerance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique, gap, decided by) of two ``cores.kinds``.

    Positions are in A's frame, from its origin (m). ``gap`` is the difference of the upper and
    the lower bound of the distance; the answer is taken as soon as it is at most ``tolerance``
    (m) and the sign is certain, or polished to rounding with 0. An answer of ``lifted_contact`` is
    always exact: it takes no longer than a looser answer. A ``phi`` beyond ``max_distance`` is
    only a lower bound, and comes without witnesses. The deciding algorithm is a ``Mechanism``.
    """
    work = Workspace(np.empty((ROWS, 9)), np.empty((FIRST_FACE, 2), np.int64), np.empty(4))
    pair = Pair(core_A, core_B, R_AB, p_AB, hulls)
    limit = max_distance + core_A[2] + core_B[2]
    lifted = lifted_contact(pair, limit, work)
    return _lifted_or_in_full(lifted, pair, limit, tolerance, work)

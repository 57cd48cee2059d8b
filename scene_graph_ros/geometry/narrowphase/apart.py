"""The distance of cores that are apart: GJK, and its contact refined at ever smaller gaps."""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.contact.refine import refine
from scene_graph_ros.geometry.narrowphase.cores.kinds import ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.questions import is_curved
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.pair import Contact, Simplex
from scene_graph_ros.geometry.narrowphase.propose.gjk import FAR, gjk, OVERLAP, STALLED
from scene_graph_ros.geometry.narrowphase.propose.simplex import simplex_normal, weighted_points
from scene_graph_ros.geometry.spatial.vectors import axpy, dot, norm, subtract
from scene_graph_ros.geometry.tolerances import EPSILON, GJK_ROUNDING, POLISH_RESIDUAL

__all__ = ["contact_apart"]

_OPEN = int(Mechanism.OPEN)
_SEPARATED = int(Mechanism.SEPARATED)
_GJK = int(Mechanism.GJK)
_REFINED = int(Mechanism.REFINED)

FIRST_GAP = 1e-3
"""Relative gap at which GJK's contact of curved cores is first polished; squared each time."""

ATTEMPTS = 4


@lean_kernel
def contact_apart(pair, v, limit, tolerance, work):
    """Run GJK from v and polish its contact.

    Returns (decided by, is overlapping, count, lower, size, contact), with ``count`` rows in the
    last simplex. ``OPEN``: the cores overlap, or the contact could not be proven, and the known
    values are the bounds ``lower``, the separation along n, and the contact's distance.
    ``SEPARATED``: nothing is known but that ``lower`` exceeds the ``limit``. The contact's error
    is the gap of the bounds.
    """
    radius = pair.core_A[2] + pair.core_B[2]
    curved = is_curved(pair.core_A) or is_curved(pair.core_B)
    relative_gap = FIRST_GAP if curved else 0.0
    count = 0
    best = Contact(ORIGIN, ORIGIN, ORIGIN, math.inf, math.inf, 0.0)
    size, best_lower = 0.0, -math.inf
    for _ in range(ATTEMPTS):
        status, count, v, lower, size = gjk(pair, v, count, limit, relative_gap, tolerance, work)
        if status == OVERLAP:
            return _OPEN, True, count, lower, size, best
        simplex = Simplex(work.S, work.ids, work.lam, count)
        n = simplex_normal(simplex, v)
        if status == FAR:
            far = Contact(n, best.a, best.b, math.inf, best.error, 0.0)
            return _SEPARATED, False, count, lower, size, far
        a, b = weighted_points(simplex)
        distance = math.sqrt(dot(v, v))
        gap = distance - lower
        if 0.0 < tolerance >= gap and (lower > radius or distance <= radius):
            return _GJK, False, count, lower, size, Contact(n, a, b, distance, gap, 0.0)
        misfit = norm(axpy(-distance, n, subtract(a, b)))
        is_exact = max(gap / GJK_ROUNDING, misfit / POLISH_RESIDUAL) <= EPSILON * size
        if not curved and is_exact:
            best, best_lower = Contact(n, a, b, distance, gap, 0.0), lower
            break
        proven, found = refine(pair, n, a, b, size, simplex, 1)
        n, a, b, lower = found.n, found.a, found.b, found.distance
        # Where lines of contact cross behind each other, a contact can be proven that overlaps.
        if proven and lower >= -POLISH_RESIDUAL * EPSILON * size:
            return _REFINED, False, count, lower, size, found
        # The witnesses may be nearer to each other than the simplex says, but never further.
        distance = min(distance, abs(lower) + found.error)
        gap = max(found.error, distance - lower)
        # Of slender triangles of points, rounding may make a later simplex a worse one.
        if gap < best.error:
            best, best_lower = Contact(n, a, b, distance, gap, 0.0), lower
        if status == STALLED:
            break
        relative_gap *= relative_gap
    decided_by = _GJK if best.error <= POLISH_RESIDUAL * EPSILON * size else _OPEN
    return decided_by, False, count, best_lower, size, best

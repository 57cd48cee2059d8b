"""A contact of two cores in short: lift one off the other, see where they part, and prove it.

Moved apart along a direction, overlapping cores have a distance, and GJK finds it in a few steps
since it is not small. The features nearest then are most often those of least depth, and the same
for cores that are apart by little. They are polished at the true poses, and the result is taken
only with a proof: the polish' own where the cores are apart, that of ``inner_ball`` where they
overlap. All else is left to GJK and EPA at the true poses.
"""

import math

from scene_graph_ros.geometry.jit import lean_kernel
from scene_graph_ros.geometry.meshes.hull_blocks import SCAN_LIMIT
from scene_graph_ros.geometry.narrowphase.cores import BOX, CYLINDER, HULL, IDENTITY, is_curved
from scene_graph_ros.geometry.narrowphase.gjk import gjk, OVERLAP
from scene_graph_ros.geometry.narrowphase.inner_ball import is_least_depth
from scene_graph_ros.geometry.narrowphase.refine import refine, separation
from scene_graph_ros.geometry.narrowphase.simplex import weighted_points
from scene_graph_ros.geometry.spatial.vectors import axpy, column, dot, norm, scale, unit
from scene_graph_ros.geometry.tolerances import FLAT_MINIMUM

__all__ = ["FOUND", "SEPARATED", "UNKNOWN", "lifted_contact"]

UNKNOWN = 0
FOUND = 1
SEPARATED = 2

LIFT = 0.5
"""How far cores are moved apart, relative to the distance of their origins or to their depth."""

LIFTS = 2
"""The second time, they are lifted along the normal that the first one found."""

FIRST_GUESS = 0.05
"""Relative gap at which the lifted cores' distance tells well enough which features are near."""


@lean_kernel
def _is_simple(core, hulls):
    """Return whether a core's features are few enough to be guessed, and its support is fast."""
    return core[0] != HULL or hulls[core[1]] <= SCAN_LIMIT


@lean_kernel
def _try(core_A, core_B, R, p, hulls, n, distance, best):
    """Return the larger of the known separation and that along the line of n, and its normal."""
    if dot(n, p) > 0.0:
        n = scale(-1.0, n)
    along = separation(core_A, core_B, R, p, hulls, n)
    return (along, n) if along > distance else (distance, best)


@lean_kernel
def _first_direction(core_A, core_B, R, p, hulls):
    """Return (separation, n) of the best of the line of origins and boxes' and cylinders' axes."""
    n = unit(scale(-1.0, p), (1.0, 0.0, 0.0))
    distance = separation(core_A, core_B, R, p, hulls, n)
    for k in range(3):
        if core_A[0] == BOX or (core_A[0] == CYLINDER and k == 2):
            axis = column(IDENTITY, k)
            distance, n = _try(core_A, core_B, R, p, hulls, axis, distance, n)
        if core_B[0] == BOX or (core_B[0] == CYLINDER and k == 2):
            axis = column(R, k)
            distance, n = _try(core_A, core_B, R, p, hulls, axis, distance, n)
    return distance, n


@lean_kernel
def _lift(core_A, core_B, R, p, hulls, n, distance, S, ids, lam):
    """Return (rows in the simplex, its closest point, size), at true poses; no rows: no answer."""
    height = LIFT * max(norm(p), abs(distance))
    shift = max(height - distance, 0.0)
    status, count, v, _, size = gjk(
        core_A,
        core_B,
        R,
        axpy(-shift, n, p),
        hulls,
        scale(height, n),
        0,
        math.inf,
        FIRST_GUESS,
        0.0,
        S,
        ids,
        lam,
    )
    if status == OVERLAP:
        return 0, v, size
    for i in range(count):
        for c in range(3):
            S[i, c] -= shift * n[c]
            S[i, 6 + c] += shift * n[c]
    return count, v, size


@lean_kernel
def lifted_contact(core_A, core_B, R, p, hulls, limit, S, ids, lam):
    """Return (status, distance, a, b, n, error) of two cores, where that is soon proven.

    ``SEPARATED``: the cores are ``distance`` > ``limit`` apart along n, or more in other
    directions. ``FOUND``: the distance is exact to ``error`` (m) and the normal unique.
    ``UNKNOWN``: no more is known than before.
    """
    a = b = (0.0, 0.0, 0.0)
    if not (_is_simple(core_A, hulls) and _is_simple(core_B, hulls)):
        return UNKNOWN, 0.0, a, b, a, math.inf
    distance, n = _first_direction(core_A, core_B, R, p, hulls)
    if distance > limit:
        return SEPARATED, distance, a, b, n, math.inf
    if distance > 0.0 and not (is_curved(core_A) or is_curved(core_B)):
        return UNKNOWN, distance, a, b, n, math.inf  # GJK is exact, and as fast
    for _ in range(LIFTS):
        count, v, size = _lift(core_A, core_B, R, p, hulls, n, distance, S, ids, lam)
        if count == 0:
            break
        a, b = weighted_points(S, lam, count)
        n = unit(v, n)
        if limit < math.inf:
            distance = separation(core_A, core_B, R, p, hulls, n)
            if distance > limit:
                return SEPARATED, distance, a, b, n, math.inf
        proven, n, a, b, distance, error, stiffness = refine(
            core_A, core_B, R, p, hulls, n, a, b, size, S, ids, lam, count, 1
        )
        if proven:
            if distance >= 0.0:
                return FOUND, distance, a, b, n, error
            if stiffness < FLAT_MINIMUM * size:
                break
            if is_least_depth(core_A, core_B, R, p, hulls, a, b, n, -distance, size):
                return FOUND, distance, a, b, n, error
            break
    return UNKNOWN, distance, a, b, n, math.inf

"""Signed distance of any pair of rows of a shape table: which kernel answers for which pair."""

import math

from scene_graph_ros.geometry.jit import inlined_kernel
from scene_graph_ros.geometry.narrowphase.convex_distance import convex_distance
from scene_graph_ros.geometry.narrowphase.cores import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    HULL,
    placed_support,
    POINT,
    SEGMENT,
)
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    column,
    dot,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    transpose,
)

__all__ = ["core_of", "distance_pair"]

SPHERE_KIND = int(ShapeKind.SPHERE)
CAPSULE_KIND = int(ShapeKind.CAPSULE)
BOX_KIND = int(ShapeKind.BOX)
CYLINDER_KIND = int(ShapeKind.CYLINDER)
ELLIPSOID_KIND = int(ShapeKind.ELLIPSOID)
HALF_SPACE_KIND = int(ShapeKind.HALF_SPACE)


@inlined_kernel
def core_of(table, i):
    """Return the core (see ``narrowphase.cores``) of row i; a mesh gives its convex hull."""
    kind = table.kind[i]
    x, y, z = table.size[i, 0], table.size[i, 1], table.size[i, 2]
    if kind == SPHERE_KIND:
        return POINT, -1, x, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if kind == CAPSULE_KIND:
        return SEGMENT, -1, x, (y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    core_kind = HULL
    if kind == BOX_KIND:
        core_kind = BOX
    elif kind == CYLINDER_KIND:
        core_kind = CYLINDER
    elif kind == ELLIPSOID_KIND:
        core_kind = ELLIPSOID
    return core_kind, int(table.hull[i]), 0.0, (x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined_kernel
def _distance_half_space(core, hulls, R_SH, p_SH):
    """Return the distance of a core (frame S) to a half space H, as A = S and B = H."""
    n = column(R_SH, 2)
    a, _ = placed_support(
        core,
        hulls,
        (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        (0.0, 0.0, 0.0),
        scale(-1.0, n),
        -1,
    )
    a = axpy(-core[2], n, a)
    phi = dot(n, subtract(a, p_SH))
    return phi, a, axpy(-phi, n, a), n, True, 0.0


@inlined_kernel
def _distance_ordered(table, i, j, R_AB, p_AB, max_distance):
    """Return the result of ``distance_pair`` for kinds in ``ShapeKind`` order."""
    if table.kind[j] == HALF_SPACE_KIND:
        if table.kind[i] == HALF_SPACE_KIND:
            zero = (0.0, 0.0, 0.0)
            return math.nan, zero, zero, (0.0, 0.0, 1.0), False, 0.0
        return _distance_half_space(core_of(table, i), table.hulls, R_AB, p_AB)
    return convex_distance(
        core_of(table, i), core_of(table, j), R_AB, p_AB, table.hulls, max_distance
    )


@inlined_kernel
def distance_pair(table, i, j, R_AB, p_AB, max_distance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique, gap) of rows i (A) and j (B), in A's frame.

    ``p_ACa - p_ACb = phi nhat_BA_A``; the unit normal points out of B into A, and is ``unique``
    unless it is a choice. ``gap`` bounds the error of phi (m). Where phi is found to exceed
    ``max_distance``, it may be any lower bound above that, without witnesses. Two half spaces
    give phi = nan, the only pair that has no answer.
    """
    swap = table.kind[i] > table.kind[j]
    if table.kind[i] == HALF_SPACE_KIND and table.kind[j] != HALF_SPACE_KIND:
        swap = True
    elif table.kind[j] == HALF_SPACE_KIND:
        swap = False
    if not swap:
        return _distance_ordered(table, i, j, R_AB, p_AB, max_distance)
    R_BA = transpose(R_AB)
    p_BA = scale(-1.0, rotate_inverse(R_AB, p_AB))
    phi, p_BCb, p_BCa, nhat_AB_B, unique, gap = _distance_ordered(
        table, j, i, R_BA, p_BA, max_distance
    )
    p_ACa = add(rotate(R_AB, p_BCa), p_AB)
    p_ACb = add(rotate(R_AB, p_BCb), p_AB)
    return phi, p_ACa, p_ACb, scale(-1.0, rotate(R_AB, nhat_AB_B)), unique, gap

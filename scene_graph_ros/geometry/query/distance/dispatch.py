"""Signed distance of any pair of rows of a shape table: which kernel answers for which pair."""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, merged_kernel
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.narrowphase.convex_distance import convex_distance_in, new_workspace
from scene_graph_ros.geometry.narrowphase.cores.kinds import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    HULL,
    POINT,
    SEGMENT,
)
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.pair import Workspace
from scene_graph_ros.geometry.query.distance.closed_forms import (
    BY_TRIANGLES,
    distance_closed_form,
    HAS_CLOSED_FORM,
)
from scene_graph_ros.geometry.query.distance.distance_convex_mesh import distance_convex_mesh
from scene_graph_ros.geometry.query.distance.distance_mesh_mesh import distance_mesh_mesh
from scene_graph_ros.geometry.query.distance.distance_sphere_mesh import distance_sphere_mesh
from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import (
    load_vector,
)

__all__ = ["are_turned", "core_of", "distance_pair"]

SPHERE_KIND = int(ShapeKind.SPHERE)
HALF_SPACE_KIND = int(ShapeKind.HALF_SPACE)
MESH_KIND = int(ShapeKind.MESH)

_OPEN = int(Mechanism.OPEN)
_CLOSED_FORM = int(Mechanism.CLOSED_FORM)
_TRIANGLES = int(Mechanism.TRIANGLES)

_simplex, _corners, _weights = (stack_array(part.shape, part.dtype) for part in new_workspace())
"""What ``convex_distance_in`` works on, in the machine's stack."""


@inlined_kernel
def _sphere_core(size):
    return POINT, -1, size[0], (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined_kernel
def _capsule_core(size):
    return SEGMENT, -1, size[0], (size[1], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined_kernel
def _box_core(size):
    return BOX, -1, 0.0, (size[0], size[1], size[2], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined_kernel
def _cylinder_core(size):
    return CYLINDER, -1, 0.0, (size[0], size[1], size[2], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined_kernel
def _ellipsoid_core(size):
    return ELLIPSOID, -1, 0.0, (size[0], size[1], size[2], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined_kernel
def _hull_core(table, i, size):
    hull = np.int64(table.hulls.block_start[table.hull[i]])
    return HULL, hull, 0.0, (size[0], size[1], size[2], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined_kernel
def _no_core():
    """All pairs of a half space have closed forms."""
    return POINT, -1, math.nan, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined_kernel
def _size(table, i):
    return load_vector(table.size, i)


@by_kind(
    inlined_kernel,
    ["table.kind[i]"],
    every_kind(
        "cores",
        {
            ShapeKind.SPHERE: _sphere_core,
            ShapeKind.CAPSULE: _capsule_core,
            ShapeKind.BOX: _box_core,
            ShapeKind.CYLINDER: _cylinder_core,
            ShapeKind.ELLIPSOID: _ellipsoid_core,
            ShapeKind.HALF_SPACE: _no_core,
            ShapeKind.CONVEX: _hull_core,
            ShapeKind.MESH: _hull_core,
        },
    ),
    given={"size": _size},
)
def core_of(table, i):
    """Return the core (see ``narrowphase.cores.kinds``) of row i; a mesh gives its convex hull."""


@merged_kernel
def _distance_to_triangles(table, i, j, R_AB, p_AB, max_distance, tolerance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique) for row j a mesh measured by its triangles."""
    if table.kind[i] == SPHERE_KIND:
        size_A = load_vector(table.size, i)
        return distance_sphere_mesh(size_A, R_AB, p_AB, table, j, max_distance)
    if table.exact[i]:
        return distance_mesh_mesh(table, i, j, R_AB, p_AB, max_distance)
    return distance_convex_mesh(table, j, core_of(table, i), R_AB, p_AB, max_distance, tolerance)


@inlined_kernel
def are_turned(table, i, j):
    """Return whether ``distance_pair`` wants row j for A and row i for B.

    Kinds are in ``ShapeKind`` order; a mesh measured by its triangles comes after one measured by
    its hull.
    """
    is_later = table.exact[i] & (table.kind[j] == MESH_KIND) & ~table.exact[j]
    return (table.kind[i] > table.kind[j]) | is_later


@merged_kernel
def distance_pair(table, i, j, R_AB, p_AB, max_distance, tolerance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique, gap, decided by) of rows i (A) and j (B).

    The rows are in the order of ``are_turned``. All in A's frame. ``p_ACa - p_ACb = phi
    nhat_BA_A``; the unit normal points out of B into A, and is ``unique`` unless it is a choice.
    ``gap`` bounds the error of phi (m): at most ``tolerance``, or rounding where that is 0 and for
    all pairs with a closed form. Where phi is found to exceed ``max_distance``, it may be any
    lower bound above that, without witnesses. Two half spaces give phi = nan, the only pair that
    has no answer. The deciding algorithm is a ``Mechanism``.
    """
    kind_A = table.kind[i]
    kind_B = BY_TRIANGLES if table.exact[j] else table.kind[j]
    if kind_A == HALF_SPACE_KIND and kind_B == HALF_SPACE_KIND:
        zero = (0.0, 0.0, 0.0)
        return math.nan, zero, zero, (0.0, 0.0, 1.0), False, 0.0, _OPEN
    if HAS_CLOSED_FORM[kind_A, kind_B]:
        phi, p_ACa, p_ACb, nhat_BA_A, unique = distance_closed_form(
            table, i, j, kind_A, kind_B, R_AB, p_AB, max_distance
        )
        return phi, p_ACa, p_ACb, nhat_BA_A, unique, 0.0, _CLOSED_FORM
    if table.exact[j]:
        phi, p_ACa, p_ACb, nhat_BA_A, unique = _distance_to_triangles(
            table, i, j, R_AB, p_AB, max_distance, tolerance
        )
        return phi, p_ACa, p_ACb, nhat_BA_A, unique, 0.0, _TRIANGLES
    return convex_distance_in(
        Workspace(_simplex(), _corners(), _weights()),
        core_of(table, i),
        core_of(table, j),
        R_AB,
        p_AB,
        table.hulls.blocks,
        max_distance,
        tolerance,
    )

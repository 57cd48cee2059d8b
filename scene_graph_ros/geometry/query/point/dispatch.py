"""Signed distance from a point to any shape: which kernel answers for which kind.

The kinds are those of ``ShapeKind``; kernels compare plain integers. ``Convex`` is measured to
its hull, ``Mesh`` to its triangles.
"""

import math

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.narrowphase.point_ellipsoid import point_ellipsoid
from scene_graph_ros.geometry.query.point.closed_forms import CLOSED_FORMS
from scene_graph_ros.geometry.query.point.point_convex import point_convex
from scene_graph_ros.geometry.query.point.point_mesh import point_mesh
from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import load_vector

__all__ = ["distance_point", "distance_point_within", "point_mesh_within"]


@inlined_kernel
def point_mesh_within(table, i, p_GQ, threshold):
    """Return (phi, p_GN, grad_G, unique) of row i's triangles, exact where phi <= threshold.

    Beyond the threshold, phi may be inf and the rest meaningless.
    """
    is_outside = False
    for axis in range(3):
        is_outside = is_outside or p_GQ[axis] < table.lower[i, axis]
        is_outside = is_outside or p_GQ[axis] > table.upper[i, axis]
    bound = threshold if is_outside else math.inf
    return point_mesh(table.surfaces, table.surface[i], table.scale[i], p_GQ, bound)


@inlined_kernel
def _point_convex(table, i, p_GQ):
    return point_convex(table.hulls, table.hull[i], table.scale[i], p_GQ)


@inlined_kernel
def _size(table, i):
    return load_vector(table.size, i)


POINT_KERNELS = {
    **CLOSED_FORMS,
    ShapeKind.ELLIPSOID: point_ellipsoid,
    ShapeKind.CONVEX: _point_convex,
}


@by_kind(
    inlined_kernel,
    ["table.kind[i]"],
    every_kind("distances of points", {**POINT_KERNELS, ShapeKind.MESH: point_mesh_within}),
    given={"size": _size},
)
def distance_point_within(table, i, p_GQ, threshold):
    """Return (phi, p_GN, grad_G, unique) as ``distance_point``, exact where phi <= threshold.

    Beyond the threshold, phi may be inf and the rest meaningless.
    """


@inlined_kernel
def distance_point(table, i, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of row i of the shape table and a point Q in its frame.

    ``phi`` is the signed distance in metres, negative inside, ``p_GN`` the nearest point of the
    surface and ``grad_G`` the gradient of phi, always a unit vector, so that
    ``p_GQ - p_GN = phi * grad_G``. Where the nearest point is not unique, or the gradient is a
    choice, ``unique`` is False and each kernel states its choice.
    """
    return distance_point_within(table, i, p_GQ, math.inf)

"""How far a distance can be off, found from the answer alone, for any pair and any algorithm."""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.contact.refine import separation
from scene_graph_ros.geometry.narrowphase.pair import Pair
from scene_graph_ros.geometry.query.distance.dispatch import core_of
from scene_graph_ros.geometry.query.point.dispatch import distance_point
from scene_graph_ros.geometry.query.point.point_convex import point_convex
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    column,
    dot,
    load_rotation,
    load_translation,
    load_vector,
    norm,
    relative_pose,
    rotate,
    rotate_inverse,
    scale,
    subtract,
)

__all__ = ["certify_pairs"]

_HALF_SPACE = int(ShapeKind.HALF_SPACE)
_MESH = int(ShapeKind.MESH)


@inlined_kernel
def _gap_to_half_space(core, hulls, R, p, up, height):
    """Return the height of a core's lowest point, with its radius, above up . x = height.

    ``R``, ``p`` place the core, in the frame of ``up``, a unit vector.
    """
    at_plane = (0, -1, 0.0, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    level = separation(Pair(at_plane, core, R, p, hulls), scale(-1.0, up))
    return level - core[2] - height


@inlined_kernel
def _separation(table, i, j, R_AB, p_AB, n):
    """Return the gap between rows i (A) and j (B) along n, a lower bound of their distance."""
    hulls = table.hulls.blocks
    identity = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    if table.kind[j] == _HALF_SPACE:
        up = column(R_AB, 2)
        core = core_of(table, i)
        return _gap_to_half_space(core, hulls, identity, (0.0, 0.0, 0.0), up, dot(up, p_AB))
    if table.kind[i] == _HALF_SPACE:
        return _gap_to_half_space(core_of(table, j), hulls, R_AB, p_AB, (0.0, 0.0, 1.0), 0.0)
    core_A, core_B = core_of(table, i), core_of(table, j)
    return separation(Pair(core_A, core_B, R_AB, p_AB, hulls), n) - core_A[2] - core_B[2]


@lean_kernel
def _outside(table, i, p_GQ):
    """Return the distance of a point outside of row i, 0 inside."""
    if table.kind[i] == _MESH and not table.exact[i]:
        phi, _, _, _ = point_convex(table.hulls, table.hull[i], table.scale[i], p_GQ)
    else:
        phi, _, _, _ = distance_point(table, i, p_GQ)
    return max(phi, 0.0)


@lean_kernel
def certify_pairs(table, X_WG, rows, phi, p_ACa, p_BCb, nhat_BA_W, gap):
    """Raise each pair's ``gap`` (m) to the bound that its answer itself proves.

    That is ``|p_Ca - p_Cb - s nhat|``, with s the separation of the shapes' support points along
    the normal, and the distance of each witness from its shape. Apart, s and the witnesses bound
    the distance from below and above, so this bounds the error. Overlapping, it proves that a
    translation of A by the depth along the normal ends it; that no other way is shorter is told by
    the iterations' own ``gap``, which is kept where it is larger. Meshes measured by their
    triangles have no such bound: for s their distance itself is taken, so that only the
    witnesses are checked.
    """
    for k in range(rows.shape[0]):
        i, j = rows[k, 0], rows[k, 1]
        R_WA = load_rotation(X_WG, i)
        R_AB, p_AB = relative_pose(
            R_WA, load_translation(X_WG, i), load_rotation(X_WG, j), load_translation(X_WG, j)
        )
        n = rotate_inverse(R_WA, load_vector(nhat_BA_W, k))
        a, b = load_vector(p_ACa, k), load_vector(p_BCb, k)
        rest = subtract(a, add(rotate(R_AB, b), p_AB))
        s = phi[k]
        if not (table.exact[i] or table.exact[j]):
            s = _separation(table, i, j, R_AB, p_AB, n)
        error = norm(axpy(-s, n, rest)) + _outside(table, i, a) + _outside(table, j, b)
        gap[k] = max(gap[k], error)

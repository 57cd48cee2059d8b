"""The contact of two features that are known: those where ``other_depths`` found a depth."""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.all_features import is_beyond_face
from scene_graph_ros.geometry.narrowphase.cores import corners
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY, ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.questions import (
    edge_feature,
    face_feature,
    side,
    touched,
    vertex_of,
)
from scene_graph_ros.geometry.narrowphase.features import NONE, VERTEX
from scene_graph_ros.geometry.narrowphase.other_depths import (
    ARC,
    are_swapped,
    FACE_OF_P,
    PLANE_OF_Q,
)
from scene_graph_ros.geometry.narrowphase.polytope_rows import LAST
from scene_graph_ros.geometry.narrowphase.refine import contact
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    norm,
    rotate,
    scale,
    subtract,
)
from scene_graph_ros.geometry.tolerances import EPSILON, POLISH_RESIDUAL, TIE

__all__ = ["contact_of_known"]


@lean_kernel
def _features(core_P, R_P, p_P, core_Q, R_Q, p_Q, hulls, d, where, index, tie, S):
    """Return the features of P and Q where they touch along d, out of P."""
    if where == FACE_OF_P:
        return (
            face_feature(core_P, R_P, p_P, hulls, index, d),
            touched(core_Q, hulls, R_Q, p_Q, scale(-1.0, d), tie),
        )
    if where == PLANE_OF_Q:
        return (
            touched(core_P, hulls, R_P, p_P, d, tie),
            face_feature(core_Q, R_Q, p_Q, hulls, index, scale(-1.0, d)),
        )
    if where == ARC:
        x, y = (S[LAST, 0], S[LAST, 1], S[LAST, 2]), (S[LAST, 3], S[LAST, 4], S[LAST, 5])
        other = side(core_Q, R_Q, p_Q)
        has_side = other[0] != NONE
        if (has_side and not x[2] * y[2] < 0.0) or (not has_side and norm(subtract(x, y)) <= tie):
            other = touched(core_Q, hulls, R_Q, p_Q, scale(-1.0, d), tie)
        elif not has_side:
            other = corners.line(add(rotate(R_Q, x), p_Q), add(rotate(R_Q, y), p_Q))
        return edge_feature(core_P, R_P, p_P, hulls, index), other
    corner = vertex_of(core_P, R_P, p_P, hulls, index)
    return (
        (VERTEX, corner, ORIGIN, 0.0, 0.0, 0.0),
        side(core_Q, R_Q, p_Q),
    )


@lean_kernel
def contact_of_known(core_A, core_B, R, p, hulls, n, where, index, size, S, ids):
    """Return (is proven, n, a, b, distance, error, stiffness) as ``refine`` does.

    n, ``where`` and ``index`` are what ``look_for_less`` returned, with its workspace S.
    """
    tie = TIE * EPSILON * size
    if are_swapped(core_A, core_B, hulls):
        feature_B, feature_A = _features(
            core_B, R, p, core_A, IDENTITY, ORIGIN, hulls, n, where, index, tie, S
        )
    else:
        out = scale(-1.0, n)
        feature_A, feature_B = _features(
            core_A, IDENTITY, ORIGIN, core_B, R, p, hulls, out, where, index, tie, S
        )
    if feature_A[0] == NONE or feature_B[0] == NONE:
        return False, n, ORIGIN, ORIGIN, 0.0, math.inf, 0.0
    allowed = POLISH_RESIDUAL * EPSILON * size
    n, stiffness, _, _, a, b, distance, error = contact(
        feature_A, feature_B, core_A, core_B, R, p, hulls, n, ORIGIN, p, size, S, ids, 1
    )
    proven = (
        error <= allowed
        and not is_beyond_face(hulls, feature_A, IDENTITY, ORIGIN, a, allowed)
        and not is_beyond_face(hulls, feature_B, R, p, b, allowed)
    )
    return proven, n, a, b, distance, error, stiffness

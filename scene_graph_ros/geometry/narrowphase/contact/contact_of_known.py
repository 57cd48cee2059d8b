"""The contact of two known features: those where ``critical_directions`` found a depth."""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.contact.hull_border import is_beyond_face
from scene_graph_ros.geometry.narrowphase.contact.refine import contact
from scene_graph_ros.geometry.narrowphase.cores import corners
from scene_graph_ros.geometry.narrowphase.cores.kinds import ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.questions import (
    edge_feature,
    face_feature,
    side,
    touched,
    vertex_of,
)
from scene_graph_ros.geometry.narrowphase.features import NONE, VERTEX
from scene_graph_ros.geometry.narrowphase.pair import body_A, body_B, Contact, Simplex
from scene_graph_ros.geometry.narrowphase.prove.critical_directions import (
    ARC,
    are_swapped,
    FACE_OF_P,
    PLANE_OF_Q,
)
from scene_graph_ros.geometry.narrowphase.prove.polytope_faces import LAST
from scene_graph_ros.geometry.spatial.vectors import add, norm, rotate, scale, subtract
from scene_graph_ros.geometry.tolerances import EPSILON, POLISH_RESIDUAL, TIE

__all__ = ["contact_of_known"]


@lean_kernel
def _features(P, Q, hulls, d, where, index, tie, S):
    """Return the features of the placed cores P and Q where they touch along d, out of P."""
    if where == FACE_OF_P:
        return (
            face_feature(P, hulls, index, d),
            touched(Q, hulls, scale(-1.0, d), tie),
        )
    if where == PLANE_OF_Q:
        return (
            touched(P, hulls, d, tie),
            face_feature(Q, hulls, index, scale(-1.0, d)),
        )
    if where == ARC:
        x, y = (S[LAST, 0], S[LAST, 1], S[LAST, 2]), (S[LAST, 3], S[LAST, 4], S[LAST, 5])
        other = side(Q)
        has_side = other[0] != NONE
        if (has_side and not x[2] * y[2] < 0.0) or (not has_side and norm(subtract(x, y)) <= tie):
            other = touched(Q, hulls, scale(-1.0, d), tie)
        elif not has_side:
            other = corners.line(add(rotate(Q.R, x), Q.p), add(rotate(Q.R, y), Q.p))
        return edge_feature(P, hulls, index), other
    corner = vertex_of(P, hulls, index)
    return (
        (VERTEX, corner, ORIGIN, 0.0, 0.0, 0.0),
        side(Q),
    )


@lean_kernel
def contact_of_known(pair, n, where, index, size, work):
    """Return (is proven, contact) as ``refine`` does.

    n, ``where`` and ``index`` are the answer of ``least_depth``, with its workspace.
    """
    A, B, hulls = body_A(pair), body_B(pair), pair.hulls
    tie = TIE * EPSILON * size
    if are_swapped(pair):
        feature_B, feature_A = _features(B, A, hulls, n, where, index, tie, work.S)
    else:
        out = scale(-1.0, n)
        feature_A, feature_B = _features(A, B, hulls, out, where, index, tie, work.S)
    if feature_A[0] == NONE or feature_B[0] == NONE:
        return False, Contact(n, ORIGIN, ORIGIN, 0.0, math.inf, 0.0)
    allowed = POLISH_RESIDUAL * EPSILON * size
    simplex = Simplex(work.S, work.ids, work.lam, 1)
    found = contact(feature_A, feature_B, pair, n, ORIGIN, pair.p, size, simplex)
    proven = (
        found.error <= allowed
        and not is_beyond_face(A, hulls, feature_A, found.a, allowed)
        and not is_beyond_face(B, hulls, feature_B, found.b, allowed)
    )
    return proven, found

"""The contact of two features that are known: those where ``other_depths`` found a depth."""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.all_features import is_beyond_face
from scene_graph_ros.geometry.narrowphase.cores import box, cylinder
from scene_graph_ros.geometry.narrowphase.cores.kinds import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    HULL,
    IDENTITY,
    ORIGIN,
    SEGMENT,
)
from scene_graph_ros.geometry.narrowphase.cores.questions import placed_support, vertex_of
from scene_graph_ros.geometry.narrowphase.features import FACE, LINE, NONE, RIM, SMOOTH, VERTEX
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
    axpy,
    column,
    dot,
    norm,
    rotate,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tables.hull_blocks import (
    edge_range,
    EDGE_STRIDE,
    face_range,
    FACE_STRIDE,
    vertex,
)
from scene_graph_ros.geometry.tolerances import EPSILON, POLISH_RESIDUAL, TIE

__all__ = ["contact_of_known"]

_NONE = (NONE, ORIGIN, ORIGIN, 0.0, 0.0, 0.0)


@lean_kernel
def _line(a, b):
    """Return the edge between two points."""
    e = subtract(b, a)
    half = 0.5 * norm(e)
    return LINE, axpy(0.5, e, a), unit(e, ORIGIN), 0.0, -half, half


@lean_kernel
def _face(core, R, p, hulls, f, d):
    """Return the face f of a polytope, or the end of a cylinder that faces along d."""
    if core[0] == CYLINDER:
        return cylinder.feature(core, R, p, FACE, dot(column(R, 2), d) > 0.0)
    if core[0] == BOX:
        k = f // 2
        s = -1.0 if f & 1 else 1.0
        return box.feature(core, R, p, k != 0, k != 1, k != 2, (s, s, s))
    if core[0] == HULL:
        at = face_range(hulls, core[1])[0] + FACE_STRIDE * f
        c = int(hulls[int(hulls[at + 4]) + 1])
        c = add(rotate(R, vertex(hulls, c)), p)
        e = rotate(R, (hulls[at], hulls[at + 1], hulls[at + 2]))
        return FACE, c, e, 0.0, at + 1.0, 0.0
    return _NONE


@lean_kernel
def _edge(core, R, p, hulls, k):
    """Return the edge k of a polytope."""
    if core[0] == BOX:
        i = k // 4
        s, t = -1.0 if k & 1 else 1.0, -1.0 if k & 2 else 1.0
        if i == 0:
            return box.feature(core, R, p, True, False, False, (0.0, s, t))
        if i == 1:
            return box.feature(core, R, p, False, True, False, (t, 0.0, s))
        return box.feature(core, R, p, False, False, True, (s, t, 0.0))
    if core[0] == HULL:
        e = edge_range(hulls, core[1])[0] + EDGE_STRIDE * k
        a, b = int(hulls[e]), int(hulls[e + 3])
        return _line(
            add(rotate(R, vertex(hulls, a)), p),
            add(rotate(R, vertex(hulls, b)), p),
        )
    half = core[3][0]
    return LINE, p, column(R, 2), 0.0, -half, half


@lean_kernel
def _beside(core, R, p, hulls, d, tie):
    """Return the feature that a plane or an edge touches, outward d: a corner, a rim, a side."""
    if core[0] == ELLIPSOID:
        return SMOOTH, p, ORIGIN, 0.0, 0.0, 0.0
    if core[0] == CYLINDER:
        along = dot(column(R, 2), d)
        if abs(along) * core[3][1] <= tie:
            return cylinder.feature(core, R, p, LINE, True)
        return cylinder.feature(core, R, p, RIM, along > 0.0)
    x, _ = placed_support(core, hulls, R, p, d, -1)
    return VERTEX, x, ORIGIN, 0.0, 0.0, 0.0


@lean_kernel
def _features(core_P, R_P, p_P, core_Q, R_Q, p_Q, hulls, d, where, index, tie, S):
    """Return the features of P and Q where they touch along d, out of P."""
    if where == FACE_OF_P:
        if core_P[0] == SEGMENT:  # its faces are directions on the arc around it
            touching = _edge(core_P, R_P, p_P, hulls, 0)
        else:
            touching = _face(core_P, R_P, p_P, hulls, index, d)
        return (
            touching,
            _beside(core_Q, R_Q, p_Q, hulls, scale(-1.0, d), tie),
        )
    if where == PLANE_OF_Q:
        return (
            _beside(core_P, R_P, p_P, hulls, d, tie),
            _face(core_Q, R_Q, p_Q, hulls, index, scale(-1.0, d)),
        )
    if where == ARC:
        x, y = (S[LAST, 0], S[LAST, 1], S[LAST, 2]), (S[LAST, 3], S[LAST, 4], S[LAST, 5])
        if core_Q[0] == CYLINDER and x[2] * y[2] < 0.0:
            other = cylinder.feature(core_Q, R_Q, p_Q, LINE, True)
        elif core_Q[0] == CYLINDER or norm(subtract(x, y)) <= tie:
            other = _beside(core_Q, R_Q, p_Q, hulls, scale(-1.0, d), tie)
        else:
            other = _line(add(rotate(R_Q, x), p_Q), add(rotate(R_Q, y), p_Q))
        return _edge(core_P, R_P, p_P, hulls, index), other
    corner = vertex_of(core_P, R_P, p_P, hulls, index)
    return (
        (VERTEX, corner, ORIGIN, 0.0, 0.0, 0.0),
        cylinder.feature(core_Q, R_Q, p_Q, LINE, True),
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

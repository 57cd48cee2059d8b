"""Exact depth of a polytope in another, a cylinder or an ellipsoid, by all critical directions.

The depth of P and Q along a unit vector d out of P is D(d) = h_P(d) + h_Q(-d), with the support
functions h. Where P is a polytope, its faces' normals divide the sphere: along the arc between the
normals of two faces that share an edge, P's support point is a point of the edge; within the arcs
around a vertex it is the vertex. So the least depth is found

* at the normal of a face of P, or of one of Q (a plane of Q against a vertex of P), or
* on an arc, where D is bounded from below by the planes through support points of C = {a - b}, as
  in the expanding polytope algorithm, but in one dimension, or
* within the arcs around a vertex, along which that leaves Q the soonest: across a cylinder's side
  that is in closed form, and inside an ellipsoid but for a root.

Faces, planes and vertices are looked at eight at a time. Most arcs need no more than the support
points at their ends.

A pair is (Q, P), and everything in Q's frame.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    any_of,
    as_lanes,
    every,
    LANES,
    lowest_bit,
    select,
)
from scene_graph_ros.geometry.narrowphase.cores.kinds import (
    CORNERS_ACROSS_SIDE,
    CORNERS_OF_ELLIPSOID,
    CORNERS_UNKNOWN,
)
from scene_graph_ros.geometry.narrowphase.cores.lane_roots import inverse_root
from scene_graph_ros.geometry.narrowphase.cores.questions import (
    corner_ways,
    edge_count,
    edge_of,
    face_count,
    is_curved,
    lane_planes,
    lane_support,
    lane_vertices,
    plane_count,
    side,
    support,
    vertex_count,
)
from scene_graph_ros.geometry.narrowphase.pair import body_A, body_B, swapped
from scene_graph_ros.geometry.narrowphase.prove.polytope_faces import (
    LAST,
    normal_at,
    place_of_face,
    point_at,
    store_faces,
)
from scene_graph_ros.geometry.narrowphase.prove.vertices_in_ellipsoid import are_vertices_deeper
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    dot,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tables.vertex_scan import lane_of_largest, NUMBERS
from scene_graph_ros.geometry.tolerances import EPSILON, NEIGHBORHOOD, TIE

__all__ = [
    "ARC",
    "FACE_OF_P",
    "LESS",
    "NONE_LESS",
    "PLANE_OF_Q",
    "SIDE_OF_Q",
    "UNDECIDED",
    "are_polytopes_or_cylinders",
    "are_swapped",
    "least_depth",
]

NONE_LESS = 0
LESS = 1
UNDECIDED = 2

FACE_OF_P = 0
PLANE_OF_Q = 1
SIDE_OF_Q = 2
ARC = 3
"""Where a direction comes from: a face of P, one of Q or a cylinder's end, a vertex of P against a
cylinder's side, an edge of P."""

MAX_CUTS = 192
"""Parts of an arc that are looked at. Each cut halves what is left around a minimum, or more."""

CHUNK = 32
"""So many arcs are looked at before those with room for less are gone through."""

SLACK = 1e3
"""In units of a tie: what is left open around the least depth on a curved body, as no bound ever
reaches it."""


@lean_kernel
def _better(best, depth, d, where, index, tie):
    """Return the state after D(d) = depth: (status, least depth, its direction, place)."""
    _, least, known, _, _ = best
    if depth >= least + tie:
        return best
    if depth < least - tie or not dot(known, known) > 0.0:
        return LESS, depth, d, where, index
    if dot(d, known) > NEIGHBORHOOD:
        return best
    return UNDECIDED, least, known, where, index


@inlined_kernel
def _best_of(best, depths, d, where, first, tie):
    """Return the state after the depths D in lanes of directions d, from the least on."""
    lanes = as_lanes(NUMBERS)
    depths = select(depths < best[1] + tie, depths, every(math.inf))
    while any_of(depths < best[1] + tie):
        k = lane_of_largest(-depths)
        best = _better(best, depths[k], (d[0][k], d[1][k], d[2][k]), where, first + k, tie)
        depths = select(lanes == float(k), every(math.inf), depths)
    return best


@inlined_kernel
def _visit_faces(pair, best, tie, S):
    """Write down P's faces; return the state."""
    core_Q, (core_P, R, p), hulls = pair.core_A, body_B(pair), pair.hulls
    for first in range(0, face_count(core_P, hulls), LANES):
        out, offset = lane_planes(core_P, hulls, first)
        d = rotate(R, out)
        offset = offset + dot(p, d)
        q = lane_support(core_Q, hulls, scale(-1.0, d))
        depths = offset - dot(q, d)
        store_faces(S, first, d, q)
        best = _best_of(best, depths, d, FACE_OF_P, first, tie)
    return best


@inlined_kernel
def _has_room(S, v, near, far, enough):
    """Return whether the planes through Q's support points at its ends leave an arc room for less.

    v is a point of the edge, near and far are places of its faces; see ``_visit_arc``.
    """
    d, q, e, x = normal_at(S, near), point_at(S, near), normal_at(S, far), point_at(S, far)
    w, rest = subtract(v, q), subtract(x, q)
    along_d, along_e = dot(rest, d), dot(rest, e)
    lower = along_d * dot(w, e) - along_e * dot(w, d)
    square = along_d * along_d + along_e * along_e - 2.0 * along_d * along_e * dot(d, e)
    return (lower < 0.0) | (lower * lower < enough * abs(enough) * square)


@inlined_kernel
def _visit_arc(pair, v, edge, best, tie, S):
    """Return the state after the arc of an ``edge``: (index, places of its faces).

    v is a point of the edge. Between two directions on the arc with support points w of C, D is
    at least the smaller of its values there and of w . m, where m is the direction in which both
    points are as far: as long as it is positive, w . d is a concave function of the angle. If the
    arc has the least depth, the row before the faces gets the two points of Q on either side of
    it: the ends of an edge of Q, or of a line on a cylinder's side, if that is touched.
    """
    core_Q, hulls = pair.core_A, pair.hulls
    index, near, far = edge
    d = normal_at(S, near)
    w = subtract(v, point_at(S, near))
    e, x = normal_at(S, far), point_at(S, far)
    for c in range(3):
        S[0, c] = e[c]
        S[0, 3 + c] = x[c]
    is_smooth = is_curved(core_Q)
    top = 0
    for _ in range(MAX_CUTS):
        e = (S[top, 0], S[top, 1], S[top, 2])
        x = subtract(v, (S[top, 3], S[top, 4], S[top, 5]))
        rest = subtract(w, x)
        m = axpy(-dot(rest, e), d, scale(dot(rest, d), e))
        lower, square = dot(w, m), dot(m, m)  # of these, lower is times the length of m
        enough = best[1] + tie
        if is_smooth and dot(d, best[2]) > NEIGHBORHOOD and dot(e, best[2]) > NEIGHBORHOOD:
            enough = best[1] - SLACK * tie
        if lower < 0.0 or lower * lower < enough * abs(enough) * square:
            q, _ = support(core_Q, hulls, scale(-1.0, m))
            m = unit(m, d)
            depth = dot(subtract(v, q), m)
            is_exact = depth <= dot(w, m) + tie  # then nothing between is less than at m
            best = _better(best, depth, m, ARC, index, tie)
            if best[0] == LESS and best[1] == depth:
                for c in range(3):
                    S[LAST, c] = v[c] - w[c]
                    S[LAST, 3 + c] = v[c] - x[c]
            if best[1] < 0.0:
                return best
            if not is_exact:
                top += 1
                if top == LAST:
                    break
                for c in range(3):
                    S[top, c] = m[c]
                    S[top, 3 + c] = q[c]
                continue
        d, w = e, x
        top -= 1
        if top < 0:
            return best
    return UNDECIDED, best[1], best[2], ARC, index


@inlined_kernel
def _visit_arcs(pair, best, tie, S):
    """Return the state after the arcs that have room for less."""
    core_P, hulls = pair.core_B, pair.hulls
    count = edge_count(core_P, hulls)
    for first in range(0, count, CHUNK):
        bits = 0
        for k in range(first, min(first + CHUNK, count)):
            near, far, v = edge_of(body_B(pair), hulls, k)
            has_room = _has_room(S, v, place_of_face(near), place_of_face(far), best[1] + tie)
            bits |= int(has_room) << (k - first)
        while bits != 0 and best[1] >= 0.0:
            k = first + lowest_bit(bits)
            bits &= bits - 1
            near, far, v = edge_of(body_B(pair), hulls, k)
            edge = (k, place_of_face(near), place_of_face(far))
            best = _visit_arc(pair, v, edge, best, tie, S)
    return best


@inlined_kernel
def _visit_planes(pair, best, tie):
    """Return the state after the planes of Q: faces, or the ends of a cylinder."""
    core_Q, (core_P, R, p), hulls = pair.core_A, body_B(pair), pair.hulls
    for first in range(0, plane_count(core_Q, hulls), LANES):
        out, offset = lane_planes(core_Q, hulls, first)
        d = scale(-1.0, out)
        e = rotate_inverse(R, d)
        depths = offset + dot(d, p) + dot(e, lane_support(core_P, hulls, e))
        best = _best_of(best, depths, d, PLANE_OF_Q, first, tie)
    return best


@inlined_kernel
def _visit_side(pair, best, tie):
    """Return the state after the directions across a cylinder Q in which vertices leave it."""
    (core_P, R, p), hulls = body_B(pair), pair.hulls
    radius = side(body_A(pair))[3]
    count = vertex_count(core_P, hulls)
    for first in range(0, count, LANES):
        v = add(rotate(R, lane_vertices(core_P, hulls, first)), p)
        across = v[0] * v[0] + v[1] * v[1]
        room = radius - best[1] - tie
        if room <= 0.0 or any_of(across > room * room):
            inverse = inverse_root(across)
            x, y = -inverse * v[0], -inverse * v[1]
            d = (select(across > 0.0, x, every(1.0)), y, every(0.0))
            e = rotate_inverse(R, d)
            depths = dot(d, p) + dot(e, lane_support(core_P, hulls, e)) + radius
            depths = select(as_lanes(NUMBERS) < float(count - first), depths, every(math.inf))
            best = _best_of(best, depths, d, SIDE_OF_Q, first, tie)
    return best


@inlined_kernel
def _look(pair, y, least, known, tie, S):
    """Return the state about a polytope P; y is Q's witness, ``known`` points out of P."""
    core_Q, hulls = pair.core_A, pair.hulls
    best = (NONE_LESS, least, known, FACE_OF_P, 0)
    best = _visit_faces(pair, best, tie, S)
    best = _visit_planes(pair, best, tie)
    ways = corner_ways(core_Q, hulls)
    if ways == CORNERS_ACROSS_SIDE:
        best = _visit_side(pair, best, tie)
    best = _visit_arcs(pair, best, tie, S)  # none if they are apart
    if (
        best[0] == NONE_LESS
        and ways == CORNERS_OF_ELLIPSOID
        and not are_vertices_deeper(pair, y, least, known, tie)
    ):
        return UNDECIDED, least, known, FACE_OF_P, 0
    return best


@inlined_kernel
def are_swapped(pair):
    """Return whether B is taken for P, as the only polytope, or the one with fewer edges."""
    edges_A, edges_B = edge_count(pair.core_A, pair.hulls), edge_count(pair.core_B, pair.hulls)
    return edges_A == 0 or 0 < edges_B < edges_A


@inlined_kernel
def are_polytopes_or_cylinders(pair):
    """Return whether all directions of a pair can be looked through without knowing a contact."""
    core_A, core_B, hulls = pair.core_A, pair.core_B, pair.hulls
    edges_A, edges_B = edge_count(core_A, hulls), edge_count(core_B, hulls)
    ways_A, ways_B = corner_ways(core_A, hulls), corner_ways(core_B, hulls)
    if ways_B == CORNERS_ACROSS_SIDE:
        return edges_A > 0
    return edges_B > 0 and (edges_A > 0 or ways_A == CORNERS_ACROSS_SIDE)


@inlined_kernel
def least_depth(pair, a, b, n, depth, size, S):
    """Look for another direction m out of B into A that is no deeper than ``depth`` > 0.

    a, b, n: the witnesses and the normal of a stationary depth; with n = 0, any direction is
    another one, and a and b are any points of the cores. Returns (status, m, where, index).
    ``NONE_LESS``: there is no other. ``LESS``: along m it is the least of all, or negative; the
    features there are told by ``where`` and their index. ``UNDECIDED``: two directions are as
    deep to rounding, or these cores are none that are looked through here: one must be a polytope
    that is not large, the other that, too, or a cylinder or an ellipsoid. ``S`` is overwritten.
    """
    is_B = are_swapped(pair)
    pair_QP, y, out = pair, a, n
    if not is_B:
        pair_QP = swapped(pair)
        y = rotate_inverse(pair.R, subtract(b, pair.p))
        out = scale(-1.0, rotate_inverse(pair.R, n))
    no_polytope = edge_count(pair_QP.core_B, pair.hulls) == 0
    if no_polytope or corner_ways(pair_QP.core_A, pair.hulls) == CORNERS_UNKNOWN:
        return UNDECIDED, n, FACE_OF_P, 0
    tie = TIE * EPSILON * size
    status, _, d, where, index = _look(pair_QP, y, depth, out, tie, S)
    return status, d if is_B else scale(-1.0, rotate(pair.R, d)), where, index

"""Is a depth the least of all? All directions where another one could be, visited one by one.

The depth of P and Q along a unit vector d out of P is D(d) = h_P(d) + h_Q(-d), with the support
functions h. Where P is a polytope, its faces' normals divide the sphere: along the arc between the
normals of two faces that share an edge, P's support point is a point of the edge; within the arcs
around a vertex it is the vertex. So the least depth is found

* at the normal of a face of P, or of one of Q (a plane of Q against a vertex of P), or
* on an arc, where D is bounded from below by the planes through support points of C = {a - b}, as
  in the expanding polytope algorithm, but in one dimension, or
* within the arcs around a vertex, along which that leaves Q the soonest: across a cylinder's side
  that is in closed form; inside an ellipsoid there are bounds.

Most faces and arcs need no support point: a point c of Q that is r below two faces proves that D
is at least r at both and on the arc between them.

Everything is in Q's frame. Takes a tenth of the time of an expanding polytope, and proves as much.
"""

import math

from scene_graph_ros.geometry.jit import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.meshes.hull_blocks import (
    edge_range,
    EDGE_STRIDE,
    face_range,
    FACE_STRIDE,
    HEADER,
    SCAN_LIMIT,
    STRIDE,
)
from scene_graph_ros.geometry.narrowphase.cores import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    HULL,
    IDENTITY,
    ORIGIN,
    placed_support,
    SEGMENT,
    support,
)
from scene_graph_ros.geometry.narrowphase.inner_ball import inner_radius
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    any_orthogonal,
    axpy,
    column,
    cross,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    transpose,
    unit,
)
from scene_graph_ros.geometry.tolerances import EPSILON, NEIGHBORHOOD, SAME_DIRECTION, TIE

__all__ = [
    "ARC",
    "FACE_OF_P",
    "FIRST_FACE",
    "LAST",
    "LESS",
    "MAX_FACES",
    "NONE_LESS",
    "PLANE_OF_Q",
    "SIDE_OF_Q",
    "UNDECIDED",
    "are_polytopes_or_cylinders",
    "are_swapped",
    "look_for_less",
    "vertex_of",
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

FIRST_FACE = 36
"""The row of the workspace where faces begin; before it is a stack of directions on an arc, or of
spherical triangles, three rows each."""

LAST = FIRST_FACE - 1

MAX_FACES = 2 * SCAN_LIMIT - 4
"""A hull that is scanned has no more (Euler)."""

MAX_CUTS = 64
"""Directions tried on an arc. Each halves what is left around a minimum, or more."""

SLACK = 1e5
"""In units of a tie: what is left open around the least depth, which no bound ever reaches."""

MAX_CLIMBS = 6
"""Newton's steps to a bound of a distance; they gain little after three."""

MAX_HALVES = 48
"""Parts of a spherical triangle that are looked at."""

DEPTH = 6
BELOW = 7
BELOW_CENTRE = 8
"""Columns of a row: the direction, Q's support point against it, D (infinite: not visited), and
how far Q's witness and Q's centre are below the face."""


@lean_kernel
def _edges(core, hulls):
    """Return how many edges a polytope has, 0 for what is none or has too many."""
    if core[0] == SEGMENT:
        return 4
    if core[0] == BOX:
        return 12
    if core[0] == HULL and hulls[core[1]] <= SCAN_LIMIT:
        first, last = edge_range(hulls, core[1])
        return (last - first) // EDGE_STRIDE
    return 0


@lean_kernel
def _faces(core, hulls):
    """Return how many faces a polytope has; a segment has four directions around it instead."""
    if core[0] == HULL:
        return int(hulls[core[1] + 1])
    return 6 if core[0] == BOX else 4


@lean_kernel
def _face(core, R, p, hulls, f):
    """Return (outward normal, offset from the origin) of a polytope's face f."""
    if core[0] == HULL:
        k = face_range(hulls, core[1])[0] + FACE_STRIDE * f
        d = rotate(R, (hulls[k], hulls[k + 1], hulls[k + 2]))
        return d, hulls[k + 3] + dot(p, d)
    if core[0] == BOX:
        d = column(R, f // 2)
        if f & 1:
            d = scale(-1.0, d)
        return d, core[3][f // 2] + dot(p, d)
    axis = column(R, 2)
    d = any_orthogonal(axis)
    if f & 1:
        d = cross(axis, d)
    if f & 2:
        d = scale(-1.0, d)
    return d, dot(p, d)


@lean_kernel
def _edge(core, R, p, hulls, k):
    """Return (row of one face, row of the other, a point of the edge they share) of edge k."""
    if core[0] == SEGMENT:
        return FIRST_FACE + k, FIRST_FACE + (k + 1) % 4, p
    if core[0] == BOX:
        i, j = (k // 4 + 1) % 3, (k // 4 + 2) % 3
        h = core[3]
        v = axpy(-h[i] if k & 1 else h[i], column(R, i), p)
        v = axpy(-h[j] if k & 2 else h[j], column(R, j), v)
        return FIRST_FACE + 2 * i + (k & 1), FIRST_FACE + 2 * j + (k & 2) // 2, v
    e = edge_range(hulls, core[1])[0] + EDGE_STRIDE * k
    v = int(hulls[e])
    v = add(rotate(R, (hulls[v], hulls[v + 1], hulls[v + 2])), p)
    return FIRST_FACE + int(hulls[e + 1]), FIRST_FACE + int(hulls[e + 2]), v


@lean_kernel
def _vertices(core, hulls):
    if core[0] == HULL:
        return int(hulls[core[1]])
    return 8 if core[0] == BOX else 2


@lean_kernel
def vertex_of(core, R, p, hulls, k):
    """Return the vertex k of a placed polytope or segment."""
    h = core[3]
    if core[0] == HULL:
        v = core[1] + HEADER + STRIDE * k
        q = (hulls[v], hulls[v + 1], hulls[v + 2])
    elif core[0] == BOX:
        q = (
            h[0] if k & 1 else -h[0],
            h[1] if k & 2 else -h[1],
            h[2] if k & 4 else -h[2],
        )
    else:
        q = (0.0, 0.0, h[0] if k & 1 else -h[0])
    return add(rotate(R, q), p)


@lean_kernel
def _better(best, depth, d, where, index, tie):
    """Return what is known after D(d) = depth: (status, least depth, its direction, place)."""
    _, least, known, _, _ = best
    if depth >= least + tie:
        return best
    if depth < least - tie or not dot(known, known) > 0.0:
        return LESS, depth, d, where, index
    if dot(d, known) > NEIGHBORHOOD:
        return best
    return UNDECIDED, least, known, where, index


@inlined_kernel
def _visit_faces(core_P, R_P, p_P, core_Q, hulls, y, best, tie, S):
    """Fill the rows of P's faces; return what is known then."""
    for f in range(_faces(core_P, hulls)):
        row = FIRST_FACE + f
        d, offset = _face(core_P, R_P, p_P, hulls, f)
        below = offset - dot(y, d)
        below_centre = below if core_Q[0] == HULL else offset
        depth = math.inf
        if max(below, below_centre) < best[1] + tie:
            q, _ = support(core_Q, hulls, scale(-1.0, d), -1)
            depth = offset - dot(q, d)
            best = _better(best, depth, d, FACE_OF_P, f, tie)
            for c in range(3):
                S[row, 3 + c] = q[c]
        for c in range(3):
            S[row, c] = d[c]
        S[row, DEPTH], S[row, BELOW], S[row, BELOW_CENTRE] = depth, below, below_centre
    return best


@lean_kernel
def _fill(core_Q, hulls, v, S, row):
    """Find the support point of Q for the row of a face that v is a point of, unless known."""
    if S[row, DEPTH] == math.inf:
        d = (S[row, 0], S[row, 1], S[row, 2])
        q, _ = support(core_Q, hulls, scale(-1.0, d), -1)
        for c in range(3):
            S[row, 3 + c] = q[c]
        S[row, DEPTH] = dot(subtract(v, q), d)


@lean_kernel
def _visit_arc(v, core_Q, hulls, near, far, best, index, tie, S):
    """Return what is known after the arc between the directions in rows ``near`` and ``far``.

    v is a point of the edge. Between two directions on the arc with support points w of C, D is
    at least the smaller of its values there and of w . m, where m is the direction in which both
    points are as far: as long as it is positive, w . d is a concave function of the angle. If the
    arc has the least depth, the row before the faces gets the two points of Q on either side of
    it: the ends of an edge of Q, or of a line on a cylinder's side, if that is touched.
    """
    _fill(core_Q, hulls, v, S, near)
    _fill(core_Q, hulls, v, S, far)
    d = (S[near, 0], S[near, 1], S[near, 2])
    w = subtract(v, (S[near, 3], S[near, 4], S[near, 5]))
    for c in range(6):
        S[0, c] = S[far, c]
    top = 0
    for _ in range(MAX_CUTS):
        e = (S[top, 0], S[top, 1], S[top, 2])
        x = subtract(v, (S[top, 3], S[top, 4], S[top, 5]))
        rest = subtract(w, x)
        m = axpy(-dot(rest, e), d, scale(dot(rest, d), e))
        lower = dot(w, m)  # times the length of m
        enough = best[1] + tie
        if dot(d, best[2]) > NEIGHBORHOOD and dot(e, best[2]) > NEIGHBORHOOD:
            enough = best[1] - SLACK * tie
        if lower < 0.0 or lower * lower < enough * abs(enough) * dot(m, m):
            m = unit(m, d)
            q, _ = support(core_Q, hulls, scale(-1.0, m), -1)
            depth = dot(subtract(v, q), m)
            is_exact = depth <= dot(w, m) + tie  # then nothing between is less than at m
            best = _better(best, depth, m, ARC, index, tie)
            if best[1] < 0.0:
                return best
            if best[0] == LESS and best[1] == depth:
                for c in range(3):
                    S[LAST, c] = v[c] - w[c]
                    S[LAST, 3 + c] = v[c] - x[c]
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
def _visit_arcs(core_P, R_P, p_P, core_Q, hulls, best, tie, S):
    """Return what is known after the arcs that no point of Q proves to be deeper."""
    for k in range(_edges(core_P, hulls)):
        if best[1] < 0.0:
            break
        near, far, v = _edge(core_P, R_P, p_P, hulls, k)
        enough = best[1] + tie
        if (
            min(S[near, BELOW], S[far, BELOW]) < enough
            and min(S[near, BELOW_CENTRE], S[far, BELOW_CENTRE]) < enough
        ):
            best = _visit_arc(v, core_Q, hulls, near, far, best, k, tie, S)
    return best


@inlined_kernel
def _visit_planes(core_P, R_P, p_P, core_Q, hulls, best, tie):
    """Return what is known after the planes of Q: faces, or the ends of a cylinder."""
    planes, offset = 0, 0.0
    if core_Q[0] == HULL or core_Q[0] == BOX:
        planes = _faces(core_Q, hulls)
    elif core_Q[0] == CYLINDER:
        planes, offset = 2, core_Q[3][1]
    for f in range(planes):
        if core_Q[0] == CYLINDER:
            out = (0.0, 0.0, -1.0 if f & 1 else 1.0)
        else:
            out, offset = _face(core_Q, IDENTITY, ORIGIN, hulls, f)
        d = scale(-1.0, out)
        x, _ = placed_support(core_P, hulls, R_P, p_P, d, -1)
        best = _better(best, offset + dot(d, x), d, PLANE_OF_Q, f, tie)
    return best


@inlined_kernel
def _visit_side(core_P, R_P, p_P, core_Q, hulls, best, tie):
    """Return what is known after the directions across a cylinder Q in which vertices leave it."""
    for k in range(_vertices(core_P, hulls)):
        v = vertex_of(core_P, R_P, p_P, hulls, k)
        room = core_Q[3][0] - best[1] - tie
        if room <= 0.0 or v[0] * v[0] + v[1] * v[1] > room * room:
            d = unit((-v[0], -v[1], 0.0), (1.0, 0.0, 0.0))
            x, _ = placed_support(core_P, hulls, R_P, p_P, d, -1)
            best = _better(best, dot(d, x) + core_Q[3][0], d, SIDE_OF_Q, k, tie)
    return best


@lean_kernel
def _is_inside(axes, q, depth):
    """Return whether q is proven to be ``depth`` inside of an ellipsoid's surface, or deeper.

    For 0 < s < c^2, the least semi-axis c, the square of the distance to the surface is at least
    s (1 - sum q_i^2 / (a_i^2 - s)): what Lagrange's multiplier s leaves of it. The bound is
    concave in s, and Newton's steps climb it.
    """
    a, b, c = axes[0] * axes[0], axes[1] * axes[1], axes[2] * axes[2]
    x, y, z = q[0] * q[0], q[1] * q[1], q[2] * q[2]
    highest = (1.0 - 1e-3) * min(a, b, c)
    s = min(depth * math.sqrt(min(a, b, c)), highest)
    for _ in range(MAX_CLIMBS):
        u, v, w = 1.0 / (a - s), 1.0 / (b - s), 1.0 / (c - s)
        if s * (1.0 - (x * u + y * v + z * w)) >= depth * depth:
            return True
        slope = 1.0 - (x * a * u * u + y * b * v * v + z * c * w * w)
        bend = 2.0 * (x * a * u * u * u + y * b * v * v * v + z * c * w * w * w)
        step = slope / bend if bend > 0.0 else highest
        s = min(max(s + step, 0.5 * s), 0.5 * (s + highest))
    return False


@lean_kernel
def _ends_at(core, hulls, k, vertex):
    """Return whether the edge k of a polytope ends at a vertex; all of a segment's do."""
    if core[0] == BOX:
        i, j = (k // 4 + 1) % 3, (k // 4 + 2) % 3
        return (k & 1 == 0) == (vertex >> i & 1 == 1) and (k & 2 == 0) == (vertex >> j & 1 == 1)
    if core[0] == HULL:
        e = edge_range(hulls, core[1])[0] + EDGE_STRIDE * k
        place = core[1] + HEADER + STRIDE * vertex
        return hulls[e] == place or hulls[e + 3] == place
    return True


@lean_kernel
def _middle(core, R, hulls, vertex, S):
    """Return a unit vector amid the normals of the faces around a vertex."""
    if core[0] == SEGMENT:
        return scale(1.0 if vertex & 1 else -1.0, column(R, 2))
    c = ORIGIN
    for k in range(_edges(core, hulls)):
        if _ends_at(core, hulls, k, vertex):
            near, far, _ = _edge(core, IDENTITY, ORIGIN, hulls, k)
            c = add(c, (S[near, 0], S[near, 1], S[near, 2]))
            c = add(c, (S[far, 0], S[far, 1], S[far, 2]))
    return unit(c, (0.0, 0.0, 1.0))


@lean_kernel
def _direction(S, row):
    return (S[row, 0], S[row, 1], S[row, 2])


@lean_kernel
def _proves(w, S, first, least, known, tie):
    """Return whether the point w of C proves that D is larger than least between three directions.

    w . d is linear, and a unit vector between them the sum of shares of them that add up to one or
    more. One of them may be ``known``.
    """
    for row in range(first, first + 3):
        d = _direction(S, row)
        enough = least - tie if dot(d, known) > SAME_DIRECTION else least + tie
        if dot(w, d) < enough:
            return False
    return True


@lean_kernel
def _is_proven(v, y, S, first, least, known, tie):
    """Return whether one of five points of C proves a triangle."""
    mean = ORIGIN
    for row in range(first, first + 3):
        w = subtract(v, (S[row, 3], S[row, 4], S[row, 5]))
        if _proves(w, S, first, least, known, tie):
            return True
        mean = axpy(1.0 / 3.0, w, mean)
    return _proves(mean, S, first, least, known, tie) or _proves(
        subtract(v, y), S, first, least, known, tie
    )


@lean_kernel
def _is_triangle_deeper(v, core_Q, hulls, y, least, known, tie, S):
    """Return whether D exceeds ``least`` in the spherical triangle in the first rows.

    v is the vertex of P for all of it. It is halved until a point of C proves each part.
    """
    first = 0
    for _ in range(MAX_HALVES):
        if _is_proven(v, y, S, first, least, known, tie):
            first -= 3
            if first < 0:
                return True
            continue
        if first + 6 > FIRST_FACE:
            return False
        i, j, cosine = first, first, 2.0
        for k in range(3):
            m = first + (k + 1) % 3
            along = dot(_direction(S, first + k), _direction(S, m))
            if along < cosine:
                i, j, cosine = first + k, m, along
        d = unit(add(_direction(S, i), _direction(S, j)), known)
        q, _ = support(core_Q, hulls, scale(-1.0, d), -1)
        if dot(subtract(v, q), d) < least + tie:
            return False
        for row in range(first, first + 3):
            for c in range(6):
                S[row + 3, c] = S[row, c]
        for c in range(3):
            S[i, c] = S[j + 3, c] = d[c]
            S[i, 3 + c] = S[j + 3, 3 + c] = q[c]
        first += 3
    return False


@lean_kernel
def _is_cone_deeper(core_P, R_P, p_P, core_Q, hulls, vertex, y, least, known, tie, S):
    """Return whether D exceeds ``least`` between all normals of the faces around a vertex."""
    v = vertex_of(core_P, R_P, p_P, hulls, vertex)
    middle = _middle(core_P, R_P, hulls, vertex, S)
    q, _ = support(core_Q, hulls, scale(-1.0, middle), -1)
    for k in range(_edges(core_P, hulls)):
        if not _ends_at(core_P, hulls, k, vertex):
            continue
        near, far, _ = _edge(core_P, R_P, p_P, hulls, k)
        _fill(core_Q, hulls, v, S, near)
        _fill(core_Q, hulls, v, S, far)
        for c in range(3):
            S[0, c] = middle[c]
            S[0, 3 + c] = q[c]
        for c in range(6):
            S[1, c] = S[near, c]
            S[2, c] = S[far, c]
        if not _is_triangle_deeper(v, core_Q, hulls, y, least, known, tie, S):
            return False
    return True


@inlined_kernel
def _are_vertices_deeper(core_P, R_P, p_P, core_Q, hulls, y, least, known, tie, S):
    """Return whether no vertex of P can leave the ellipsoid Q by less; y is Q's witness.

    Along the direction d in which it leaves the soonest, a vertex is ``t`` deep inside of a point
    of Q's surface whose outward normal is -d. If the vertex is in Q, t is at least its distance
    to the surface. If not, it went through all of Q, and t is at least the length of the chord
    along the normal, which is 2 c^2 / h_Q(d) or more for the least semi-axis c.
    """
    axes = core_Q[3]
    shortest, longest = min(axes[0], axes[1], axes[2]), max(axes[0], axes[1], axes[2])
    radius = inner_radius(core_Q, IDENTITY, ORIGIN, hulls, y, scale(-1.0, known))
    centre = axpy(radius, known, y)
    x = axpy(least, known, y)
    for k in range(_vertices(core_P, hulls)):
        v = vertex_of(core_P, R_P, p_P, hulls, k)
        if norm((v[0] / axes[0], v[1] / axes[1], v[2] / axes[2])) >= 1.0:
            is_deeper = 2.0 * shortest * shortest >= (least + tie) * longest
        else:
            is_deeper = (
                radius - norm(subtract(v, centre)) >= least + tie
                or (norm(subtract(v, x)) <= tie and radius > least + tie)
                or _is_inside(axes, v, least + tie)
            )
        if not is_deeper and not _is_cone_deeper(
            core_P, R_P, p_P, core_Q, hulls, k, y, least, known, tie, S
        ):
            return False
    return True


@inlined_kernel
def _look(core_P, R_P, p_P, core_Q, hulls, y, least, known, tie, S):
    """Return what is known about a polytope P; y is Q's witness, ``known`` points out of P."""
    best = (NONE_LESS, least, known, FACE_OF_P, 0)
    best = _visit_faces(core_P, R_P, p_P, core_Q, hulls, y, best, tie, S)
    best = _visit_planes(core_P, R_P, p_P, core_Q, hulls, best, tie)
    if core_Q[0] == CYLINDER:
        best = _visit_side(core_P, R_P, p_P, core_Q, hulls, best, tie)
    best = _visit_arcs(core_P, R_P, p_P, core_Q, hulls, best, tie, S)  # none if they are apart
    if (
        best[0] == NONE_LESS
        and core_Q[0] == ELLIPSOID
        and not _are_vertices_deeper(core_P, R_P, p_P, core_Q, hulls, y, least, known, tie, S)
    ):
        return UNDECIDED, least, known, FACE_OF_P, 0
    return best


@lean_kernel
def are_swapped(core_A, core_B, hulls):
    """Return whether B is taken for P, as the only polytope, or the one with fewer edges."""
    edges_A, edges_B = _edges(core_A, hulls), _edges(core_B, hulls)
    return edges_A == 0 or 0 < edges_B < edges_A


@lean_kernel
def are_polytopes_or_cylinders(core_A, core_B, hulls):
    """Return whether all directions of a pair can be looked through without knowing a contact."""
    edges_A, edges_B = _edges(core_A, hulls), _edges(core_B, hulls)
    return (edges_A > 0 and (edges_B > 0 or core_B[0] == CYLINDER)) or (
        edges_B > 0 and core_A[0] == CYLINDER
    )


@lean_kernel
def look_for_less(core_A, core_B, R, p, hulls, a, b, n, depth, size, S):
    """Look for another direction m out of B into A that is no deeper than ``depth`` > 0.

    a, b, n: the witnesses and the normal of a stationary depth; with n = 0, any direction is
    another one, and a and b are any points of the cores. Returns (status, m, where, index).
    ``NONE_LESS``: there is no other. ``LESS``: along m it is the least of all, or negative; the
    features there are told by ``where`` and their index. ``UNDECIDED``: two directions are as
    deep to rounding, or these cores are none that are looked through here: one must be a polytope
    that is not large, the other that, too, or a cylinder or an ellipsoid. ``S`` is overwritten.
    """
    is_B = are_swapped(core_A, core_B, hulls)
    core_P, core_Q, R_QP, p_QP, y, out = core_B, core_A, R, p, a, n
    if not is_B:
        core_P, core_Q = core_A, core_B
        R_QP, p_QP = transpose(R), scale(-1.0, rotate_inverse(R, p))
        y, out = rotate_inverse(R, subtract(b, p)), scale(-1.0, rotate_inverse(R, n))
    is_other = core_Q[0] == CYLINDER or core_Q[0] == ELLIPSOID or _edges(core_Q, hulls) > 0
    if _edges(core_P, hulls) == 0 or not is_other:
        return UNDECIDED, n, FACE_OF_P, 0
    status, _, d, where, index = _look(
        core_P, R_QP, p_QP, core_Q, hulls, y, depth, out, TIE * EPSILON * size, S
    )
    return status, d if is_B else scale(-1.0, rotate(R, d)), where, index

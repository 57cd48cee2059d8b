"""Whether a vertex of a polytope P can leave an ellipsoid Q by less than a known depth.

Bounds in closed form come first; what they leave open is divided into spherical triangles. Rows
and frames are those of ``polytope_rows``.
"""

import math

from scene_graph_ros.geometry.jit import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores import IDENTITY, ORIGIN, SEGMENT, support
from scene_graph_ros.geometry.narrowphase.inner_ball import inner_radius
from scene_graph_ros.geometry.narrowphase.polytope_rows import (
    edge_count,
    edge_of,
    ends_at,
    fill,
    FIRST_FACE,
    vertex_count,
    vertex_of,
)
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    column,
    dot,
    norm,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import SAME_DIRECTION

__all__ = ["are_vertices_deeper"]

MAX_CLIMBS = 6
"""Newton's steps to a bound of a distance; they gain little after three."""

MAX_HALVES = 48
"""Parts of a spherical triangle that are looked at."""


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


@inlined_kernel
def _middle(core, R, hulls, vertex, S):
    """Return a unit vector amid the normals of the faces around a vertex."""
    if core[0] == SEGMENT:
        return scale(1.0 if vertex & 1 else -1.0, column(R, 2))
    c = ORIGIN
    for k in range(edge_count(core, hulls)):
        if ends_at(core, hulls, k, vertex):
            near, far, _ = edge_of(core, IDENTITY, ORIGIN, hulls, k)
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


@inlined_kernel
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


@inlined_kernel
def _is_cone_deeper(core_P, R_P, p_P, core_Q, hulls, vertex, y, least, known, tie, S):
    """Return whether D exceeds ``least`` between all normals of the faces around a vertex."""
    v = vertex_of(core_P, R_P, p_P, hulls, vertex)
    middle = _middle(core_P, R_P, hulls, vertex, S)
    q, _ = support(core_Q, hulls, scale(-1.0, middle), -1)
    for k in range(edge_count(core_P, hulls)):
        if not ends_at(core_P, hulls, k, vertex):
            continue
        near, far, _ = edge_of(core_P, R_P, p_P, hulls, k)
        fill(core_Q, hulls, v, S, near)
        fill(core_Q, hulls, v, S, far)
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
def are_vertices_deeper(core_P, R_P, p_P, core_Q, hulls, y, least, known, tie, S):
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
    for k in range(vertex_count(core_P, hulls)):
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

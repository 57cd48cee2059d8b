"""Signed distance of two boxes.

Of the 15 directions of the separating axis test the one of least overlap is the depth. Apart, the
one of largest separation is the distance if its features face each other. If they don't, the
nearest points include a point of an edge, and the edges of each box are measured to the other.

Which features of overlapping boxes face each other is lost to rounding where several directions
are as short. But moved apart by the depth, along any of them, the boxes touch: the nearest points
then are the witnesses.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.query.distance.box_axes import (
    axis_vector,
    reach,
    separating_normal,
    shallowest,
    without_rounding,
)
from scene_graph_ros.geometry.query.distance.box_faces import (
    middle_of_quad,
    middle_of_segment,
)
from scene_graph_ros.geometry.query.distance.segment_box import (
    excess,
    nearest_on_segment_to_box,
)
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    column,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    transpose,
)
from scene_graph_ros.geometry.tolerances import COINCIDENCE, NEAR_CONTACT

__all__ = ["distance_box_box"]


@inlined_kernel
def _over_face(size_F, size_V, R_FV, p_FV, axis, sign):
    """Return (x, is_over): where box V is nearest to the plane of F's face, in F.

    The face is ``sign`` times F's axis. x is a vertex of V, or the middle of the part of its edge
    or face over the face; ``is_over`` tells that x projects into the face.
    """
    i, j = (axis + 1) % 3, (axis + 2) % 3
    x = p_FV
    flat, steep, turn = 0, 0, 0
    for k in range(3):
        edge = column(R_FV, k)
        slope = sign * edge[axis]
        if slope != 0.0:
            x = axpy(-math.copysign(size_V[k], slope), edge, x)
            steep = k
        else:
            flat += 1
            turn = k
    if flat == 0:
        return x, abs(x[i]) <= size_F[i] and abs(x[j]) <= size_F[j]
    if flat == 1:
        u = scale(size_V[turn], column(R_FV, turn))
        t, is_over = middle_of_segment(x[i], x[j], u[i], u[j], size_F[i], size_F[j])
        return axpy(t, u, x), is_over
    u = scale(size_V[(steep + 1) % 3], column(R_FV, (steep + 1) % 3))
    v = scale(size_V[(steep + 2) % 3], column(R_FV, (steep + 2) % 3))
    s, t, is_over = middle_of_quad((x[i], x[j]), (u[i], u[j]), (v[i], v[j]), size_F[i], size_F[j])
    middle = add(axis_vector(i, s), axis_vector(j, t))
    return add(middle, axis_vector(axis, x[axis])), is_over


@kernel
def _between_edges(size_A, size_B, R, p, i, j, n):
    """Return (x, y, is_over): where A's edge i and B's edge j cross, seen along n, in A.

    ``is_over`` tells that both points are on the edges.
    """
    x, y = (0.0, 0.0, 0.0), p
    for k in range(3):
        if k != i:
            x = add(x, axis_vector(k, -math.copysign(size_A[k], n[k])))
        if k != j:
            edge = column(R, k)
            y = axpy(math.copysign(size_B[k], dot(edge, n)), edge, y)
    # Across n the lines meet: solve x + s e_i = y + t b in the plane of both.
    b = column(R, j)
    d = subtract(y, x)
    k, m = (i + 1) % 3, (i + 2) % 3
    t = -(d[k] * b[k] + d[m] * b[m]) / (b[k] * b[k] + b[m] * b[m])
    s = d[i] + t * b[i]
    is_over = abs(t) <= size_B[j] and abs(s) <= size_A[i]
    return add(x, axis_vector(i, s)), axpy(t, b, y), is_over


@kernel
def _facing(size, n):
    """Return the corner of a box that is the furthest along n, as half extents with signs."""
    return (
        math.copysign(size[0], n[0]),
        math.copysign(size[1], n[1]),
        math.copysign(size[2], n[2]),
    )


@kernel
def _nearest_edge(size_E, size_F, R_FE, p_FE, n, least):
    """Return (square, x, y): the nearest points x, of box E's edges, and y, of box F, in F.

    n points from F to E and separates them. Edges are tried from the corner that faces F on, and
    only those that may come closer than sqrt(least). ``square`` is inf where there is none.
    """
    best, x, y = math.inf, p_FE, p_FE
    offset = reach(size_F, n)
    corner = _facing(size_E, scale(-1.0, rotate_inverse(R_FE, n)))
    for index in range(12):
        flips, k = index // 3, index % 3
        i, j = (k + 1) % 3, (k + 2) % 3
        u = scale(size_E[k], column(R_FE, k))
        c = axpy(-corner[i] if flips & 1 else corner[i], column(R_FE, i), p_FE)
        c = axpy(-corner[j] if flips & 2 else corner[j], column(R_FE, j), c)
        along = max(dot(c, n) - abs(dot(u, n)) - offset, 0.0)
        beside = (
            max(abs(c[0]) - abs(u[0]) - size_F[0], 0.0),
            max(abs(c[1]) - abs(u[1]) - size_F[1], 0.0),
            max(abs(c[2]) - abs(u[2]) - size_F[2], 0.0),
        )
        if max(along * along, dot(beside, beside)) >= least:
            continue
        point = axpy(nearest_on_segment_to_box(size_F, c, u), u, c)
        gaps = (
            excess(point[0], size_F[0]),
            excess(point[1], size_F[1]),
            excess(point[2], size_F[2]),
        )
        square = dot(gaps, gaps)
        if square < least:
            best, least, x, y = square, square, point, subtract(point, gaps)
    return best, x, y


@kernel
def _nearest(size_A, size_B, R, p, n):
    """Return (x, y): the nearest points of A and B, in A, for boxes that n (B to A) separates."""
    away = scale(-1.0, n)
    square, y, x = _nearest_edge(size_B, size_A, R, p, away, math.inf)
    p_BA = scale(-1.0, rotate_inverse(R, p))
    closer, x_B, y_B = _nearest_edge(
        size_A, size_B, transpose(R), p_BA, rotate_inverse(R, n), square
    )
    if closer < square:
        return add(rotate(R, x_B), p), add(rotate(R, y_B), p)
    return x, y


@kernel
def _clamped(size, x):
    """Return the point of a box nearest to x.

    Squares of distances hide which of the nearest edges' points are the right ones, up to the root
    of rounding beside each other; of each other's nearest points there is only one such pair.
    """
    return (
        min(max(x[0], -size[0]), size[0]),
        min(max(x[1], -size[1]), size[1]),
        min(max(x[2], -size[2]), size[2]),
    )


@lean_kernel
def distance_box_box(size_A, size_B, R_AB, p_AB, max_distance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique).

    Of equally shallow directions the first in the order A's faces, B's faces, edges is chosen,
    and ``unique`` is False. Flat on each other, faces and edges meet in the middle of their
    overlap. Beyond ``max_distance``, phi may be a lower bound, without witnesses.
    """
    largest = max(size_A[0], size_A[1], size_A[2], size_B[0], size_B[1], size_B[2])
    tolerance = COINCIDENCE * largest
    R = without_rounding(R_AB)
    depth, n, kind, unique = shallowest(size_A, size_B, R, p_AB, tolerance, max_distance)
    if -depth > max_distance:
        return -depth, p_AB, p_AB, n, False
    if kind < 3:
        y, is_over = _over_face(size_A, size_B, R, p_AB, kind, -n[kind])
        x = axpy(-depth, n, y)
    elif kind < 6:
        p_BA = scale(-1.0, rotate_inverse(R, p_AB))
        axis = kind - 3
        sign = math.copysign(1.0, dot(column(R, axis), n))
        x_B, is_over = _over_face(size_B, size_A, transpose(R), p_BA, axis, sign)
        x = add(rotate(R, x_B), p_AB)
        y = axpy(depth, n, x)
    else:
        i, j = (kind - 6) // 3, (kind - 6) % 3
        x, y, is_over = _between_edges(size_A, size_B, R, p_AB, i, j, n)
    is_apart = depth <= -tolerance
    if is_over:
        return -depth, x, y, n, unique or is_apart
    if depth <= tolerance:
        x, y = _nearest(size_A, size_B, R, p_AB, n)
        gap = subtract(x, y)
        if dot(gap, gap) > NEAR_CONTACT * NEAR_CONTACT * largest * largest:
            x = _clamped(size_A, y)
            y = add(rotate(R, _clamped(size_B, rotate_inverse(R, subtract(x, p_AB)))), p_AB)
            gap = subtract(x, y)
        tolerance += COINCIDENCE * norm(gap)
        n = separating_normal(size_A, size_B, R, p_AB, n, gap, tolerance)
        phi = dot(gap, n)
        beside = axpy(-phi, n, gap)
        if dot(beside, beside) <= tolerance * tolerance:
            return phi, x, y, n, unique or is_apart
        depth = -phi
    shift = scale(depth, n)
    x, y = _nearest(size_A, size_B, R, subtract(p_AB, shift), n)
    return -depth, x, add(y, shift), n, unique or is_apart

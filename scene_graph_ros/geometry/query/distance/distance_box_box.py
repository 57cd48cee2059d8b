"""Signed distance of two boxes.

The Minkowski difference of two boxes is bounded by planes along the 15 directions of the
separating axis test (Gottschalk, Lin, Manocha, "OBBTree", 1996): 3 faces of each box and 9 cross
products of their edges. Overlapping, the shallowest of these is the depth. Apart, the one of
largest separation is the distance if its features face each other; if they don't, the nearest
points include a point of an edge, and the edges of each box are measured to the other box.
"""

import math

from scene_graph_ros.geometry.jit import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.query.distance.box_faces import (
    middle_of_segment,
    quad_over_rectangle,
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
    unit,
)
from scene_graph_ros.geometry.tolerances import COINCIDENCE, PARALLEL

__all__ = ["distance_box_box"]


@kernel
def _without_rounding(R):
    """Set entries of a rotation to zero that are so small that an edge is parallel to a face."""
    return (
        R[0] if abs(R[0]) > PARALLEL else 0.0,
        R[1] if abs(R[1]) > PARALLEL else 0.0,
        R[2] if abs(R[2]) > PARALLEL else 0.0,
        R[3] if abs(R[3]) > PARALLEL else 0.0,
        R[4] if abs(R[4]) > PARALLEL else 0.0,
        R[5] if abs(R[5]) > PARALLEL else 0.0,
        R[6] if abs(R[6]) > PARALLEL else 0.0,
        R[7] if abs(R[7]) > PARALLEL else 0.0,
        R[8] if abs(R[8]) > PARALLEL else 0.0,
    )


@kernel
def _axis_vector(axis, value):
    return (
        value if axis == 0 else 0.0,
        value if axis == 1 else 0.0,
        value if axis == 2 else 0.0,
    )


@kernel
def _reach(size, n):
    """Return a box's extent from its centre along n."""
    return size[0] * abs(n[0]) + size[1] * abs(n[1]) + size[2] * abs(n[2])


@kernel
def _cross_axis(R, i, j):
    """Return the unit cross product of A's edge i and B's edge j, or zero where parallel."""
    b = column(R, j)
    k, m = (i + 1) % 3, (i + 2) % 3
    length = math.sqrt(b[k] * b[k] + b[m] * b[m])
    if length <= PARALLEL or b[k] == 0.0 or b[m] == 0.0:
        # Then the product is zero or the normal of a face.
        return (0.0, 0.0, 0.0)
    return add(_axis_vector(k, -b[m] / length), _axis_vector(m, b[k] / length))


@kernel
def _shallowest(size_A, size_B, R, p, tolerance, max_distance):
    """Return (depth, n, kind, unique): the direction n, out of B, of least overlap, in A.

    ``kind`` counts A's faces 0 to 2, B's 3 to 5, then 6 + 3 i + j for edges i and j. Ties go to
    the first. Negative depths are separations; the search stops at one beyond ``max_distance``.
    """
    depth, second, n, kind = math.inf, math.inf, (1.0, 0.0, 0.0), 0
    for candidate in range(15):
        if candidate < 3:
            axis = _axis_vector(candidate, 1.0)
        elif candidate < 6:
            axis = column(R, candidate - 3)
        else:
            axis = _cross_axis(R, (candidate - 6) // 3, (candidate - 6) % 3)
            if dot(axis, axis) == 0.0:
                continue
        offset = -dot(p, axis)
        reach = _reach(size_A, axis) + _reach(size_B, rotate_inverse(R, axis))
        candidate_depth = reach - abs(offset)
        # An edge of one box that lies in a face of the other gives that face's normal again.
        if candidate_depth < depth - tolerance:
            second = depth if abs(offset) > tolerance else candidate_depth
            depth, kind = candidate_depth, candidate
            n = scale(-1.0, axis) if offset < 0.0 else axis
            if -depth > max_distance:
                break
        elif abs(dot(axis, n)) < 1.0 - PARALLEL:
            second = min(second, candidate_depth)
    return depth, n, kind, second > depth + tolerance


@inlined_kernel
def _over_face(size_F, size_V, R_FV, p_FV, axis, sign, is_apart):
    """Return (x, is_over): where box V is nearest to the plane of F's face, in F.

    The face is ``sign`` times F's axis. x is a vertex of V, or the middle of what of its edge or
    face lies over the face; ``is_over`` tells that x projects into the face. Where boxes that
    overlap have other ways out that are as short to rounding, it may not; then x is the lowest
    point of V's face that does.
    """
    i, j = (axis + 1) % 3, (axis + 2) % 3
    x = p_FV
    flat, steepest, steep, turn = 0, 0, -1.0, 0
    for k in range(3):
        edge = column(R_FV, k)
        slope = sign * edge[axis]
        if slope != 0.0:
            x = axpy(-math.copysign(size_V[k], slope), edge, x)
        else:
            flat += 1
            turn = k
        if abs(slope) > steep:
            steepest, steep = k, abs(slope)
    is_over = False
    if flat == 0:
        is_over = abs(x[i]) <= size_F[i] and abs(x[j]) <= size_F[j]
    elif flat == 1:
        u = scale(size_V[turn], column(R_FV, turn))
        t, is_over = middle_of_segment(x[i], x[j], u[i], u[j], size_F[i], size_F[j])
        x = axpy(t, u, x)
    if is_over or (is_apart and flat < 2):
        return x, is_over
    edge = column(R_FV, steepest)
    c = axpy(-math.copysign(size_V[steepest], sign * edge[axis]), edge, p_FV)
    u = scale(size_V[(steepest + 1) % 3], column(R_FV, (steepest + 1) % 3))
    v = scale(size_V[(steepest + 2) % 3], column(R_FV, (steepest + 2) % 3))
    middle, lowest, is_over = quad_over_rectangle(
        (c[i], c[j], sign * c[axis]),
        (u[i], u[j], sign * u[axis]),
        (v[i], v[j], sign * v[axis]),
        size_F[i],
        size_F[j],
    )
    point = middle if flat == 2 else lowest
    if is_over:
        x = add(_axis_vector(i, point[0]), _axis_vector(j, point[1]))
        x = add(x, _axis_vector(axis, sign * point[2]))
    return x, is_over


@kernel
def _between_edges(size_A, size_B, R, p, i, j, n):
    """Return (x, is_over): the point of A's edge i nearest to B's edge j, across n, in A."""
    x, y = (0.0, 0.0, 0.0), p
    for k in range(3):
        if k != i:
            x = add(x, _axis_vector(k, -math.copysign(size_A[k], n[k])))
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
    t = min(max(t, -size_B[j]), size_B[j])
    s = min(max(d[i] + t * b[i], -size_A[i]), size_A[i])
    return add(x, _axis_vector(i, s)), is_over


@kernel
def _nearest_edge(size_E, size_F, R_FE, p_FE, n, offset, least):
    """Return (square, x, y): the nearest points x, of box E's edges, and y, of box F, in F.

    Only edges are tried that come closer than sqrt(least) to F along n, the direction out of F in
    which F's reach is ``offset``. ``square`` is inf where there is none.
    """
    best, x, y = math.inf, p_FE, p_FE
    for index in range(12):
        k = index >> 2
        i, j = (k + 1) % 3, (k + 2) % 3
        u = scale(size_E[k], column(R_FE, k))
        c = axpy(size_E[i] if index & 1 else -size_E[i], column(R_FE, i), p_FE)
        c = axpy(size_E[j] if index & 2 else -size_E[j], column(R_FE, j), c)
        gap = max(dot(c, n) - abs(dot(u, n)) - offset, 0.0)
        if gap * gap >= least:
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
def _apart(size_A, size_B, R, p, n):
    """Return (x, y): the nearest points of A and B, in A, for boxes apart along n (B to A)."""
    p_BA = scale(-1.0, rotate_inverse(R, p))
    n_B = rotate_inverse(R, n)
    _, x_B, y_B = _nearest_edge(
        size_A, size_B, transpose(R), p_BA, n_B, _reach(size_B, n_B), math.inf
    )
    gap = subtract(x_B, y_B)
    square = dot(gap, gap)
    away = scale(-1.0, n)
    closer, y, x = _nearest_edge(size_B, size_A, R, p, away, _reach(size_A, n), square)
    if closer < square:
        return x, y
    return add(rotate(R, x_B), p), add(rotate(R, y_B), p)


@kernel
def _across_edges(R, n_faces, n, slack):
    """Return n, the direction between two points, at a right angle to edges that nearly are.

    ``slack`` is n's error in radians. A normal of an edge that leans that much along it is not
    one of the box: the edge's end would be nearer. Beyond a tenth it tells nothing; ``n_faces``,
    which separates the boxes, is returned then.
    """
    if slack > 0.1:
        return n_faces
    found_A = found_B = -1
    count_A = count_B = 0
    for k in range(3):
        if abs(n[k]) <= slack:
            found_A, count_A = k, count_A + 1
        if abs(dot(n, column(R, k))) <= slack:
            found_B, count_B = k, count_B + 1
    if count_A == 2 or count_B == 2:
        # At a right angle to two edges of a box: along the third.
        for k in range(3):
            axis = _axis_vector(k, 1.0) if count_A == 2 else column(R, k)
            along = dot(n, axis)
            if abs(along) > slack:
                return scale(math.copysign(1.0, along), axis)
    if count_A == 1 and count_B == 1:
        axis = _cross_axis(R, found_A, found_B)
        if dot(axis, axis) > 0.0:
            return scale(math.copysign(1.0, dot(axis, n)), axis)
    if count_A == 1:
        axis = _axis_vector(found_A, 1.0)
        return unit(axpy(-dot(n, axis), axis, n), n)
    if count_B == 1:
        axis = column(R, found_B)
        return unit(axpy(-dot(n, axis), axis, n), n)
    return n


@lean_kernel
def distance_box_box(size_A, size_B, R_AB, p_AB, max_distance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique).

    Of equally shallow directions the first in the order A's faces, B's faces, edges is chosen,
    and ``unique`` is False. Flat on each other, faces and edges meet in the middle of what they
    share. Beyond ``max_distance``, phi may be a lower bound, without witnesses.
    """
    largest = max(size_A[0], size_A[1], size_A[2], size_B[0], size_B[1], size_B[2])
    tolerance = COINCIDENCE * largest
    R = _without_rounding(R_AB)
    depth, n, kind, unique = _shallowest(size_A, size_B, R, p_AB, tolerance, max_distance)
    if -depth > max_distance:
        return -depth, p_AB, p_AB, n, False
    is_apart = depth <= -tolerance
    if kind < 3:
        y, is_over = _over_face(size_A, size_B, R, p_AB, kind, -n[kind], is_apart)
        x = axpy(-depth, n, y)
    elif kind < 6:
        p_BA = scale(-1.0, rotate_inverse(R, p_AB))
        axis = kind - 3
        sign = math.copysign(1.0, dot(column(R, axis), n))
        x_B, is_over = _over_face(size_B, size_A, transpose(R), p_BA, axis, sign, is_apart)
        x = add(rotate(R, x_B), p_AB)
    else:
        x, is_over = _between_edges(size_A, size_B, R, p_AB, (kind - 6) // 3, (kind - 6) % 3, n)
    if is_over or not is_apart:
        return -depth, x, axpy(depth, n, x), n, unique or is_apart
    x, y = _apart(size_A, size_B, R, p_AB, n)
    gap = subtract(x, y)
    n = _across_edges(R, n, unit(gap, n), tolerance / norm(gap))
    return dot(gap, n), x, y, n, True

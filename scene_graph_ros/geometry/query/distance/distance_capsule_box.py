"""Signed distance of a capsule to a box: that of its axis, minus the radius."""

import math

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.query.distance.segment_box import (
    crossings,
    excess,
    nearest_on_segment_to_box,
)
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    unit,
)
from scene_graph_ros.geometry.tolerances import COINCIDENCE, PARALLEL

__all__ = ["distance_capsule_box"]


@kernel
def _axis_vector(axis, value):
    return (
        value if axis == 0 else 0.0,
        value if axis == 1 else 0.0,
        value if axis == 2 else 0.0,
    )


@kernel
def _without_rounding(u):
    """Set components of u to zero that are so small that u is parallel to a face."""
    least = PARALLEL * norm(u)
    return (
        u[0] if abs(u[0]) > least else 0.0,
        u[1] if abs(u[1]) > least else 0.0,
        u[2] if abs(u[2]) > least else 0.0,
    )


@kernel
def _edge_normal(u, gap, distance):
    """Return the unit direction of ``gap``, by two edges' cross product where that is exacter."""
    # The way is at a right angle to the segment; near contact, rounding would turn it.
    across = axpy(-dot(gap, u) / dot(u, u), u, gap)
    n = unit(across, unit(gap, (1.0, 0.0, 0.0)))
    for axis in range(3):
        others = gap[(axis + 1) % 3] != 0.0 and gap[(axis + 2) % 3] != 0.0
        if gap[axis] == 0.0 and others:
            i, j = (axis + 1) % 3, (axis + 2) % 3
            if math.sqrt(u[i] * u[i] + u[j] * u[j]) > distance:
                x, y = -u[j], u[i]
                sign = 1.0 if x * gap[i] + y * gap[j] >= 0.0 else -1.0
                edge = add(_axis_vector(i, sign * x), _axis_vector(j, sign * y))
                n = unit(edge, n)
    return n


@kernel
def _escape(size, c, u, tolerance):
    """Return (depth, n, kind, unique): the shortest way of the segment out of the box.

    The candidates are the face normals (kind 0, 1, 2) and the cross products of the segment with
    the box's edges (kind 3, 4, 5): the faces of the Minkowski difference. Ties go to the first.
    """
    depth, second, n, kind = math.inf, math.inf, (1.0, 0.0, 0.0), 0
    for candidate in range(6):
        axis = candidate % 3
        i, j = (axis + 1) % 3, (axis + 2) % 3
        if candidate < 3:
            direction = _axis_vector(axis, 1.0)
        else:
            length = math.sqrt(u[i] * u[i] + u[j] * u[j])
            if u[i] == 0.0 or u[j] == 0.0:
                continue
            direction = add(_axis_vector(i, -u[j] / length), _axis_vector(j, u[i] / length))
        offset = dot(c, direction)
        reach = size[0] * abs(direction[0]) + size[1] * abs(direction[1])
        reach += size[2] * abs(direction[2])
        if candidate < 3:
            reach += abs(u[axis])
        candidate_depth = reach - abs(offset)
        if candidate_depth < depth - tolerance:
            # The opposite way is as short where the centres are level.
            second = depth if abs(offset) > tolerance else candidate_depth
            depth, kind = candidate_depth, candidate
            n = scale(-1.0, direction) if offset < 0.0 else direction
        else:
            second = min(second, candidate_depth)
    return depth, n, kind, second > depth + tolerance


@kernel
def _into(t, interval):
    return min(max(t, interval[0]), interval[1])


@kernel
def _deepest_on_face(size, c, u, axis, n, tolerance):
    """Return t of the segment's deepest point over the face; lying flat, its middle over it.

    Beyond the face by no more than ``tolerance`` counts as over it: where a segment hardly moves
    sideways, rounding says little of where it passes the face's side. If no point is over it, as
    another way out is as short, the side decides that the segment passes more quickly.
    """
    i, j = (axis + 1) % 3, (axis + 2) % 3
    if abs(u[i]) > abs(u[j]):
        i, j = j, i
    room = tolerance if u[axis] != 0.0 else 0.0
    over_i, over_j = crossings(size[i] + room, c[i], u[i]), crossings(size[j] + room, c[j], u[j])
    low, high = max(over_i[0], over_j[0], -1.0), min(over_i[1], over_j[1], 1.0)
    if u[axis] == 0.0 and low <= high:
        return 0.5 * (low + high)
    end = -1.0 if u[axis] * n[axis] > 0.0 else 1.0
    return _into(_into(_into(end, over_i), over_j), (-1.0, 1.0))


@kernel
def _nearest_to_edge(size, c, u, axis, n):
    """Return t where the segment passes the box's edge along ``axis`` that is furthest along n."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    a = math.copysign(size[i], n[i]) - c[i]
    b = math.copysign(size[j], n[j]) - c[j]
    t = (a * u[i] + b * u[j]) / (u[i] * u[i] + u[j] * u[j])
    return min(max(t, -1.0), 1.0)


@kernel
def distance_capsule_box(size_A, size_B, R_AB, p_AB):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique).

    Where the axis is inside the box, of equally short ways out a face's comes first, in the order
    x, y, z, to the side of the capsule's centre, the positive one where it is level; ``unique`` is
    then False. Where the axis lies flat on a face, the middle of the overlap is the witness.
    """
    c = scale(-1.0, rotate_inverse(R_AB, p_AB))
    u = _without_rounding((size_A[1] * R_AB[6], size_A[1] * R_AB[7], size_A[1] * R_AB[8]))
    t = nearest_on_segment_to_box(size_B, c, u)
    x = axpy(t, u, c)
    gap = (excess(x[0], size_B[0]), excess(x[1], size_B[1]), excess(x[2], size_B[2]))
    distance = norm(gap)
    tolerance = COINCIDENCE * max(size_A[0] + size_A[1], size_B[0], size_B[1], size_B[2])
    if distance > tolerance:
        is_inside_segment = -1.0 < t < 1.0
        n = _edge_normal(u, gap, distance) if is_inside_segment else unit(gap, (1.0, 0.0, 0.0))
        distance = dot(n, gap)
        unique = True
    else:
        depth, n, kind, unique = _escape(size_B, c, u, tolerance)
        distance = -depth
        if kind < 3:
            t = _deepest_on_face(size_B, c, u, kind, n, tolerance)
        else:
            t = _nearest_to_edge(size_B, c, u, kind - 3, n)
    nhat_BA_A = rotate(R_AB, n)
    phi = distance - size_A[0]
    p_ACa = axpy(-size_A[0], nhat_BA_A, (0.0, 0.0, t * size_A[1]))
    return phi, p_ACa, axpy(-phi, nhat_BA_A, p_ACa), nhat_BA_A, unique

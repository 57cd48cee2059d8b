"""Whether any ball of a cloud is nearer to a robot's body than a distance, by yes or no.

That takes a fraction of the time of finding the distance. A tree of boxes says which eight points
may be near, and planes between a hull and points which of these are not. What neither decides, the
distance of the point does.
"""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    bits_of,
    LANES,
    larger,
    load_lanes,
    lowest_bit,
    magnitude,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.query.distance.pair_entry import PAIR_DISTANCE
from scene_graph_ros.geometry.query.elements.element_places import measure_of, point_row_of
from scene_graph_ros.geometry.spatial.vectors import relative_pose
from scene_graph_ros.geometry.tables.point_tree import BOX

__all__ = ["any_near"]

_STACK = 128
_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

_nodes = stack_array((_STACK, 2), np.int64)
_pair_distance = PAIR_DISTANCE.call


@inlined_kernel
def _near_box(px, py, pz, qx, qy, qz, body, half, turned):
    """Return the largest gap of boxes in C and a body's box along any of six axes, in lanes."""
    R, M = body[0], body[1]
    along = larger(
        larger(magnitude(px) - qx - turned[0], magnitude(py) - qy - turned[1]),
        magnitude(pz) - qz - turned[2],
    )
    x = R[0] * px + R[3] * py + R[6] * pz
    y = R[1] * px + R[4] * py + R[7] * pz
    z = R[2] * px + R[5] * py + R[8] * pz
    x_gap = magnitude(x) - (M[0] * qx + M[3] * qy + M[6] * qz) - half[0]
    y_gap = magnitude(y) - (M[1] * qx + M[4] * qy + M[7] * qz) - half[1]
    z_gap = magnitude(z) - (M[2] * qx + M[5] * qy + M[8] * qz) - half[2]
    return larger(along, larger(larger(x_gap, y_gap), z_gap))


@inlined_kernel
def _beyond_planes(x, y, z, radii, bits, body, need, planes, guesses, a):
    """Return a mask of points that no face's normal shows farther than ``need`` from a hull."""
    center, first, last = body[3], body[4], body[5]
    x, y, z = x + center[0], y + center[1], z + center[2]
    enough = radii + need
    guess = guesses[a, 0]
    if first <= guess < last:
        n = planes[guess]
        bits &= ~bits_of(x * n[0] + y * n[1] + z * n[2] - n[3] >= enough)
    k = first
    while bits != 0 and k < last:
        n = planes[k]
        left = bits & ~bits_of(x * n[0] + y * n[1] + z * n[2] - n[3] >= enough)
        if left != bits:
            guesses[a, 0] = k
        bits = left
        k += 1
    return bits


@inlined_kernel
def _plane_in_cloud(body, planes, guess, need):
    """Return a plane of a body in C, as (normal, its entries' sizes, the gap of the box's centre).

    The gap is less by ``need``; without a plane nothing is beyond it.
    """
    R, center, first, last = body[0], body[3], body[4], body[5]
    if not first <= guess < last:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), -1e300
    n = planes[guess]
    x = R[0] * n[0] + R[1] * n[1] + R[2] * n[2]
    y = R[3] * n[0] + R[4] * n[1] + R[5] * n[2]
    z = R[6] * n[0] + R[7] * n[1] + R[8] * n[2]
    gap = n[0] * center[0] + n[1] * center[1] + n[2] * center[2] - n[3] - need
    return (x, y, z), (abs(x), abs(y), abs(z)), gap


@inlined_kernel
def _children_near(boxes, at, body, half, turned, plane):
    """Return a mask of the children of a node that boxes and a plane do not tell to be far."""
    middle, (n, m, offset) = body[2], plane
    lx, ux = load_lanes(boxes, at), load_lanes(boxes, at + 3 * LANES)
    ly, uy = load_lanes(boxes, at + LANES), load_lanes(boxes, at + 4 * LANES)
    lz, uz = load_lanes(boxes, at + 2 * LANES), load_lanes(boxes, at + 5 * LANES)
    px, qx = 0.5 * (lx + ux) - middle[0], 0.5 * (ux - lx)
    py, qy = 0.5 * (ly + uy) - middle[1], 0.5 * (uy - ly)
    pz, qz = 0.5 * (lz + uz) - middle[2], 0.5 * (uz - lz)
    gap = _near_box(px, py, pz, qx, qy, qz, body, half, turned)
    beyond = n[0] * px + n[1] * py + n[2] * pz - (m[0] * qx + m[1] * qy + m[2] * qz) + offset
    return bits_of(larger(gap, beyond) < load_lanes(boxes, at + 6 * LANES))


@inlined_kernel
def _exact_pose(places, table, c, a, k):
    """Return the pose of a body in a cloud's frame, as all that measures pairs has it."""
    X, Y = places.X_WG[a], table.X_WC[c]
    R_WA = (
        X[0, k], X[1, k], X[2, k], X[4, k], X[5, k], X[6, k], X[8, k], X[9, k], X[10, k]
    )  # fmt: skip
    R_WC = (
        Y[0, 0], Y[0, 1], Y[0, 2], Y[1, 0], Y[1, 1], Y[1, 2], Y[2, 0], Y[2, 1], Y[2, 2]
    )  # fmt: skip
    p_WA, p_WC = (X[3, k], X[7, k], X[11, k]), (Y[0, 3], Y[1, 3], Y[2, 3])
    return relative_pose(R_WC, p_WC, R_WA, p_WA)


@inlined_kernel
def _is_nearer(held, tree, node, i, radius, most, j, where, a):
    """Tell whether a ball is nearer to a body than ``most``, m, as any pair is decided."""
    places, table, c, k = where
    p = (tree.points[node, 0, i], tree.points[node, 1, i], tree.points[node, 2, i])
    point, reach = point_row_of(held), max(most + radius, 0.0)
    arguments = held, point, j, (_IDENTITY, p), _exact_pose(places, table, c, a, k), reach, 0.0
    return _pair_distance(measure_of(held), arguments)[0] - radius < most


@inlined_kernel
def any_near(held, tree, body, where, need, limit, decides, guesses, a):
    """Tell whether a ball may be nearer than ``need`` (m) to a body; see ``body_in_cloud``.

    ``where`` are places, table, cloud of the table and configuration, which tell the pose. With
    ``decides`` it tells whether one is nearer than ``limit``, which is less, as exactly as any
    pair is decided.
    """
    R, _, middle, _, first, last, box, j = body
    table = where[1]
    half = (box[0] + need, box[1] + need, box[2] + need)
    M = body[1]
    turned = (
        M[0] * box[0] + M[1] * box[1] + M[2] * box[2] + need,
        M[3] * box[0] + M[4] * box[1] + M[5] * box[2] + need,
        M[6] * box[0] + M[7] * box[1] + M[8] * box[2] + need,
    )
    nodes, count = _nodes(), 0
    if len(tree.points) > 0:
        nodes[0, 0], nodes[0, 1], count = len(tree.starts) - 1, 0, 1
        if not decides and 0 <= guesses[a, 1] < len(tree.points):
            # Bodies move little from one look at them to the next.
            nodes[1, 0], nodes[1, 1], count = 0, guesses[a, 1], 2
    has_radii = len(tree.radii) > 0
    guess = guesses[a, 0]
    plane = _plane_in_cloud(body, table.planes, guess, need)
    while count > 0:
        count -= 1
        level, node = nodes[count, 0], nodes[count, 1]
        if level > 0:
            at = tree.starts[level - 1] + node
            bits = _children_near(tree.boxes, at * BOX * LANES, body, half, turned, plane)
            while bits != 0:
                i = lowest_bit(bits)
                bits &= bits - 1
                nodes[count, 0], nodes[count, 1] = level - 1, LANES * node + i
                count += 1
            continue
        at = node * 3 * LANES
        dx = load_lanes(tree.points, at) - middle[0]
        dy = load_lanes(tree.points, at + LANES) - middle[1]
        dz = load_lanes(tree.points, at + 2 * LANES) - middle[2]
        radii = dx * 0.0 + tree.radius[1]
        if has_radii:
            radii = load_lanes(tree.radii, node * LANES)
        gap = _near_box(dx, dy, dz, 0.0, 0.0, 0.0, body, half, turned)
        bits = bits_of(gap < radii)
        if bits == 0:
            continue
        x = R[0] * dx + R[3] * dy + R[6] * dz
        y = R[1] * dx + R[4] * dy + R[7] * dz
        z = R[2] * dx + R[5] * dy + R[8] * dz
        bits = _beyond_planes(x, y, z, radii, bits, body, need, table.planes, guesses, a)
        if guesses[a, 0] != guess:
            guess = guesses[a, 0]
            plane = _plane_in_cloud(body, table.planes, guess, need)
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            is_told = not decides and last > first
            radius = tree.radii[node, i] if has_radii else tree.radius[1]
            most = limit if decides else need
            if is_told or _is_nearer(held, tree, node, i, radius, most, j, where, a):
                guesses[a, 1] = node
                return True
    return False

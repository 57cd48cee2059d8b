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
    guess = guesses[a]
    if first <= guess < last:
        n = planes[guess]
        bits &= ~bits_of(x * n[0] + y * n[1] + z * n[2] - n[3] >= enough)
    k = first
    while bits != 0 and k < last:
        n = planes[k]
        left = bits & ~bits_of(x * n[0] + y * n[1] + z * n[2] - n[3] >= enough)
        if left != bits:
            guesses[a] = k
        bits = left
        k += 1
    return bits


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
def any_near(held, tree, body, where, need, limit, decides, guesses, a):
    """Tell whether a ball may be nearer than ``need`` (m) to a body; see ``body_in_cloud``.

    ``where`` are places, table, cloud of the table and configuration, which tell the pose. With
    ``decides`` it tells whether one is nearer than ``limit``, which is less, as exactly as any
    pair is decided.
    """
    R, _, middle, _, first, last, box, j = body
    places, table, c, k = where
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
    has_radii = len(tree.radii) > 0
    while count > 0:
        count -= 1
        level, node = nodes[count, 0], nodes[count, 1]
        if level > 0:
            at, boxes = (tree.starts[level - 1] + node) * BOX * LANES, tree.boxes
            lx, ux = load_lanes(boxes, at), load_lanes(boxes, at + 3 * LANES)
            ly, uy = load_lanes(boxes, at + LANES), load_lanes(boxes, at + 4 * LANES)
            lz, uz = load_lanes(boxes, at + 2 * LANES), load_lanes(boxes, at + 5 * LANES)
            gap = _near_box(
                0.5 * (lx + ux) - middle[0], 0.5 * (ly + uy) - middle[1],
                0.5 * (lz + uz) - middle[2], 0.5 * (ux - lx), 0.5 * (uy - ly), 0.5 * (uz - lz),
                body, half, turned,
            )  # fmt: skip
            bits = bits_of(gap < load_lanes(boxes, at + 6 * LANES))
            while bits != 0:
                i = lowest_bit(bits)
                bits &= bits - 1
                nodes[count, 0], nodes[count, 1] = level - 1, LANES * node + i
                count += 1
            continue
        at = node * 3 * LANES
        px, py = load_lanes(tree.points, at), load_lanes(tree.points, at + LANES)
        pz = load_lanes(tree.points, at + 2 * LANES)
        dx, dy, dz = px - middle[0], py - middle[1], pz - middle[2]
        radii = dx * 0.0 + tree.radius[1]
        if has_radii:
            radii = load_lanes(tree.radii, node * LANES)
        gap = _near_box(dx, dy, dz, 0.0, 0.0, 0.0, body, half, turned)
        bits = bits_of(gap < radii)
        if bits != 0 and last > first:
            x = R[0] * dx + R[3] * dy + R[6] * dz
            y = R[1] * dx + R[4] * dy + R[7] * dz
            z = R[2] * dx + R[5] * dy + R[8] * dz
            bits = _beyond_planes(x, y, z, radii, bits, body, need, table.planes, guesses, a)
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            if not decides and last > first:
                return True
            p = (tree.points[node, 0, i], tree.points[node, 1, i], tree.points[node, 2, i])
            radius = tree.radii[node, i] if has_radii else tree.radius[1]
            most, X_CB = limit if decides else need, _exact_pose(places, table, c, a, k)
            point, reach = point_row_of(held), max(most + radius, 0.0)
            arguments = held, point, j, (_IDENTITY, p), X_CB, reach, 0.0
            if _pair_distance(measure_of(held), arguments)[0] - radius < most:
                return True
    return False

"""Whether any ball of a cloud is nearer to a robot's body than a distance, by yes or no.

That takes a fraction of the time of finding the distance. A grid of bits says where there are no
points at all near the body's box; a tree of boxes which eight may be near; and planes between a
hull and points which of these are not. What none of them decides, the distance of the point does.
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
from scene_graph_ros.geometry.query.elements.element_places import first_cloud_of, measure_of
from scene_graph_ros.geometry.tables.point_tree import BOX, cell_of, GRID

__all__ = ["any_near", "may_be_near"]

_STACK = 128
_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

_nodes = stack_array((_STACK, 2), np.int64)
_pair_distance = PAIR_DISTANCE.call


@inlined_kernel
def may_be_near(tree, lower, upper):
    """Tell whether balls may be in a box along the axes of C, by the grid of bits."""
    if len(tree.occupied) == 0:
        return False
    radius = tree.radius[0]
    x, last_x = cell_of(tree, 0, lower[0] - radius), cell_of(tree, 0, upper[0] + radius)
    y, last_y = cell_of(tree, 1, lower[1] - radius), cell_of(tree, 1, upper[1] + radius)
    z, last_z = cell_of(tree, 2, lower[2] - radius), cell_of(tree, 2, upper[2] + radius)
    for axis in range(3):  # -1 becomes 0, so what is before the grid has to be told apart
        if upper[axis] + radius < tree.bounds[0, axis]:
            return False
    x, y, z = max(x, 0), max(y, 0), max(z, 0)
    last_x, last_y, last_z = min(last_x, GRID - 1), min(last_y, GRID - 1), min(last_z, GRID - 1)
    if x > last_x or y > last_y or z > last_z:
        return False
    count = last_x - x + 1
    mask = ((np.int64(1) << count) - 1) << x
    found = np.int64(0)
    for k in range(z, last_z + 1):
        for j in range(y, last_y + 1):
            found |= tree.occupied[k, j]
        if found & mask != 0:
            return True
    return False


@inlined_kernel
def _near_box(px, py, pz, qx, qy, qz, body, half, turned):
    """Return how far boxes in C are from a body's box at most along any of six axes, in lanes."""
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
    """Return which of the points are farther than ``need`` from a hull along no face's normal."""
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
def any_near(held, tree, body, X_CB, need, limit, decides, planes, guesses, a):
    """Tell whether a ball may be nearer than ``need`` (m) to a body; see ``body_in_cloud``.

    With ``decides`` whether one is nearer than ``limit``, which is less, as exactly as any pair is
    decided.
    """
    R, _, middle, center, first, last, box, j = body
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
            bits = _beyond_planes(x, y, z, radii, bits, body, need, planes, guesses, a)
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            if not decides and last > first:
                return True
            p = (tree.points[node, 0, i], tree.points[node, 1, i], tree.points[node, 2, i])
            radius = tree.radii[node, i] if has_radii else tree.radius[1]
            most = limit if decides else need
            arguments = held, first_cloud_of(held) - 1, j, (_IDENTITY, p), X_CB, most + radius, 0.0
            if _pair_distance(measure_of(held), arguments)[0] - radius < most:
                return True
    return False

"""Whether any ball of a cloud is nearer to a robot's body than a distance, by yes or no.

That takes a fraction of the time of finding the distance. A tree of boxes says which eight points
may be near, planes between a hull and points which of these are not, and a rounded box in the hull
which surely are. What none of these decides, the distance of the point does.
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    bits_of,
    LANES,
    larger,
    load_lanes,
    lowest_bit,
    magnitude,
    store_lanes,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.query.distance.pair_entry import PAIR_DISTANCE
from scene_graph_ros.geometry.query.elements.element_places import measure_of, point_row_of
from scene_graph_ros.geometry.spatial.vectors import relative_pose
from scene_graph_ros.geometry.tables.point_tree import BOX

__all__ = ["any_near"]

_STACK = 128

_SURE = 1e4
"""Times what rounding is allowed: how much nearer than asked a ball is that is not measured."""

_FINE = 5e-3
"""Metres beyond the limit: where less is asked for, planes that do not separate are not taken for
nearness. They tell less than the distance at a hull's edges, which halving would not change."""

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

_nodes = stack_array((_STACK, 2), np.int64)
_depths = stack_array((LANES,))
_pair_distance = PAIR_DISTANCE.call


@inlined_kernel
def _along_axes(px, py, pz, qx, qy, qz, turned):
    """Return the largest gap of boxes in C and a body's along the axes of C, in lanes."""
    x_gap = magnitude(px) - qx - turned[0]
    return larger(larger(x_gap, magnitude(py) - qy - turned[1]), magnitude(pz) - qz - turned[2])


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
def _surely_near(x, y, z, radii, body, least):
    """Return a mask of points whose balls are nearer than ``least`` to what is inside a body."""
    inside = body[8]
    x, y = larger(magnitude(x) - inside[0], 0.0), larger(magnitude(y) - inside[1], 0.0)
    z = larger(magnitude(z) - inside[2], 0.0)
    reach = radii + (inside[3] + least)
    return bits_of(x * x + y * y + z * z < reach * larger(reach, 0.0))


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
def _children_near(boxes, at, body, half, turned, plane, depths):
    """Return a mask of the children of a node that boxes and a plane do not tell to be far.

    ``depths`` become how far out of the body's box their middles are, negative inside.
    """
    middle, (n, m, offset) = body[2], plane
    radii = load_lanes(boxes, at + 6 * LANES)
    lx, ux = load_lanes(boxes, at), load_lanes(boxes, at + 3 * LANES)
    ly, uy = load_lanes(boxes, at + LANES), load_lanes(boxes, at + 4 * LANES)
    lz, uz = load_lanes(boxes, at + 2 * LANES), load_lanes(boxes, at + 5 * LANES)
    px, qx = 0.5 * (lx + ux) - middle[0], 0.5 * (ux - lx)
    py, qy = 0.5 * (ly + uy) - middle[1], 0.5 * (uy - ly)
    pz, qz = 0.5 * (lz + uz) - middle[2], 0.5 * (uz - lz)
    bits = bits_of(_along_axes(px, py, pz, qx, qy, qz, turned) < radii)
    if bits == 0:
        return bits
    beyond = n[0] * px + n[1] * py + n[2] * pz - (m[0] * qx + m[1] * qy + m[2] * qz) + offset
    bits &= bits_of(beyond < radii)
    if bits == 0:
        return bits
    R, M = body[0], body[1]
    x = magnitude(R[0] * px + R[3] * py + R[6] * pz) - half[0]
    y = magnitude(R[1] * px + R[4] * py + R[7] * pz) - half[1]
    z = magnitude(R[2] * px + R[5] * py + R[8] * pz) - half[2]
    x_gap = x - (M[0] * qx + M[3] * qy + M[6] * qz)
    y_gap = y - (M[1] * qx + M[4] * qy + M[7] * qz)
    z_gap = z - (M[2] * qx + M[5] * qy + M[8] * qz)
    store_lanes(depths, 0, larger(larger(x, y), z))
    return bits & bits_of(larger(larger(x_gap, y_gap), z_gap) < radii)


@inlined_kernel
def _put_children(nodes, count, level, first, bits, depths):
    """Put the children of a mask on the pile, the deepest last; return how many wait then.

    The first leaf that is looked at is deep in the body if any is, so that few are.
    """
    deepest, best = math.inf, -1
    while bits != 0:
        i = lowest_bit(bits)
        bits &= bits - 1
        child = first + i
        if depths[i] < deepest:
            deepest, best, child = depths[i], child, best
        if child >= 0:
            nodes[count, 0], nodes[count, 1] = level, child
            count += 1
    if best >= 0:
        nodes[count, 0], nodes[count, 1] = level, best
        count += 1
    return count


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
    R, _, middle, _, first, last, box, j, _ = body
    table = where[1]
    half = (box[0] + need, box[1] + need, box[2] + need)
    M = body[1]
    turned = (
        M[0] * box[0] + M[1] * box[1] + M[2] * box[2] + need,
        M[3] * box[0] + M[4] * box[1] + M[5] * box[2] + need,
        M[6] * box[0] + M[7] * box[1] + M[8] * box[2] + need,
    )
    nodes, count = _nodes(), 0
    depths = _depths()
    if len(tree.points) > 0:
        nodes[0, 0], nodes[0, 1], count = len(tree.starts) - 1, 0, 1
        if not decides and 0 <= guesses[a, 1] < len(tree.points):
            # Bodies move little from one look at them to the next.
            nodes[1, 0], nodes[1, 1], count = 0, guesses[a, 1], 2
    has_radii = len(tree.radii) > 0
    most = limit if decides else need
    least = most - _SURE * table.slacks[where[2]]
    guess = guesses[a, 0]
    plane = _plane_in_cloud(body, table.planes, guess, need)
    while count > 0:
        count -= 1
        level, node = nodes[count, 0], nodes[count, 1]
        if level > 0:
            at = tree.starts[level - 1] + node
            bits = _children_near(tree.boxes, at * BOX * LANES, body, half, turned, plane, depths)
            count = _put_children(nodes, count, level - 1, LANES * node, bits, depths)
            continue
        at = node * 3 * LANES
        dx = load_lanes(tree.points, at) - middle[0]
        dy = load_lanes(tree.points, at + LANES) - middle[1]
        dz = load_lanes(tree.points, at + 2 * LANES) - middle[2]
        radii = dx * 0.0 + tree.radius[1]
        if has_radii:
            radii = load_lanes(tree.radii, node * LANES)
        bits = bits_of(_along_axes(dx, dy, dz, 0.0, 0.0, 0.0, turned) < radii)
        if bits == 0:
            continue
        x = R[0] * dx + R[3] * dy + R[6] * dz
        y = R[1] * dx + R[4] * dy + R[7] * dz
        z = R[2] * dx + R[5] * dy + R[8] * dz
        gap = larger(magnitude(x) - half[0], magnitude(y) - half[1])
        bits &= bits_of(larger(gap, magnitude(z) - half[2]) < radii)
        if bits == 0:
            continue
        if _surely_near(x, y, z, radii, body, least) != 0:
            guesses[a, 1] = node
            return True
        bits = _beyond_planes(x, y, z, radii, bits, body, need, table.planes, guesses, a)
        if guesses[a, 0] != guess:
            guess = guesses[a, 0]
            plane = _plane_in_cloud(body, table.planes, guess, need)
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            is_told = not decides and last > first and need - limit > _FINE
            radius = tree.radii[node, i] if has_radii else tree.radius[1]
            if is_told or _is_nearer(held, tree, node, i, radius, most, j, where, a):
                guesses[a, 1] = node
                return True
    return False

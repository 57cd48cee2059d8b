"""The triangles of a mesh that are nearest to a core, or cut by it: down a tree of boxes.

The search begins beside a point where the nearest triangle may be. Of the others it passes over
those farther than the nearest so far: by the boxes, and by the plane across the contact's normal
that the core is behind. A triangle that is not in front of the contact's, along that normal, is no
nearer, but for rounding. Where the core reaches deep into one triangle, of all others it only
matters whether they are cut.
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import (
    inlined_kernel,
    lean_kernel,
    merged_kernel,
)
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.meshes.bvh import MAX_DEPTH
from scene_graph_ros.geometry.narrowphase.convex_distance import convex_distance
from scene_graph_ros.geometry.narrowphase.cores.questions import placed_support, support
from scene_graph_ros.geometry.narrowphase.pair import Pair, Placed, Workspace
from scene_graph_ros.geometry.narrowphase.propose.gjk import FAR, gjk, OVERLAP
from scene_graph_ros.geometry.query.distance.contact_normal import corners_of, triangle_core
from scene_graph_ros.geometry.query.distance.triangle_triangle import reach_of
from scene_graph_ros.geometry.spatial.vectors import dot, scale
from scene_graph_ros.geometry.tolerances import COINCIDENCE, NEAR_CONTACT

__all__ = ["nearest_on_hull", "plane_of_core", "search_triangles"]

_FIRST_CAPACITY = 64

_simplex = stack_array((5, 9))
_corners, _weights = stack_array((5, 2), np.int64), stack_array((4,))
"""What GJK works on, in the machine's stack."""


@lean_kernel
def box_gap(lower, upper, node_lower, node_upper, node):
    """Return the distance between a box and a node's box."""
    total = 0.0
    for axis in range(3):
        gap = max(node_lower[node, axis] - upper[axis], lower[axis] - node_upper[node, axis], 0.0)
        total += gap * gap
    return math.sqrt(total)


@lean_kernel
def _triangle_gap(lower, upper, params):
    """Return the distance between a box and a triangle's bounding box."""
    total = 0.0
    for axis in range(3):
        low = min(params[axis], params[axis + 3], params[axis + 6])
        high = max(params[axis], params[axis + 3], params[axis + 6])
        gap = max(low - upper[axis], lower[axis] - high, 0.0)
        total += gap * gap
    return math.sqrt(total)


@lean_kernel
def _node_front(lower, upper, node, n):
    """Return the support of a node's box along n."""
    total = 0.0
    for axis in range(3):
        total += max(n[axis] * lower[node, axis], n[axis] * upper[node, axis])
    return total


@lean_kernel
def _triangle_front(params, n):
    """Return the support of a triangle along n."""
    first = n[0] * params[0] + n[1] * params[1] + n[2] * params[2]
    second = n[0] * params[3] + n[1] * params[4] + n[2] * params[5]
    third = n[0] * params[6] + n[1] * params[7] + n[2] * params[8]
    return max(first, second, third)


@lean_kernel
def plane_of_core(at, n):
    """Return (n, h): all of a core is where n . x >= h, and some of it at h."""
    x, _ = placed_support(Placed(at.core, at.R, at.p), at.hulls, scale(-1.0, n))
    return n, dot(n, x)


@lean_kernel
def _is_closer(surfaces, new, old, tolerance):
    """Return whether the contact (distance, triangle, point, normal) is better than another.

    Of contacts as near as each other it is the one whose plane the other's triangle is behind:
    beside the border of a face, distances tell to half the digits only which side it is.
    """
    if abs(new[0] - old[0]) > tolerance:
        return new[0] < old[0]
    vertices, triangles = surfaces.vertices, surfaces.triangles
    beyond_new = reach_of(corners_of(vertices, triangles, old[1]), new[3], new[2])
    beyond_old = reach_of(corners_of(vertices, triangles, new[1]), old[3], old[2])
    if abs(beyond_new - beyond_old) > tolerance:
        return beyond_new < beyond_old
    return new[0] < old[0]


@inlined_kernel
def _leaf_near(surfaces, node, p):
    """Return a leaf below a node, down the boxes that are nearer to a point than those beside."""
    lower, upper = surfaces.node_lower, surfaces.node_upper
    left = surfaces.node_left[node]
    while left >= 0:
        right = surfaces.node_right[node]
        is_left = box_gap(p, p, lower, upper, left) <= box_gap(p, p, lower, upper, right)
        node = left if is_left else right
        left = surfaces.node_left[node]
    return node


@inlined_kernel
def _is_cut(triangle, at, tolerance):
    """Return (is certain, whether a bare core touches a triangle), by GJK, which asks no depth."""
    corners, p = triangle[3], at.p
    v = (corners[0] - p[0], corners[1] - p[1], corners[2] - p[2])
    if not dot(v, v) > 0.0:
        v = (1.0, 0.0, 0.0)
    pair = Pair(triangle, at.core, at.R, p, at.hulls)
    work = Workspace(_simplex(), _corners(), _weights())
    status, _, _, _, _ = gjk(pair, v, 0, tolerance, 0.0, 0.0, work)
    return status in (FAR, OVERLAP), status == OVERLAP


@lean_kernel
def _push_children(surfaces, lower, upper, node, stack, depth):
    """Put a node's children on the stack, the child whose box is nearer to the core's last."""
    left, right = surfaces.node_left[node], surfaces.node_right[node]
    gap_left = box_gap(lower, upper, surfaces.node_lower, surfaces.node_upper, left)
    gap_right = box_gap(lower, upper, surfaces.node_lower, surfaces.node_upper, right)
    stack[depth] = right if gap_left <= gap_right else left
    stack[depth + 1] = left if gap_left <= gap_right else right


@merged_kernel
def _noted(cuts, count, t):
    """Return the array of triangles that are cut, with one more."""
    if count == cuts.shape[0]:
        longer = np.empty(2 * count, np.int64)
        longer[:count] = cuts
        cuts = longer
    cuts[count] = t
    return cuts


@inlined_kernel
def _foremost_of_leaf(surfaces, node, n):
    """Return the place in the order of the triangle of a leaf that reaches furthest along n."""
    left, right = surfaces.node_left[node], surfaces.node_right[node]
    best, highest = -1 - left, -math.inf
    for slot in range(-1 - left, -1 - left + right):
        triangle = triangle_core(surfaces.vertices, surfaces.triangles, surfaces.order[slot])
        front = _triangle_front(triangle[3], n)
        if front > highest:
            best, highest = slot, front
    return best


@merged_kernel
def nearest_on_hull(at, plane, near, sizes, allowed):
    """Return (is proven, distance, p_MN, n, unique) of a bare core and a triangle of a mesh.

    It is one beside a point ``near``, and proven to be the nearest if all of the mesh's convex
    hull is behind it, seen from the core. ``plane`` is one that is in front of the hull, as
    ``plane_of_core`` has it; ``sizes`` are how far it may be, and the rounding of distances.
    """
    surfaces, (bound, rounding), (across, behind) = at.surfaces, sizes, plane
    passed, nearest, nearest_triangle = bound + rounding, math.inf, -1
    p_MN, n, is_unique = at.p, across, True
    node = _leaf_near(surfaces, surfaces.node_start[at.surface], near)
    first = _foremost_of_leaf(surfaces, node, across)
    left, right = surfaces.node_left[node], surfaces.node_right[node]
    for trial in range(-1, right):
        slot = first if trial < 0 else -1 - left + trial
        triangle = triangle_core(surfaces.vertices, surfaces.triangles, surfaces.order[slot])
        is_again = slot == first and trial >= 0
        if is_again or behind - _triangle_front(triangle[3], across) > passed:
            continue
        best = min(bound, nearest + rounding)
        distance, a, _, m, unique, _, _ = convex_distance(
            triangle, at.core, at.R, at.p, at.hulls, best, allowed
        )
        if distance > best:
            continue
        t, m = surfaces.order[slot], scale(-1.0, m)
        new, old = (distance, t, a, m), (nearest, nearest_triangle, p_MN, n)
        if nearest_triangle < 0 or _is_closer(surfaces, new, old, rounding):
            nearest, nearest_triangle, p_MN, n, is_unique = distance, t, a, m, unique
            across, behind = plane_of_core(at, m)
            passed = nearest - rounding
    if nearest_triangle < 0:
        return False, nearest, p_MN, n, is_unique
    x, _ = support(at.hull, at.hulls, n)
    return dot(n, x) <= behind - nearest + rounding, nearest, p_MN, n, is_unique


@merged_kernel
def search_triangles(at, around, near, sizes, allowed):
    """Return (distance, error, p_MN, n, unique, cuts, count) of a mesh and a bare core.

    ``sizes`` are a bound, a tolerance, and the larger of both sizes. It is the nearest triangle
    no further than the bound, with the witness on the mesh and the normal out of it into the core;
    or the ``count`` triangles within the tolerance of the core, in ``cuts``, and its answer to the
    one it is nearest to, or to one that it reaches deep into. ``error`` bounds that of the
    distance; ``around`` holds the bounds of the core; the search begins beside the point ``near``.
    """
    surfaces, (bound, tolerance, larger) = at.surfaces, sizes
    cuts = np.empty(_FIRST_CAPACITY, np.int64)
    stack = np.empty(MAX_DEPTH + 2, np.int64)
    (lower, upper), (across, behind) = around
    rounding, deep = COINCIDENCE * larger, NEAR_CONTACT * larger
    # ``best`` is the least distance that is worth a look, ``nearest`` that of the contact, and
    # ``passed`` how far in front of all else the core may be along the contact's normal.
    best, p_MN, n, is_unique = max(bound, tolerance), at.p, (0.0, 0.0, 1.0), True
    nearest, nearest_triangle, error = math.inf, -1, 0.0
    passed = best + rounding
    root = surfaces.node_start[at.surface]
    first = _leaf_near(surfaces, root, near)
    stack[0], stack[1] = root, first
    count, depth, is_begun = 0, 2, False
    while depth > 0:
        depth -= 1
        node = stack[depth]
        is_again, is_begun = node == first and is_begun, True
        front = _node_front(surfaces.node_lower, surfaces.node_upper, node, across)
        gap = box_gap(lower, upper, surfaces.node_lower, surfaces.node_upper, node)
        if is_again or gap > best or behind - front > passed:
            continue
        left, right = surfaces.node_left[node], surfaces.node_right[node]
        if left >= 0:
            _push_children(surfaces, lower, upper, node, stack, depth)
            depth += 2
            continue
        for slot in range(-1 - left, -1 - left + right):
            t = surfaces.order[slot]
            triangle = triangle_core(surfaces.vertices, surfaces.triangles, t)
            front = _triangle_front(triangle[3], across)
            if behind - front > passed or _triangle_gap(lower, upper, triangle[3]) > best:
                continue
            is_cut, is_known = False, nearest < -deep
            if is_known:
                is_known, is_cut = _is_cut(triangle, at, tolerance)
            distance, a, m, unique, gap = math.inf, at.p, n, True, 0.0
            if not is_known:
                distance, a, _, m, unique, gap, _ = convex_distance(
                    triangle, at.core, at.R, at.p, at.hulls, best, allowed
                )
                is_cut = distance <= tolerance
            if is_cut:
                cuts = _noted(cuts, count, t)
                count += 1
            if distance > best:
                continue
            m = scale(-1.0, m)
            new, old = (distance, t, a, m), (nearest, nearest_triangle, p_MN, n)
            if nearest_triangle < 0 or _is_closer(surfaces, new, old, rounding):
                nearest, nearest_triangle, p_MN, n, is_unique = distance, t, a, m, unique
                error = gap
                across, behind = plane_of_core(at, m)
                best = min(best, max(distance + rounding, tolerance))
                passed = best + rounding if nearest <= tolerance else nearest - rounding
    return nearest, error, p_MN, n, is_unique, cuts, count

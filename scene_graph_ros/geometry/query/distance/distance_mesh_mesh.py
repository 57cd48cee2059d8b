"""Signed distance of two meshes, each measured by its triangles.

- Apart (no triangles cut each other, no mesh is inside the other): the distance of the nearest
  triangles, exact. Next to contact the normal is that of all the pairs in contact
  (``contact_normal``); pairs that overlap by rounding only touch.
- Inside (one mesh is wholly inside the other, which is closed): it leaves across the plane through
  the outer mesh's point nearest to it, at a right angle to the way there.
- Cut: the deepest vertex of one that is inside the other, which must be closed, leaves by its
  nearest point. Where no vertex is inside by more than rounding, of each pair of triangles that
  cut each other one leaves across the other's plane, the shallower way, and the deepest pair
  decides.

Inside and cut, they may also leave as their convex hulls would, if that is shorter: a translation
that separates them for certain.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel, merged_kernel
from scene_graph_ros.geometry.meshes.bvh import MAX_DEPTH
from scene_graph_ros.geometry.narrowphase.convex_distance import convex_distance
from scene_graph_ros.geometry.narrowphase.cores.kinds import HULL
from scene_graph_ros.geometry.narrowphase.cores.questions import placed_support
from scene_graph_ros.geometry.narrowphase.pair import body_A, body_B, Pair
from scene_graph_ros.geometry.query.distance.contact_normal import (
    corners_of,
    normal_of_triangles,
    TOUCHING,
    touching_point,
    touching_triangles,
)
from scene_graph_ros.geometry.query.distance.distance_convex_mesh import is_in_box
from scene_graph_ros.geometry.query.distance.triangle_triangle import (
    distance_triangle_triangle,
    reach_of,
)
from scene_graph_ros.geometry.query.point.mesh_cone import bounds_solid
from scene_graph_ros.geometry.query.point.point_mesh import point_mesh
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    dot,
    load_vector,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    transpose,
)
from scene_graph_ros.geometry.tables.table_arrays import Surfaces
from scene_graph_ros.geometry.tolerances import COINCIDENCE, NEAR_CONTACT

__all__ = ["distance_mesh_mesh"]

_FIRST_CAPACITY = 64
_ZEROS = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class TwoMeshes(NamedTuple):
    """Rows A and B of the surfaces, B at the pose (R, p) in A's frame."""

    surfaces: Surfaces
    A: int
    B: int
    size: float
    """Metres: the larger of both."""
    R: Any
    p: tuple[float, float, float]
    """Metres."""


@lean_kernel
def _node_gap(lower, upper, a, b, R, p):
    """Return a lower bound of the distance between node a and node b, which is placed at R, p."""
    half = (
        0.5 * (upper[b, 0] - lower[b, 0]),
        0.5 * (upper[b, 1] - lower[b, 1]),
        0.5 * (upper[b, 2] - lower[b, 2]),
    )
    middle = (lower[b, 0] + half[0], lower[b, 1] + half[1], lower[b, 2] + half[2])
    centre = add(rotate(R, middle), p)
    total = 0.0
    for axis in range(3):
        reach = abs(R[3 * axis]) * half[0]
        reach += abs(R[3 * axis + 1]) * half[1] + abs(R[3 * axis + 2]) * half[2]
        low, high = centre[axis] - reach, centre[axis] + reach
        gap = max(lower[a, axis] - high, low - upper[a, axis], 0.0)
        total += gap * gap
    return math.sqrt(total)


@lean_kernel
def _diagonal(lower, upper, node):
    """Return the sum of a node's extents: which of two nodes is the larger."""
    total = 0.0
    for axis in range(3):
        total += upper[node, axis] - lower[node, axis]
    return total


@lean_kernel
def _reach_behind(triangle, n, height):
    """Return (depth, x): how far a triangle reaches behind the plane n . x = height, and where."""
    x = triangle[0]
    if dot(n, triangle[1]) < dot(n, x):
        x = triangle[1]
    if dot(n, triangle[2]) < dot(n, x):
        x = triangle[2]
    return height - dot(n, x), x


@lean_kernel
def _part(first, second, n_first, n_second, first_is_solid, second_is_solid):
    """Return (depth, x, n) of two triangles that cut: the shallowest way of the first out.

    x is the point of the first, or of the second's plane, that x + depth n leaves by.
    """
    depth, x = _reach_behind(first, n_second, dot(n_second, second[0]))
    n = n_second
    if not second_is_solid:
        back = scale(-1.0, n_second)
        other, y = _reach_behind(first, back, dot(back, second[0]))
        if other < depth:
            depth, x, n = other, y, back
    other, y = _reach_behind(second, n_first, dot(n_first, first[0]))
    if other < depth:
        depth, n = other, scale(-1.0, n_first)
        x = axpy(other, n_first, y)
    if not first_is_solid:
        back = scale(-1.0, n_first)
        other, y = _reach_behind(second, back, dot(back, first[0]))
        if other < depth:
            depth, n = other, n_first
            x = axpy(other, back, y)
    return depth, x, n


@lean_kernel
def _is_closer(new, old, tolerance):
    """Return whether the contact (distance, point, normal, first, second) is better than another.

    Of contacts as near as each other it is the one between whose planes the other's triangles are
    not: beside the border of a face, distances tell to half the digits only which side it is.
    """
    if abs(new[0] - old[0]) > tolerance:
        return new[0] < old[0]
    beyond_new, beyond_old = _reach_between(new, old), _reach_between(old, new)
    if abs(beyond_new - beyond_old) > tolerance:
        return beyond_new < beyond_old
    return new[0] < old[0]


@lean_kernel
def _reach_between(contact, other):
    """Return the support of the other contact's triangles between the planes of a contact."""
    distance, x, n = contact[0], contact[1], contact[2]
    first = reach_of(other[3], scale(-1.0, n), x)
    return max(first, reach_of(other[4], n, axpy(-distance, n, x)))


@merged_kernel
def _search(surfaces, k, m, R, p, bound, tolerance, rounding):
    """Return (distance, x, n, depth, y, m, pairs, count): the nearest triangles, or their cut.

    ``distance`` is inf beyond ``bound``. n points out of the second surface into the first. Where
    triangles are within ``tolerance`` of each other, or cut, they are the ``count`` ``pairs``, and
    of those that cut or are that near the deepest leaves by ``depth``, along m, from y.
    ``rounding`` is that of distances.
    """
    pairs, count = np.empty((_FIRST_CAPACITY, 2), np.int64), 0
    stack = np.empty((2 * MAX_DEPTH + 2, 2), np.int64)
    lower, upper = surfaces.node_lower, surfaces.node_upper
    left, right = surfaces.node_left, surfaces.node_right
    # ``best`` is the least distance that is worth a look, ``nearest`` that of the contact.
    best, x, n = max(bound, tolerance), p, (0.0, 0.0, 1.0)
    nearest, first_nearest, second_nearest = math.inf, (x, x, x), (x, x, x)
    depth, y, out = -1.0, p, (0.0, 0.0, 1.0)
    stack[0] = (surfaces.node_start[k], surfaces.node_start[m])
    size = 1
    while size > 0:
        size -= 1
        a, b = stack[size]
        if _node_gap(lower, upper, a, b, R, p) > best:
            continue
        a_is_leaf, b_is_leaf = left[a] < 0, left[b] < 0
        if not (a_is_leaf and b_is_leaf):
            split_a = b_is_leaf or (
                not a_is_leaf and _diagonal(lower, upper, a) >= _diagonal(lower, upper, b)
            )
            first = (left[a], b) if split_a else (a, left[b])
            second = (right[a], b) if split_a else (a, right[b])
            near = _node_gap(lower, upper, first[0], first[1], R, p)
            if near > _node_gap(lower, upper, second[0], second[1], R, p):
                first, second = second, first
            stack[size] = second
            stack[size + 1] = first
            size += 2
            continue
        for j in range(-1 - left[b], -1 - left[b] + right[b]):
            s = surfaces.order[j]
            c0, c1, c2 = corners_of(surfaces.vertices, surfaces.triangles, s)
            other = (add(rotate(R, c0), p), add(rotate(R, c1), p), add(rotate(R, c2), p))
            n_other = rotate(R, load_vector(surfaces.normals, s))
            for i in range(-1 - left[a], -1 - left[a] + right[a]):
                t = surfaces.order[i]
                triangle = corners_of(surfaces.vertices, surfaces.triangles, t)
                n_triangle = load_vector(surfaces.normals, t)
                distance, point, normal = distance_triangle_triangle(
                    triangle, other, n_triangle, n_other
                )
                if distance > best:
                    continue
                new = (distance, point, normal, triangle, other)
                old = (nearest, x, n, first_nearest, second_nearest)
                if nearest == math.inf or _is_closer(new, old, rounding):
                    nearest, x, n, first_nearest, second_nearest = new
                    best = min(best, max(distance + rounding, tolerance))
                if distance <= tolerance:
                    if count == pairs.shape[0]:
                        longer = np.empty((2 * count, 2), np.int64)
                        longer[:count] = pairs
                        pairs = longer
                    pairs[count, 0], pairs[count, 1] = t, s
                    count += 1
                    way, start, direction = _part(
                        triangle,
                        other,
                        n_triangle,
                        n_other,
                        bounds_solid(surfaces, k, t),
                        bounds_solid(surfaces, m, s),
                    )
                    if way > depth:
                        depth, y, out = way, start, direction
    return nearest, x, n, depth, y, out, pairs, count


@kernel
def _deepest_vertex(surfaces, k, m, size, R, p):
    """Return (depth, x, n): the vertex of surface k, placed at R, p, deepest in surface m.

    ``depth`` is -1 where none is inside. n points out of m, in whose frame all is.
    """
    depth, x, n = -1.0, p, (0.0, 0.0, 1.0)
    if surfaces.solid_parts[m] == 0:
        return depth, x, n
    root = surfaces.node_start[m]
    for v in range(surfaces.vertex_start[k], surfaces.vertex_start[k + 1]):
        q = add(rotate(R, load_vector(surfaces.vertices, v)), p)
        if is_in_box(surfaces.node_lower, surfaces.node_upper, root, q):
            phi, _, grad, _ = point_mesh(surfaces, m, size, q, math.inf)
            if -phi > depth and phi < 0.0:
                depth, x, n = -phi, q, grad
    return depth, x, n


@lean_kernel
def _next_part(part, t, end):
    """Return the first row after t, and before ``end``, of another part; parts ascend."""
    low, high = t, end - 1  # part[low] is that of t, part[high] is not
    while high - low > 1:
        middle = (low + high) // 2
        if part[middle] == part[t]:
            low = middle
        else:
            high = middle
    return high


@kernel
def _is_inside(surfaces, k, m, size, R, p):
    """Return whether a part of surface k, placed at R, p, is inside surface m.

    One vertex of each part is asked for: the surfaces do not cut each other.
    """
    if surfaces.solid_parts[m] == 0:
        return False
    root = surfaces.node_start[m]
    t, end = surfaces.triangle_start[k], surfaces.triangle_start[k + 1]
    while t < end:
        first = surfaces.triangles[t, 0]
        q = add(rotate(R, load_vector(surfaces.vertices, first)), p)
        is_near = is_in_box(surfaces.node_lower, surfaces.node_upper, root, q)
        if is_near and point_mesh(surfaces, m, size, q, math.inf)[0] < 0.0:
            return True
        if surfaces.part[t] == surfaces.part[end - 1]:
            break
        t = _next_part(surfaces.part, t, end)
    return False


@merged_kernel
def _leave_containment(meshes, hulls, contact):
    """Return (depth, p_ACa, nhat_BA_A) of meshes of which one is inside the other.

    ``hulls`` is the ``Pair`` of their convex hulls, ``contact`` is (distance, x, n): n points from
    B's nearest point, x - distance n, to A's, x: the way back.
    """
    distance, x, n = contact
    n = scale(-1.0, n)
    a, _ = placed_support(body_A(hulls), hulls.hulls, scale(-1.0, n))
    b, _ = placed_support(body_B(hulls), hulls.hulls, n)
    if _is_inside(meshes.surfaces, meshes.A, meshes.B, meshes.size, *_inverse(meshes)):
        # A leaves across the plane at B's point x + distance n.
        return dot(n, subtract(x, a)) + distance, a, n
    # B leaves along -n, across the plane at A's point x.
    depth = dot(n, subtract(b, x))
    return depth, axpy(-depth, n, b), n


@merged_kernel
def _leave_by_vertex(meshes):
    """Return (depth, p_ACa, nhat_BA_A) of the deepest vertex inside; depth -1 if none is."""
    surfaces, k, m, size, R, p = meshes
    R_BA, p_BA = _inverse(meshes)
    first, x_B, n_B = _deepest_vertex(surfaces, k, m, size, R_BA, p_BA)
    second, x_A, n_A = _deepest_vertex(surfaces, m, k, size, R, p)
    if first >= second:
        return first, add(rotate(R, x_B), p), rotate(R, n_B)
    return second, axpy(second, n_A, x_A), scale(-1.0, n_A)


@lean_kernel
def _inverse(meshes):
    """Return (R_BA, p_BA)."""
    return transpose(meshes.R), scale(-1.0, rotate_inverse(meshes.R, meshes.p))


@merged_kernel
def _leave_cut(meshes, pairs, count, by_pair, by_hull):
    """Return (distance, p_ACa, p_ACb, nhat_BA_A, unique) of meshes that touch or cut each other.

    ``by_pair`` is the way out of the pair of triangles that overlap most: (depth, point of A,
    normal); ``by_hull`` is the answer of the convex hulls.
    """
    surfaces, _, _, size, R, p = meshes
    phi, n_hull, unique = by_hull[0], by_hull[3], by_hull[4]
    slack = TOUCHING * COINCIDENCE * size
    if phi >= -slack:
        x = touching_point(surfaces, R, p, pairs, count, n_hull, phi, size)
        return phi, x, axpy(-phi, n_hull, x), n_hull, unique
    depth, x, n = _leave_by_vertex(meshes)
    if depth <= slack:
        is_touching, gap, y, out, is_only_one = touching_triangles(
            surfaces, R, p, pairs, count, size
        )
        if is_touching:
            return gap, y, axpy(-gap, out, y), out, is_only_one
        # Nothing but sides cut each other: that a vertex is on a surface says nothing of them.
        depth, x, n = by_pair
    if phi > -depth:
        return by_hull
    return -depth, x, axpy(depth, n, x), n, True


@kernel
def _distance(meshes, hulls, bound):
    """Return the result of ``distance_mesh_mesh``; ``hulls`` is the ``Pair`` of convex hulls."""
    surfaces, k, m, size, R, p = meshes
    tolerance = COINCIDENCE * size
    R_BA, p_BA = _inverse(meshes)
    contained = _is_inside(surfaces, k, m, size, R_BA, p_BA)
    contained = contained or _is_inside(surfaces, m, k, size, R, p)
    reach = math.inf if contained else max(bound, 0.0)
    within = tolerance
    for _ in range(2):
        distance, x, n, depth, y, out, pairs, count = _search(
            surfaces, k, m, R, p, reach, within, tolerance
        )
        if count > 0 or contained or not distance <= NEAR_CONTACT * size:
            break
        # Next to contact: all the triangles that are as near as the nearest, but for rounding.
        within = distance + TOUCHING * tolerance
    if distance == math.inf:
        return math.inf, x, x, n, False
    if count == 0 and not contained:
        return distance, x, axpy(-distance, n, x), n, True
    phi, a, b, n_hull, unique, _, _ = convex_distance(
        hulls.core_A, hulls.core_B, R, p, hulls.hulls, math.inf, 0.0
    )
    if within > tolerance:
        if phi >= distance - TOUCHING * tolerance:
            n = n_hull
        else:
            contact = (distance, x, n)
            _, _, n = normal_of_triangles(surfaces, R, p, pairs, count, contact, size)
        return distance, x, axpy(-distance, n, x), n, True
    if count > 0:
        by_pair, by_hull = (depth, y, out), (phi, a, b, n_hull, unique)
        return _leave_cut(meshes, pairs, count, by_pair, by_hull)
    depth, y, out = _leave_containment(meshes, hulls, (distance, x, n))
    if phi > -depth:
        return phi, a, b, n_hull, unique
    return -depth, y, axpy(depth, out, y), out, True


@merged_kernel
def distance_mesh_mesh(table, i, j, R_AB, p_AB, max_distance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique) of the triangles of rows i (A) and j (B).

    Beyond ``max_distance``, phi may be inf, without witnesses.
    """
    A, B = table.surface[i], table.surface[j]
    meshes = TwoMeshes(table.surfaces, A, B, max(table.scale[i], table.scale[j]), R_AB, p_AB)
    hull_A = (HULL, np.int64(table.hulls.block_start[table.hull[i]]), 0.0, _ZEROS)
    hull_B = (HULL, np.int64(table.hulls.block_start[table.hull[j]]), 0.0, _ZEROS)
    hulls = Pair(hull_A, hull_B, R_AB, p_AB, table.hulls.blocks)
    return _distance(meshes, hulls, max_distance)

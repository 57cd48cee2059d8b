"""Signed distance from a point to a triangle mesh, exact, through the mesh's hierarchy.

Where the nearest triangle bounds a solid, the sign comes from the angle-weighted normal of the
nearest feature (Baerentzen and Aanaes, "Signed distance computation using the angle weighted
pseudonormal", 2005). A sheet has no inside: its distance is nowhere negative.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.meshes.bvh import traversal_stack
from scene_graph_ros.geometry.query.point.flat_features import (
    nearest_on_segment,
    nearest_on_triangle,
)
from scene_graph_ros.geometry.query.point.mesh_cone import (
    bounds_solid,
    box_square,
    corners_at,
    ends_of,
    turned_into_cone,
    way_from_feature,
)
from scene_graph_ros.geometry.spatial.vectors import (
    dot,
    load_vector,
    norm,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import (
    COINCIDENCE,
    EPSILON,
    GJK_ROUNDING,
    NEAR_CONTACT,
    WITNESS_SPLIT,
)

__all__ = ["border_feature", "nearest_triangle", "point_mesh"]


@lean_kernel
def _rank(feature):
    """Return 0 for a face, 1 for an edge, 2 for a corner."""
    return 0 if feature == 0 else (1 if feature <= 3 else 2)


@inlined_kernel
def _progress(surfaces, triangle, feature, p):
    """Return (vertex, s): how far from its nearer end the point of an edge nearest to p is."""
    first, last = ends_of(surfaces, triangle, feature)
    a, b = load_vector(surfaces.vertices, first), load_vector(surfaces.vertices, last)
    edge = subtract(b, a)
    length = norm(edge)
    from_first, from_last = dot(subtract(p, a), edge), -dot(subtract(p, b), edge)
    if from_first <= from_last:
        return first, from_first / length
    return last, from_last / length


@inlined_kernel
def _is_preferred(surfaces, k, p, new, old):
    """Tell whether ``new`` beats ``old``, both (distance, triangle, feature), equally near p.

    The boundary of a solid, which has an inside, wins over a sheet that lies on it. A triangle
    nearest with its face wins over an edge, and that over a corner: if they meet, it is nearer, by
    less than rounding. Of two edges at one vertex, that wins along which p is further.
    """
    distance, triangle, feature = new
    best, previous, other = old
    is_solid = bounds_solid(surfaces, k, triangle)
    if is_solid != bounds_solid(surfaces, k, previous):
        return is_solid
    if _rank(feature) != _rank(other):
        return _rank(feature) < _rank(other)
    if _rank(feature) == 1:
        vertex, s = _progress(surfaces, triangle, feature, p)
        same, least = _progress(surfaces, previous, other, p)
        if vertex == same:
            return s > least
    return distance < best


@inlined_kernel
def nearest_triangle(surfaces, k, p, bound, tolerance, split, rounding):
    """Return (x, triangle, feature, unique): the nearest point of surface k to p.

    ``triangle`` is -1 where nothing is nearer than ``bound``. ``unique`` is False where another
    point, further than ``split`` away, is as near to within ``tolerance``. Distances that differ
    by ``rounding`` do not tell triangles apart, which would turn the way there by the root of what
    their errors: of those, their features tell which is nearest, and else the order of traversal,
    which depends on nothing but p.
    """
    stack = traversal_stack()
    stack[0] = surfaces.node_start[k]
    depth = 1
    best, x, triangle, feature, unique = bound, p, -1, 0, True
    while depth > 0:
        depth -= 1
        node = stack[depth]
        reach = best + max(tolerance, rounding + GJK_ROUNDING * EPSILON * best)
        if box_square(p, surfaces.node_lower, surfaces.node_upper, node) > reach * reach:
            continue
        left, right = surfaces.node_left[node], surfaces.node_right[node]
        if left >= 0:
            near = box_square(p, surfaces.node_lower, surfaces.node_upper, left)
            far = box_square(p, surfaces.node_lower, surfaces.node_upper, right)
            stack[depth] = right if near <= far else left
            stack[depth + 1] = left if near <= far else right
            depth += 2
            continue
        for slot in range(-1 - left, -1 - left + right):
            t = surfaces.order[slot]
            a, b, c = corners_at(surfaces, t)
            n = load_vector(surfaces.normals, t)
            candidate, square, place = nearest_on_triangle(p, a, b, c, n)
            distance = math.sqrt(square)
            slack = rounding + GJK_ROUNDING * EPSILON * distance
            if distance > best + max(tolerance, slack):
                continue
            if triangle >= 0 and abs(distance - best) <= tolerance:
                unique = unique and norm(subtract(candidate, x)) <= split
            elif distance < best:
                unique = True
            is_nearer = distance < best
            if triangle >= 0 and abs(distance - best) <= slack:
                new, old = (distance, t, place), (best, triangle, feature)
                is_nearer = _is_preferred(surfaces, k, p, new, old)
            if is_nearer:
                best, x, triangle, feature = distance, candidate, t, place
    return x, triangle, feature, unique


@inlined_kernel
def _pseudonormal(surfaces, triangle, feature):
    """Return the angle-weighted normal of the feature of a triangle that a nearest point is on."""
    if feature == 0:
        return load_vector(surfaces.normals, triangle)
    if feature <= 3:
        normals = surfaces.edge_pseudonormals
        e = feature - 1
        return (normals[triangle, e, 0], normals[triangle, e, 1], normals[triangle, e, 2])
    corner = surfaces.triangles[triangle, feature - 4]
    return load_vector(surfaces.vertex_pseudonormals, corner)


@kernel
def border_feature(p, a, b, c, tolerance):
    """Return the corner or edge of a triangle that p is on, numbered as features, or 0."""
    for k in range(3):
        corner = a if k == 0 else (b if k == 1 else c)
        if norm(subtract(p, corner)) <= tolerance:
            return k + 4
    for k in range(3):
        start, end = (a, b) if k == 0 else ((b, c) if k == 1 else (c, a))
        x, _ = nearest_on_segment(p, start, end)
        if norm(subtract(p, x)) <= tolerance:
            return k + 1
    return 0


@inlined_kernel
def point_mesh(surfaces, k, size, p_GQ, bound):
    """Return (phi, p_GN, grad_G, unique) of point Q and surface k, of extent ``size``.

    Nothing nearer than ``bound`` gives phi = inf: only for a Q outside the mesh's bounding box
    may ``bound`` be finite. On the surface, the gradient is the feature's angle-weighted normal,
    and ``unique`` tells that the surface is flat there.
    """
    tolerance = COINCIDENCE * size
    p_GN, triangle, feature, unique = nearest_triangle(
        surfaces, k, p_GQ, bound, tolerance, WITNESS_SPLIT * size, tolerance
    )
    if triangle < 0:
        return math.inf, p_GQ, (1.0, 0.0, 0.0), False
    a, b, c = corners_at(surfaces, triangle)
    if feature == 0 and norm(subtract(p_GQ, p_GN)) <= tolerance:
        feature = border_feature(p_GQ, a, b, c, tolerance)
    normal = _pseudonormal(surfaces, triangle, feature)
    is_solid = bounds_solid(surfaces, k, triangle)
    if feature == 0:
        height = dot(normal, subtract(p_GQ, a))
        if not is_solid and height < 0.0:
            return -height, p_GN, scale(-1.0, normal), unique
        return height, p_GN, normal, unique
    offset = way_from_feature(surfaces, triangle, feature, p_GQ)
    phi = norm(offset)
    if phi <= tolerance:
        is_flat = 1.0 - dot(normal, load_vector(surfaces.normals, triangle)) <= COINCIDENCE
        return phi, p_GN, normal, is_flat
    grad_G = unit(offset, normal)
    if phi < NEAR_CONTACT * size:
        grad_G = turned_into_cone(surfaces, k, size, triangle, feature, p_GN, grad_G)
    if is_solid and dot(offset, normal) < 0.0:
        return -phi, p_GN, scale(-1.0, grad_G), unique
    return phi, p_GN, grad_G, unique

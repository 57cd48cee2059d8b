"""Signed distance of a convex shape to the triangles of a mesh.

K is the convex shape, a core with a radius r; M is the mesh, in whose frame all is computed.

- Apart (K's core touches no triangle and is not inside): the distance to the nearest triangle,
  minus r. It is exact; so is the depth of a K whose core is still outside. Next to contact the
  normal is that of all the triangles in contact (``contact_normal``), touching as well.
- Inside (M has a solid, K's core is inside and touches no triangle): K leaves across the plane
  through the mesh's point nearest to its core, at a right angle to the way there.
- Cut (K's core touches triangles): K leaves across the plane of one of the triangles that it
  cuts, along that triangle's normal. Triangles behind whose plane all other cut triangles lie come
  first, and of these the shallowest; where there is none, in a hollow, the deepest triangle.

Inside and cut, K may also leave as it would leave M's convex hull, if that is shorter. The depth
is therefore exact for a convex M, and for a K that dips into one face of any M; it never exceeds
a translation that separates the two. The witness on M then is in the plane of the face that K
leaves across. A sheet has no inside, and each of its triangles two sides.
"""

import math

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import (
    inlined_kernel,
    kernel,
    lean_kernel,
    merged_kernel,
)
from scene_graph_ros.geometry.narrowphase.convex_distance import convex_distance
from scene_graph_ros.geometry.narrowphase.cores.kinds import HULL
from scene_graph_ros.geometry.narrowphase.cores.questions import placed_support
from scene_graph_ros.geometry.narrowphase.pair import Placed
from scene_graph_ros.geometry.query.distance.contact_normal import (
    normal_to_core,
    TOUCHING,
    triangle_core,
)
from scene_graph_ros.geometry.query.distance.core_at_mesh import CoreAtMesh, without_radius
from scene_graph_ros.geometry.query.distance.triangle_search import (
    nearest_on_hull,
    plane_of_core,
    search_triangles,
)
from scene_graph_ros.geometry.query.point.mesh_cone import bounds_solid
from scene_graph_ros.geometry.query.point.point_mesh import point_mesh
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    dot,
    load_vector,
    norm,
    rotate,
    rotate_inverse,
    scale,
    transpose,
)
from scene_graph_ros.geometry.tolerances import COINCIDENCE, NEAR_CONTACT

__all__ = ["distance_convex_mesh", "is_in_box"]

KNOWN_ERROR = 1e-11
"""Relative to the larger size: as much of a distance's known error may make an overlap touching.
Errors of contacts next to each other are small; where depths nearly tie, the bound says little."""

_LOOSE = 1e-3
"""Relative to the larger size: what is known of the hull's distance, to begin with."""


@inlined_kernel
def _bounds(at):
    """Return (lower, upper): the bounding box of a core, without its radius."""
    placed, hulls = Placed(at.core, at.R, at.p), at.hulls
    x0, _ = placed_support(placed, hulls, (-1.0, 0.0, 0.0))
    y0, _ = placed_support(placed, hulls, (0.0, -1.0, 0.0))
    z0, _ = placed_support(placed, hulls, (0.0, 0.0, -1.0))
    x1, _ = placed_support(placed, hulls, (1.0, 0.0, 0.0))
    y1, _ = placed_support(placed, hulls, (0.0, 1.0, 0.0))
    z1, _ = placed_support(placed, hulls, (0.0, 0.0, 1.0))
    return (x0[0], y0[1], z0[2]), (x1[0], y1[1], z1[2])


@lean_kernel
def is_in_box(lower, upper, row, p):
    """Return whether p is in the box of a row."""
    is_in = True
    for axis in range(3):
        is_in = is_in and lower[row, axis] <= p[axis] <= upper[row, axis]
    return is_in


@inlined_kernel
def _depth_behind(at, n, height):
    """Return (depth, x): how far a core reaches behind the plane n . x = height, and where."""
    x, _ = placed_support(Placed(at.core, at.R, at.p), at.hulls, scale(-1.0, n))
    x = axpy(-at.core[2], n, x)
    return height - dot(n, x), x


@lean_kernel
def _is_foremost(vertices, triangles, cuts, count, n, height, tolerance):
    """Return whether no vertex of the cut triangles is in front of the plane n . x = height."""
    for c in range(count):
        for corner in range(3):
            v = triangles[cuts[c], corner]
            if dot(n, load_vector(vertices, v)) > height + tolerance:
                return False
    return True


@inlined_kernel
def _leave_cuts(at, cuts, count, tolerance):
    """Return (depth, n, x, unique): the way out across a cut triangle, and the deepest point x."""
    surfaces = at.surfaces
    depth, n, x, unique, foremost = -1.0, (0.0, 0.0, 1.0), at.p, True, False
    for c in range(count):
        sides = 1 if bounds_solid(surfaces, at.surface, cuts[c]) else 2
        for side in range(sides):
            m = load_vector(surfaces.normals, cuts[c])
            if side == 1:
                m = scale(-1.0, m)
            height = dot(m, load_vector(surfaces.vertices, surfaces.triangles[cuts[c], 0]))
            is_foremost = _is_foremost(
                surfaces.vertices, surfaces.triangles, cuts, count, m, height, tolerance
            )
            if foremost and not is_foremost:
                continue
            candidate, y = _depth_behind(at, m, height)
            is_better = candidate < depth if is_foremost else candidate > depth
            if is_foremost and not foremost:
                is_better = True
            if abs(candidate - depth) <= tolerance and dot(m, n) < 1.0 - COINCIDENCE:
                unique = False
            if is_better:
                if abs(candidate - depth) > tolerance:
                    unique = True
                depth, n, x, foremost = candidate, m, y, is_foremost
    return depth, n, x, unique


@lean_kernel
def _is_within(at, size):
    """Return whether a core that only touches a surface is inside of it."""
    surfaces, placed = at.surfaces, Placed(at.core, at.R, at.p)
    if surfaces.solid_parts[at.surface] == 0:
        return False
    middle = (0.0, 0.0, 0.0)
    for trial in range(6):
        sign = 1.0 if trial < 3 else -1.0
        axis = trial % 3
        d = (
            sign if axis == 0 else 0.0,
            sign if axis == 1 else 0.0,
            sign if axis == 2 else 0.0,
        )
        x, _ = placed_support(placed, at.hulls, d)
        middle = axpy(1.0 / 6.0, x, middle)
    return point_mesh(surfaces, at.surface, size, middle, math.inf)[0] < 0.0


@merged_kernel
def _over_triangles(at, cuts, count, n, depth, x):
    """Return a point of a core that is as deep as x behind a plane, and behind a cut triangle.

    The core, moved out by ``depth`` along n, touches the plane: where it touches one of the
    triangles in it is the answer. Where it touches none, x is all there is.
    """
    vertices, triangles = at.surfaces.vertices, at.surfaces.triangles
    height = dot(n, x) + depth
    slack = TOUCHING * COINCIDENCE * (norm(x) + depth)
    lifted = axpy(depth, n, at.p)
    for c in range(count):
        m = load_vector(at.surfaces.normals, cuts[c])
        v = load_vector(vertices, triangles[cuts[c], 0])
        if abs(dot(m, n)) < 1.0 - COINCIDENCE or abs(dot(n, v) - height) > slack:
            continue
        triangle = triangle_core(vertices, triangles, cuts[c])
        distance, a, _, _, _, _, _ = convex_distance(
            triangle, at.core, at.R, lifted, at.hulls, math.inf, 0.0
        )
        if abs(distance) <= slack:
            return axpy(-depth, n, a)
    return x


@lean_kernel
def _furthest(box):
    """Return the largest coordinate of a box's corners."""
    lower, upper = box
    largest = 0.0
    for axis in range(3):
        largest = max(largest, -lower[axis], upper[axis])
    return largest


@kernel
def _distance_by_search(at, size, reach, allowed, plane, near):
    """Do the same as ``_distance_in_mesh_frame``, by all triangles that may be near.

    ``reach`` bounds the distance of the core without its radius, ``plane`` is that between the
    core and the mesh's hull, if they are apart, and ``near`` the hull's nearest point.
    """
    surfaces, k, core, p_MK = at.surfaces, at.surface, at.core, at.p
    bare = without_radius(at)
    box = _bounds(bare)
    # Coordinates, and so distances, are as exact as the larger of the two permits.
    larger = max(size, _furthest(box))
    tolerance = COINCIDENCE * larger
    some_point, _ = placed_support(Placed(bare.core, at.R, p_MK), at.hulls, (1.0, 0.0, 0.0))
    is_inside = False
    if surfaces.solid_parts[k] > 0 and is_in_box(
        surfaces.node_lower, surfaces.node_upper, surfaces.node_start[k], some_point
    ):
        is_inside = point_mesh(surfaces, k, size, some_point, math.inf)[0] < 0.0
    if is_inside:
        reach = math.inf
    around = box, plane
    within = tolerance
    for _ in range(2):
        distance, error, p_MN, n, unique, cuts, count = search_triangles(
            bare, around, near, (reach, within, larger), allowed
        )
        if count > 0 or is_inside or not distance <= NEAR_CONTACT * larger:
            break
        # Next to contact: all the triangles that are as near as the nearest, but for rounding.
        within = distance + TOUCHING * tolerance
    if distance == math.inf:
        return math.inf, p_MK, p_MK, n, False
    if count == 0 and not is_inside:
        phi = distance - core[2]
        return phi, axpy(phi, n, p_MN), p_MN, n, unique
    if count == 0:
        n = scale(-1.0, n)
        depth, x = _depth_behind(at, n, dot(n, p_MN))
    else:
        depth, way, x, is_only_way = _leave_cuts(at, cuts, count, tolerance)
        touching = TOUCHING * tolerance
        if within <= tolerance and depth - core[2] <= touching:
            # One triangle's depth may be off by more, where it is tiny beside the core.
            distance = max(distance, core[2] - depth)
        touching += min(error, KNOWN_ERROR * larger)
        if within > tolerance or (distance >= -touching and not _is_within(at, size)):
            if within <= tolerance:  # all the triangles that touch, but for rounding
                sizes = reach, TOUCHING * tolerance, larger
                _, _, _, _, _, cuts, count = search_triangles(bare, around, near, sizes, allowed)
            contact = (distance, p_MN, n, unique)
            n, unique = normal_to_core(bare, cuts, count, contact, larger)
            phi = distance - core[2]
            return phi, axpy(phi, n, p_MN), p_MN, n, unique
        n, unique = way, is_only_way
        x = _over_triangles(at, cuts, count, n, depth, x)
    phi, p_MCm, p_MCk, n_hull, is_unique, _, _ = convex_distance(
        at.hull, core, at.R, p_MK, at.hulls, math.inf, 0.0
    )
    if phi > -depth:
        return phi, p_MCk, p_MCm, scale(-1.0, n_hull), is_unique
    return -depth, x, axpy(depth, n, x), n, unique


@kernel
def _distance_in_mesh_frame(at, size, bound, allowed):
    """Return (phi, p_MCk, p_MCm, nhat_MK_M, unique): nhat points out of the mesh into K."""
    p_MK, bare, radius = at.p, without_radius(at), at.core[2]
    reach = max(bound, 0.0) + radius
    far = max(size, abs(p_MK[0]), abs(p_MK[1]), abs(p_MK[2]))
    # The mesh is in its hull: what that is away from the core is no more than the distance.
    apart, near, _, n, _, gap, _ = convex_distance(
        at.hull, bare.core, at.R, p_MK, at.hulls, reach, _LOOSE * far
    )
    if gap == math.inf and apart > reach:
        return math.inf, p_MK, p_MK, n, False
    plane = plane_of_core(bare, scale(-1.0, n))
    if apart - gap > _LOOSE * far:
        sizes = reach, COINCIDENCE * far
        is_proven, distance, p_MN, n, unique = nearest_on_hull(bare, plane, near, sizes, allowed)
        if is_proven:
            phi = distance - radius
            return phi, axpy(phi, n, p_MN), p_MN, n, unique
    return _distance_by_search(at, size, reach, allowed, plane, near)


@merged_kernel
def distance_convex_mesh(table, j, core, R_AB, p_AB, max_distance, tolerance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique) of a core A and row j's triangles B.

    Beyond ``max_distance``, phi may be inf, without witnesses. Apart, phi may be off by
    ``tolerance`` (m).
    """
    R_BA = transpose(R_AB)
    p_BA = scale(-1.0, rotate_inverse(R_AB, p_AB))
    zeros = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    hull = (HULL, np.int64(table.hulls.block_start[table.hull[j]]), 0.0, zeros)
    at = CoreAtMesh(table.surfaces, table.surface[j], hull, core, R_BA, p_BA, table.hulls.blocks)
    # The sign of a core with a radius is not that of the core without.
    allowed = tolerance if core[2] == 0.0 else 0.0
    phi, p_BCa, p_BCb, nhat_BA_B, unique = _distance_in_mesh_frame(
        at, table.scale[j], max_distance, allowed
    )
    p_ACa = add(rotate(R_AB, p_BCa), p_AB)
    p_ACb = add(rotate(R_AB, p_BCb), p_AB)
    return phi, p_ACa, p_ACb, rotate(R_AB, nhat_BA_B), unique

"""The approximate signed distance field of a deformable geometry.

At a vertex of the reference mesh the field is minus its distance from the mesh's boundary (0 on
it); inside a tetrahedron it is linear. Deformed, a vertex keeps its value, so the field moves
with the material: exact in the reference configuration at the vertices, an estimate elsewhere
(Han, Masterjohn, Castro, "A convex formulation of frictional contact between rigid and
deformable bodies", 2023). A tetrahedron with all corners on the boundary has the field 0; a
resolution hint that leaves vertices inside avoids that.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.meshes.bvh import build_bvh, traversal_stack
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.query.point.flat_features import nearest_on_triangle
from scene_graph_ros.geometry.spatial.vectors import load_vector

__all__ = ["reference_field"]


def reference_field(mesh: VolumeMesh) -> NDArray[np.float64]:
    """Return ``(v,)`` metres: minus the distance of each vertex from the boundary."""
    field = np.zeros(mesh.num_vertices)
    inside = np.flatnonzero(~mesh.is_on_boundary())
    if not len(inside):
        return field
    corners = mesh.vertices[mesh.boundary_triangles()]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled_areas = np.linalg.norm(crosses, axis=1)
    # A triangle without area is covered by its neighbours.
    solid = np.flatnonzero(doubled_areas > 0.0)
    normals = crosses[solid] / doubled_areas[solid, None]
    corners = np.ascontiguousarray(corners[solid])
    tree = build_bvh(corners.min(axis=1), corners.max(axis=1))
    field[inside] = -_distances(mesh.vertices[inside], corners.reshape(-1, 3), normals, *tree)
    return field


@kernel
def _distances(points, corners, normals, lower, upper, left, right, order):
    """Return (n,) distances of points from triangles, three rows of ``corners`` each."""
    result = np.empty(len(points))
    stack = traversal_stack()
    for i in range(len(points)):
        p = load_vector(points, i)
        stack[0], depth = 0, 1
        best = math.inf
        while depth > 0:
            depth -= 1
            node = stack[depth]
            gap = 0.0
            for axis in range(3):
                d = max(lower[node, axis] - p[axis], p[axis] - upper[node, axis], 0.0)
                gap += d * d
            if gap >= best:
                continue
            if left[node] >= 0:
                stack[depth], stack[depth + 1] = right[node], left[node]
                depth += 2
                continue
            for slot in range(-1 - left[node], -1 - left[node] + right[node]):
                t = order[slot]
                a, b = load_vector(corners, 3 * t), load_vector(corners, 3 * t + 1)
                c, n = load_vector(corners, 3 * t + 2), load_vector(normals, t)
                _, square, _ = nearest_on_triangle(p, a, b, c, n)
                best = min(best, square)
        result[i] = math.sqrt(best)
    return result

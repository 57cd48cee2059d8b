"""Signed distance of a sphere to the triangles of a mesh: its centre's, minus the radius."""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.query.distance.ball import ball_result
from scene_graph_ros.geometry.query.point.dispatch import point_mesh_within
from scene_graph_ros.geometry.spatial.vectors import rotate_inverse, scale

__all__ = ["distance_sphere_mesh"]


@lean_kernel
def distance_sphere_mesh(size_A, R_AB, p_AB, table, j, max_distance):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique) for row j's triangles.

    Ties are those of ``point_mesh``. Beyond ``max_distance``, phi may be inf, without witnesses.
    """
    p_BA = scale(-1.0, rotate_inverse(R_AB, p_AB))
    threshold = max(max_distance, 0.0) + size_A[0]
    phi, _, grad_B, unique = point_mesh_within(table, j, p_BA, threshold)
    if phi == math.inf:
        return phi, p_AB, p_AB, (1.0, 0.0, 0.0), False
    return ball_result(size_A[0], R_AB, phi, grad_B, unique)

"""Signed distance of a sphere to a convex hull."""

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.query.distance.ball import ball_result
from scene_graph_ros.geometry.query.point.point_convex import point_convex
from scene_graph_ros.geometry.spatial.vectors import rotate_inverse, scale

__all__ = ["distance_sphere_convex"]


@lean_kernel
def distance_sphere_convex(size_A, R_AB, p_AB, table, j):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique) for row j's hull.

    Ties are those of ``point_convex``.
    """
    p_BA = scale(-1.0, rotate_inverse(R_AB, p_AB))
    phi, _, grad_B, unique = point_convex(table.hulls, table.hull[j], table.scale[j], p_BA)
    return ball_result(size_A[0], R_AB, phi, grad_B, unique)

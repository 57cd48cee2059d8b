"""Signed distance of a sphere to a cylinder."""

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.query.distance.ball import ball_result
from scene_graph_ros.geometry.query.point.point_cylinder import point_cylinder
from scene_graph_ros.geometry.spatial.vectors import rotate_inverse, scale

__all__ = ["distance_sphere_cylinder"]


@kernel
def distance_sphere_cylinder(size_A, size_B, R_AB, p_AB):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique); ties as in ``point_cylinder``."""
    p_BA = scale(-1.0, rotate_inverse(R_AB, p_AB))
    phi, _, grad_B, unique = point_cylinder(size_B, p_BA)
    return ball_result(size_A[0], R_AB, phi, grad_B, unique)

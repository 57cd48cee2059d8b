"""Signed distance of a sphere to a half space."""

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.query.distance.ball import ball_result
from scene_graph_ros.geometry.spatial.vectors import column, dot

__all__ = ["distance_sphere_half_space"]


@kernel
def distance_sphere_half_space(size_A, size_B, R_AB, p_AB):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique)."""
    height = -dot(column(R_AB, 2), p_AB)
    return ball_result(size_A[0], R_AB, height, (0.0, 0.0, 1.0), True)

"""Signed distance of a sphere to an ellipsoid."""

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.narrowphase.point_ellipsoid import point_ellipsoid
from scene_graph_ros.geometry.query.distance.ball import ball_result
from scene_graph_ros.geometry.spatial.vectors import rotate_inverse, scale

__all__ = ["distance_sphere_ellipsoid"]


@kernel
def distance_sphere_ellipsoid(size_A, size_B, R_AB, p_AB):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique); ties as in ``point_ellipsoid``."""
    p_BA = scale(-1.0, rotate_inverse(R_AB, p_AB))
    phi, _, grad_B, unique = point_ellipsoid(size_B, p_BA)
    return ball_result(size_A[0], R_AB, phi, grad_B, unique)

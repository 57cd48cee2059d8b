"""Signed distance of two spheres."""

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.spatial.vectors import norm, scale, unit
from scene_graph_ros.geometry.tolerances import COINCIDENCE

__all__ = ["distance_sphere_sphere"]


@kernel
def distance_sphere_sphere(size_A, size_B, R_AB, p_AB):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique).

    Of concentric spheres every normal is right: A's +x is chosen and ``unique`` is False.
    """
    distance = norm(p_AB)
    phi = distance - size_A[0] - size_B[0]
    unique = distance > COINCIDENCE * max(size_A[0], size_B[0])
    nhat_BA_A = unit(scale(-1.0, p_AB), (1.0, 0.0, 0.0)) if unique else (1.0, 0.0, 0.0)
    p_ACa = scale(-size_A[0], nhat_BA_A)
    return phi, p_ACa, scale(-(size_A[0] + phi), nhat_BA_A), nhat_BA_A, unique

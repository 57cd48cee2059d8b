"""Signed distance of an ellipsoid to a half space."""

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.query.distance.half_space_result import half_space_result
from scene_graph_ros.geometry.spatial.vectors import column, norm

__all__ = ["distance_ellipsoid_half_space"]


@kernel
def distance_ellipsoid_half_space(size_A, size_B, R_AB, p_AB):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique)."""
    a, b, c = size_A
    n = column(R_AB, 2)
    stretched = (a * n[0], b * n[1], c * n[2])
    reach = norm(stretched)
    p_ACa = (
        -a * (stretched[0] / reach),
        -b * (stretched[1] / reach),
        -c * (stretched[2] / reach),
    )
    return half_space_result(R_AB, p_AB, p_ACa, reach)

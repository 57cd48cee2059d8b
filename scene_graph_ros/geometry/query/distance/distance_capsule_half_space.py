"""Signed distance of a capsule to a half space."""

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.query.distance.half_space_result import (
    deepest_sign,
    half_space_result,
)
from scene_graph_ros.geometry.spatial.vectors import column

__all__ = ["distance_capsule_half_space"]


@kernel
def distance_capsule_half_space(size_A, size_B, R_AB, p_AB):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique); lying flat, the middle is the witness."""
    radius, half_length = size_A[0], size_A[1]
    n = column(R_AB, 2)
    z = deepest_sign(n[2]) * half_length
    p_ACa = (-radius * n[0], -radius * n[1], z - radius * n[2])
    return half_space_result(R_AB, p_AB, p_ACa, radius + half_length * abs(n[2]))

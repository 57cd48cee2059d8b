"""Signed distance of a box to a half space."""

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.query.distance.half_space_result import (
    deepest_sign,
    half_space_result,
)
from scene_graph_ros.geometry.spatial.vectors import column

__all__ = ["distance_box_half_space"]


@kernel
def distance_box_half_space(size_A, size_B, R_AB, p_AB):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique).

    The witness is the centre of the deepest feature: a corner, an edge or a face.
    """
    n = column(R_AB, 2)
    p_ACa = (
        deepest_sign(n[0]) * size_A[0],
        deepest_sign(n[1]) * size_A[1],
        deepest_sign(n[2]) * size_A[2],
    )
    reach = size_A[0] * abs(n[0]) + size_A[1] * abs(n[1]) + size_A[2] * abs(n[2])
    return half_space_result(R_AB, p_AB, p_ACa, reach)

"""Signed distance of a cylinder to a half space."""

import math

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.query.distance.half_space_result import (
    deepest_sign,
    half_space_result,
)
from scene_graph_ros.geometry.spatial.vectors import column
from scene_graph_ros.geometry.tolerances import PARALLEL

__all__ = ["distance_cylinder_half_space"]


@kernel
def distance_cylinder_half_space(size_A, size_B, R_AB, p_AB):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique).

    The witness is the centre of the deepest feature: a point of a rim, an end, or a line of the
    side.
    """
    radius, half_length = size_A[0], size_A[1]
    n = column(R_AB, 2)
    slope = math.sqrt(n[0] * n[0] + n[1] * n[1])
    x = y = 0.0
    if slope > PARALLEL:
        x, y = -radius * n[0] / slope, -radius * n[1] / slope
    p_ACa = (x, y, deepest_sign(n[2]) * half_length)
    reach = radius * slope + half_length * abs(n[2])
    return half_space_result(R_AB, p_AB, p_ACa, reach)

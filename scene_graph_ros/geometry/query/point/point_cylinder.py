"""Signed distance from a point to a cylinder along z."""

import math

from scene_graph_ros.geometry.compiled.division import reciprocal
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.tolerances import COINCIDENCE

__all__ = ["point_cylinder"]


@inlined_kernel
def point_cylinder(size, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of point Q; ``size`` is (radius, half length, 0).

    Inside, where an end and the side are equally near, the end is chosen; of two ends, the upper
    one; on the axis, where the side is nearest, +x. Then, and on a rim, ``unique`` is False.
    """
    radius, half_length = size[0], size[1]
    x, y, z = p_GQ
    tolerance = COINCIDENCE * max(radius, half_length)
    rho = math.sqrt(x * x + y * y)
    off_axis = rho > tolerance
    inverse = reciprocal(rho)
    ux, uy = x * inverse if off_axis else 1.0, y * inverse if off_axis else 0.0
    sign = -1.0 if z < -tolerance else 1.0
    side, end = rho - radius, sign * z - half_length
    inside = max(side, end) <= tolerance
    at_end = end >= side - tolerance if inside else side <= 0.0
    at_side = not at_end and (inside or end <= 0.0)
    rim = math.sqrt(side * side + end * end)
    inverse = reciprocal(rim)
    a = 0.0 if at_end else (1.0 if at_side else side * inverse)
    b = 1.0 if at_end else (0.0 if at_side else end * inverse)
    p_GN = (
        x if at_end else radius * ux,
        y if at_end else radius * uy,
        z if at_side else sign * half_length,
    )
    is_off_middle = abs(z) > tolerance if at_end else off_axis
    unique = not inside or (is_off_middle and abs(side - end) > tolerance)
    phi = end if at_end else (side if at_side else rim)
    return phi, p_GN, (a * ux, a * uy, b * sign), unique

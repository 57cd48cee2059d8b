"""Signed distance from a point to a cylinder along z."""

import math

from scene_graph_ros.geometry.jit import kernel
from scene_graph_ros.geometry.tolerances import COINCIDENCE

__all__ = ["point_cylinder"]


@kernel
def point_cylinder(size, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of point Q; ``size`` is (radius, half length, 0).

    Inside, where an end and the side are equally near, the end is chosen; of two ends, the upper
    one; on the axis, where the side is nearest, +x. Then, and on a rim, ``unique`` is False.
    """
    radius, half_length = size[0], size[1]
    x, y, z = p_GQ
    tolerance = COINCIDENCE * max(radius, half_length)
    rho = math.sqrt(x * x + y * y)
    ux, uy = (x / rho, y / rho) if rho > tolerance else (1.0, 0.0)
    sign = -1.0 if z < -tolerance else 1.0
    side, end = rho - radius, sign * z - half_length
    if max(side, end) <= tolerance:
        unique = abs(side - end) > tolerance
        if end >= side - tolerance:
            unique = unique and abs(z) > tolerance
            return end, (x, y, sign * half_length), (0.0, 0.0, sign), unique
        unique = unique and rho > tolerance
        return side, (radius * ux, radius * uy, z), (ux, uy, 0.0), unique
    if side <= 0.0:
        return end, (x, y, sign * half_length), (0.0, 0.0, sign), True
    if end <= 0.0:
        return side, (radius * ux, radius * uy, z), (ux, uy, 0.0), True
    phi = math.sqrt(side * side + end * end)
    a, b = side / phi, end / phi
    return phi, (radius * ux, radius * uy, sign * half_length), (a * ux, a * uy, b * sign), True

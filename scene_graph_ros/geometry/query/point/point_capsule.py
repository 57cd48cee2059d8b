"""Signed distance from a point to a capsule along z."""

from scene_graph_ros.geometry.compiled.division import reciprocal
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.spatial.vectors import norm
from scene_graph_ros.geometry.tolerances import COINCIDENCE

__all__ = ["point_capsule"]


@inlined_kernel
def point_capsule(size, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of point Q; ``size`` is (radius, half length, 0).

    On the axis, between the centres of the caps, +x is chosen and ``unique`` is False.
    """
    radius, half_length = size[0], size[1]
    z = min(max(p_GQ[2], -half_length), half_length)
    offset = (p_GQ[0], p_GQ[1], p_GQ[2] - z)
    distance = norm(offset)
    unique = distance > COINCIDENCE * (radius + half_length)
    inverse = reciprocal(distance)
    grad_G = (
        offset[0] * inverse if unique else 1.0,
        offset[1] * inverse if unique else 0.0,
        offset[2] * inverse if unique else 0.0,
    )
    p_GN = (radius * grad_G[0], radius * grad_G[1], radius * grad_G[2] + z)
    return distance - radius, p_GN, grad_G, unique

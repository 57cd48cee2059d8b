"""Signed distance from a point to a sphere."""

from scene_graph_ros.geometry.compiled.division import reciprocal
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.spatial.vectors import norm, scale
from scene_graph_ros.geometry.tolerances import COINCIDENCE

__all__ = ["point_sphere"]


@inlined_kernel
def point_sphere(size, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of point Q; ``size`` is (radius, 0, 0).

    At the centre every direction is right: +x is chosen and ``unique`` is False.
    """
    radius = size[0]
    distance = norm(p_GQ)
    unique = distance > COINCIDENCE * radius
    inverse = reciprocal(distance)
    grad_G = (
        p_GQ[0] * inverse if unique else 1.0,
        p_GQ[1] * inverse if unique else 0.0,
        p_GQ[2] * inverse if unique else 0.0,
    )
    return distance - radius, scale(radius, grad_G), grad_G, unique

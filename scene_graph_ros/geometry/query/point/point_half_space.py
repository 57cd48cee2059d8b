"""Signed distance from a point to the half space z <= 0."""

from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = ["point_half_space"]


@kernel
def point_half_space(size, p_GQ):
    """Return (phi, p_GN, grad_G, unique) of point Q, always unique; a half space has no size."""
    return p_GQ[2], (p_GQ[0], p_GQ[1], 0.0), (0.0, 0.0, 1.0), True

"""Distance of a ball to a shape, from the signed distance of its centre to the shape.

A ball is its centre inflated by its radius, so its distance is the centre's minus the radius,
outside as inside: the depth to which a ball is in a convex shape is its centre's depth plus the
radius, as the inflated shape's boundary is the shape's, moved outward.
"""

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.spatial.vectors import rotate, scale

__all__ = ["ball_result"]


@kernel
def ball_result(radius, R_AB, phi, grad_B, unique):
    """Return a pair's result for a ball A whose centre is at ``phi``, along ``grad_B``, from B."""
    nhat_BA_A = rotate(R_AB, grad_B)
    p_ACa = scale(-radius, nhat_BA_A)
    p_ACb = scale(-phi, nhat_BA_A)
    return phi - radius, p_ACa, p_ACb, nhat_BA_A, unique

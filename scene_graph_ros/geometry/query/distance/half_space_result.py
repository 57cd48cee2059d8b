"""The common part of all pairs with a half space: the deepest point decides."""

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.spatial.vectors import axpy, column, dot
from scene_graph_ros.geometry.tolerances import PARALLEL

__all__ = ["deepest_sign", "half_space_result"]


@kernel
def deepest_sign(slope):
    """Return the sign of an extent's deepest end, -1 or 1; 0, the middle, where it lies flat."""
    if abs(slope) <= PARALLEL:
        return 0.0
    return -1.0 if slope > 0.0 else 1.0


@kernel
def half_space_result(R_AB, p_AB, p_ACa, reach):
    """Return a pair's result for B a half space, A's deepest point Ca, and A's support there.

    ``reach`` is A's extent below its origin along the half space's normal.
    """
    nhat_BA_A = column(R_AB, 2)
    phi = -dot(nhat_BA_A, p_AB) - reach
    return phi, p_ACa, axpy(-phi, nhat_BA_A, p_ACa), nhat_BA_A, True

"""Signed distance of two capsules: their axes' distance, minus both radii."""

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.query.distance.segments import nearest_on_segments
from scene_graph_ros.geometry.spatial.vectors import (
    any_orthogonal,
    axpy,
    column,
    cross,
    dot,
    norm,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import COINCIDENCE, PARALLEL

__all__ = ["distance_capsule_capsule"]


@kernel
def _crossing_normal(axis_B):
    """Return a unit vector orthogonal to A's axis, and to B's where that leaves a choice."""
    n = cross((0.0, 0.0, 1.0), axis_B)
    return unit(n, (1.0, 0.0, 0.0)) if norm(n) > PARALLEL else (1.0, 0.0, 0.0)


@kernel
def _across_axes(offset, s, t, h, k, axis_B, rounding):
    """Return the offset between two axes' nearest points without its rounding along the axes.

    Between the ends the way is at a right angle to the axis, and at an end it leads away from the
    axis; for axes that nearly meet, rounding would turn it. An end is where s (t) is 1 or -1 to
    within ``rounding`` (m) of the place, h (k) being half the length of A's (B's) axis.
    """
    if (1.0 - abs(s)) * h > rounding or s * offset[2] > 0.0:
        offset = (offset[0], offset[1], 0.0)
    along = dot(offset, axis_B)
    if (1.0 - abs(t)) * k > rounding or t * along < 0.0:
        offset = axpy(-along, axis_B, offset)
    return offset


@kernel
def distance_capsule_capsule(size_A, size_B, R_AB, p_AB):
    """Return (phi, p_ACa, p_ACb, nhat_BA_A, unique).

    Where the axes cross, both normals of their common plane are right: that along z_A x z_B is
    chosen; where they overlap, A's +x; and ``unique`` is False. Witnesses of parallel capsules
    side by side are those half way along the overlap.
    """
    axis_B = column(R_AB, 2)
    h, k = (0.0, 0.0, size_A[1]), scale(size_B[1], axis_B)
    s, t, normal = nearest_on_segments(p_AB, h, k)
    p_AQa = scale(s, h)
    length = max(size_A[0] + size_A[1], size_B[0] + size_B[1])
    rounding = COINCIDENCE * (length + norm(p_AB))
    offset = subtract(p_AQa, axpy(t, k, p_AB))
    offset = _across_axes(offset, s, t, size_A[1], size_B[1], axis_B, rounding)
    distance = norm(offset)
    unique = distance > COINCIDENCE * length
    if not unique:
        nhat_BA_A = _crossing_normal(axis_B)
        distance = 0.0
    elif dot(normal, normal) > 0.0 and norm(cross((0.0, 0.0, 1.0), axis_B)) * length > distance:
        # The common normal is known better than the difference of two near points.
        along = -dot(normal, p_AB)
        nhat_BA_A = normal if along > 0.0 else scale(-1.0, normal)
        distance = abs(along)
    else:
        nhat_BA_A = unit(offset, any_orthogonal(axis_B))
    phi = distance - size_A[0] - size_B[0]
    p_ACa = axpy(-size_A[0], nhat_BA_A, p_AQa)
    return phi, p_ACa, axpy(-phi, nhat_BA_A, p_ACa), nhat_BA_A, unique

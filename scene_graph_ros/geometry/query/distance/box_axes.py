"""The 15 directions of the separating axis test of two boxes.

Gottschalk, Lin, Manocha, "OBBTree: a hierarchical structure for rapid interference detection",
1996. The Minkowski difference of two boxes is bounded by planes along these directions: 3 faces
of each box and 9 cross products of their edges. Along any unit vector, rounded or not, two
bodies are no further apart than their distance, so the values here are bounds in any case.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    column,
    dot,
    norm,
    rotate_inverse,
    scale,
    unit,
)
from scene_graph_ros.geometry.tolerances import PARALLEL, POINTS_BESIDE

__all__ = ["axis_vector", "reach", "separating_normal", "shallowest", "without_rounding"]


@kernel
def without_rounding(R):
    """Set entries of a rotation to zero that are so small that an edge is parallel to a face."""
    return (
        R[0] if abs(R[0]) > PARALLEL else 0.0,
        R[1] if abs(R[1]) > PARALLEL else 0.0,
        R[2] if abs(R[2]) > PARALLEL else 0.0,
        R[3] if abs(R[3]) > PARALLEL else 0.0,
        R[4] if abs(R[4]) > PARALLEL else 0.0,
        R[5] if abs(R[5]) > PARALLEL else 0.0,
        R[6] if abs(R[6]) > PARALLEL else 0.0,
        R[7] if abs(R[7]) > PARALLEL else 0.0,
        R[8] if abs(R[8]) > PARALLEL else 0.0,
    )


@kernel
def axis_vector(axis, value):
    """Return ``value`` times the unit vector along an axis."""
    return (
        value if axis == 0 else 0.0,
        value if axis == 1 else 0.0,
        value if axis == 2 else 0.0,
    )


@kernel
def reach(size, n):
    """Return a box's extent from its centre along n."""
    return size[0] * abs(n[0]) + size[1] * abs(n[1]) + size[2] * abs(n[2])


@kernel
def _separation(size_A, size_B, R, p, n):
    """Return the gap of the boxes along the unit vector n, which points from B to A."""
    return -dot(p, n) - reach(size_A, n) - reach(size_B, rotate_inverse(R, n))


@inlined_kernel
def _cross_axis(R, i, j):
    """Return the unit cross product of A's edge i and B's edge j, or zero where it adds nothing.

    Where the edges are parallel it is any direction across them, and where one component of B's
    edge is zero it is the normal of a face of A.
    """
    b = column(R, j)
    k, m = (i + 1) % 3, (i + 2) % 3
    length = math.sqrt(b[k] * b[k] + b[m] * b[m])
    if length <= PARALLEL or b[k] == 0.0 or b[m] == 0.0:
        return (0.0, 0.0, 0.0)
    return add(axis_vector(k, -b[m] / length), axis_vector(m, b[k] / length))


@inlined_kernel
def shallowest(size_A, size_B, R, p, tolerance, max_distance):
    """Return (depth, n, kind, unique): the direction n, out of B, of least overlap, in A.

    ``kind`` counts A's faces 0 to 2, B's 3 to 5, then 6 + 3 i + j for edges i and j. Ties go to
    the first. Negative depths are separations; the search stops at one beyond ``max_distance``.
    """
    depth, second, n, kind = math.inf, math.inf, (1.0, 0.0, 0.0), 0
    for candidate in range(15):
        if candidate < 3:
            axis = axis_vector(candidate, 1.0)
        elif candidate < 6:
            axis = column(R, candidate - 3)
        else:
            axis = _cross_axis(R, (candidate - 6) // 3, (candidate - 6) % 3)
            if dot(axis, axis) == 0.0:
                continue
        offset = -dot(p, axis)
        candidate_depth = reach(size_A, axis) + reach(size_B, rotate_inverse(R, axis))
        candidate_depth -= abs(offset)
        # An edge of one box that lies in a face of the other gives that face's normal again.
        if candidate_depth < depth - tolerance:
            second = depth if abs(offset) > tolerance else candidate_depth
            depth, kind = candidate_depth, candidate
            n = scale(-1.0, axis) if offset < 0.0 else axis
            if -depth > max_distance:
                break
        elif abs(dot(axis, n)) < 1.0 - PARALLEL:
            second = min(second, candidate_depth)
    return depth, n, kind, second > depth + tolerance


@kernel
def separating_normal(size_A, size_B, R, p, n, gap, tolerance):
    """Return the unit vector along which boxes with the nearest points ``gap`` apart are apart.

    Close to contact the direction of ``gap`` is rounding, and a vector off by an angle puts a
    long edge that should be across it that much closer. So candidates are the direction of
    ``gap``, the same at a right angle to an edge, and n, the best of the axes. One that separates
    the boxes by the length of ``gap`` is proven to be right; the shortfall is made small,
    at best less than ``tolerance``. The part of ``gap`` across it counts little: points are
    known to the root of rounding only, as their distance hardly depends on it.
    """
    distance = norm(gap)
    best, least = n, math.inf
    for k in range(8):
        candidate = n
        if k == 0:
            candidate = unit(gap, n)
        elif k < 7:
            edge = axis_vector(k - 1, 1.0) if k < 4 else column(R, k - 4)
            candidate = unit(axpy(-dot(gap, edge), edge, gap), n)
        beside = norm(axpy(-dot(gap, candidate), candidate, gap))
        lack = distance - _separation(size_A, size_B, R, p, candidate)
        lack += POINTS_BESIDE * beside
        if lack < least:
            best, least = candidate, lack
            if least <= tolerance:
                break
    return best

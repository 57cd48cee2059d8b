"""Distance of two separated cores by the algorithm of Gilbert, Johnson and Keerthi (GJK).

Works on the Minkowski difference C = {a - b}: v is the point of a simplex in C that is closest to
the origin, and |v| an upper bound of the distance; the support point w of C along -v gives the
lower bound v . w / |v|. The gap between both certifies the answer and ends the loop.
"""

import math

from scene_graph_ros.geometry.compiled.expectations import is_rare
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.questions import placed_support, support
from scene_graph_ros.geometry.narrowphase.pair import body_B
from scene_graph_ros.geometry.narrowphase.propose.simplex import closest_on_simplex, CONTAINS
from scene_graph_ros.geometry.spatial.vectors import dot, scale, subtract
from scene_graph_ros.geometry.tolerances import EPSILON, GJK_ROUNDING

__all__ = [
    "CONVERGED",
    "FAR",
    "MAX_ITERATIONS",
    "OVERLAP",
    "STALLED",
    "gjk",
    "gjk_inlined",
    "store_support",
]

MAX_ITERATIONS = 128
"""Polytopes need about ten; a smooth pair gains a factor of its gap each time."""

IDLE_STEPS = 8
"""How many steps may come no closer but by less than rounding. A corner of tiny weight turns v by
more than its length tells: beside parallel faces, the next corner may be far from there."""

CONVERGED = 0
FAR = 1
OVERLAP = 2
STALLED = 3


@inlined_kernel
def store_support(pair, n, work, row):
    """Write the support point of C = {a - b} along -n into a row of the workspace; return it."""
    S, ids, hulls = work.S, work.ids, pair.hulls
    a, index_A = support(pair.core_A, hulls, scale(-1.0, n))
    b, index_B = placed_support(body_B(pair), hulls, n)
    w = subtract(a, b)
    for c in range(3):
        S[row, c] = w[c]
        S[row, 3 + c] = a[c]
        S[row, 6 + c] = b[c]
    ids[row, 0] = index_A
    ids[row, 1] = index_B
    return w


@lean_kernel
def _row_size(S, row):
    size = 0.0
    for c in range(9):
        size = max(size, abs(S[row, c]))
    return size


@lean_kernel
def _is_repeated(S, count):
    """Return whether row ``count`` equals one of the rows before it."""
    for i in range(count):
        if S[i, 0] == S[count, 0] and S[i, 1] == S[count, 1] and S[i, 2] == S[count, 2]:
            return True
    return False


@inlined_kernel
def gjk_inlined(pair, v, count, max_distance, relative_gap, absolute_gap, work):
    """Run GJK from v and the first ``count`` rows of the workspace.

    Returns (status, count, v, lower bound, size): ``CONVERGED`` when the gap is below
    ``relative_gap`` times the distance or at rounding, or below ``absolute_gap`` (m) and both
    bounds are on one side of the sum of the radii; ``FAR`` when the lower bound passed
    ``max_distance``, ``OVERLAP`` when the origin is in C or within rounding of it, ``STALLED``
    when rounding stopped the progress or the iterations ran out (the gap then tells the accuracy).
    """
    S = work.S
    radius = pair.core_A[2] + pair.core_B[2]
    lower = -math.inf
    size = 0.0
    idle = 0
    for i in range(count):
        size = max(size, _row_size(S, i))
    for _ in range(MAX_ITERATIONS):
        length = math.sqrt(dot(v, v))
        w = store_support(pair, v, work, count)
        size = max(size, _row_size(S, count))
        lower = dot(v, w) / length
        if lower > max_distance:
            return FAR, count, v, lower, size
        if count > 0:
            rounding = GJK_ROUNDING * EPSILON * size
            gap = length - lower
            if gap <= max(relative_gap * length, rounding):
                return CONVERGED, count, v, lower, size
            if 0.0 < absolute_gap >= gap and (lower > radius or length <= radius):
                return CONVERGED, count, v, lower, size
            if is_rare(_is_repeated(S, count)):
                return STALLED, count, v, lower, size
        old = length if count > 0 else math.inf
        count, v = closest_on_simplex(work, count + 1)
        if is_rare(count == CONTAINS):
            return OVERLAP, count, v, lower, size
        length = math.sqrt(dot(v, v))
        if is_rare(length <= GJK_ROUNDING * EPSILON * size):
            return OVERLAP, count, v, lower, size
        if is_rare(length >= old):
            idle += 1
            if idle > IDLE_STEPS or length - old > GJK_ROUNDING * EPSILON * size:
                return STALLED, count, v, lower, size
    return STALLED, count, v, lower, size


@lean_kernel
def gjk(pair, v, count, max_distance, relative_gap, absolute_gap, work):
    """Do the same as ``gjk_inlined``, as a call."""
    return gjk_inlined(pair, v, count, max_distance, relative_gap, absolute_gap, work)

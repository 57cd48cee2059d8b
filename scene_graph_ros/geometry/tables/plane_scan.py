"""Which of many planes a point is highest above, eight of them in step.

Planes come in groups of GROUP: the x, then the y, then the z of their unit normals, their offsets,
then GROUP numbers that are not looked at. Those that fill up the last group have the offset inf
and the normal of the plane before it.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    as_lanes,
    every,
    larger,
    load_lanes,
    select,
    smaller,
)
from scene_graph_ros.geometry.tables.vertex_scan import (
    along_group,
    first_of_highest,
    GROUP,
    largest_of,
    NUMBERS,
)

__all__ = ["PLANE_STRIDE", "highest_of_planes"]

PLANE_STRIDE = 5 * GROUP
"""Numbers of a group of planes."""


@inlined_kernel
def highest_of_planes(blocks, first, groups, p):
    """Return (place, height, second): the plane that p is highest above, and the runner-up.

    The place is that of its normal's x, the first of several; of these the second height is the
    first. There is at least one group.
    """
    lanes = as_lanes(NUMBERS)
    best = along_group(blocks, first, p) - load_lanes(blocks, first + 3 * GROUP)
    second, where, start = every(-math.inf), lanes, 0.0
    for group in range(1, groups):
        at = first + group * PLANE_STRIDE
        heights = along_group(blocks, at, p) - load_lanes(blocks, at + 3 * GROUP)
        start += PLANE_STRIDE
        is_higher = heights > best
        second = larger(second, smaller(heights, best))
        best = select(is_higher, heights, best)
        where = select(is_higher, start + lanes, where)
    place = first_of_highest(best, where)
    others = select(where == float(place), second, best)
    return first + place, largest_of(best), largest_of(others)

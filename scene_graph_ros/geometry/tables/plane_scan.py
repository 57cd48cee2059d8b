"""Which of many planes a point is highest above, or faces a direction most, eight of them in step.

Planes come in groups of GROUP: the x, then the y, then the z of their unit normals, their offsets,
then GROUP numbers that are not looked at. What fills up the last group has the offset inf and the
normal of the plane before it.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    as_lanes,
    every,
    larger,
    load_lanes,
    reordering,
    select,
    smaller,
)
from scene_graph_ros.geometry.tables.vertex_scan import (
    along_group,
    first_of_highest,
    GROUP,
    NUMBERS,
)

__all__ = ["furthest_of_planes", "highest_of_planes"]

_STRIDE = 5 * GROUP

_half_ahead, _quarter_ahead = [
    reordering(*[(lane + part) % GROUP for lane in range(GROUP)])
    for part in (GROUP // 2, GROUP // 4)
]


@inlined_kernel
def _largest(lanes):
    """Return the largest number of lanes."""
    lanes = larger(lanes, _half_ahead(lanes))
    lanes = larger(lanes, _quarter_ahead(lanes))
    return max(lanes[0], lanes[1])


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
        at = first + group * _STRIDE
        heights = along_group(blocks, at, p) - load_lanes(blocks, at + 3 * GROUP)
        start += _STRIDE
        is_higher = heights > best
        second = larger(second, smaller(heights, best))
        best = select(is_higher, heights, best)
        where = select(is_higher, start + lanes, where)
    place = first_of_highest(best, where)
    others = select(where == float(place), second, best)
    return first + place, _largest(best), _largest(others)


@inlined_kernel
def furthest_of_planes(blocks, first, groups, d):
    """Return the place of the plane whose normal lies furthest along d, the first of several.

    There is at least one group.
    """
    lanes = as_lanes(NUMBERS)
    best, where, start = along_group(blocks, first, d), lanes, 0.0
    for group in range(1, groups):
        heights = along_group(blocks, first + group * _STRIDE, d)
        start += _STRIDE
        is_higher = heights > best
        best = select(is_higher, heights, best)
        where = select(is_higher, start + lanes, where)
    return first + first_of_highest(best, where)

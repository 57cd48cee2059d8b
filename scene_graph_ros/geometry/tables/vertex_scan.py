"""Which of many points lies furthest along a direction, eight of them in step.

Points come in groups of GROUP: their x, then their y, then their z, then other numbers.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    as_lanes,
    bits_of,
    LANES,
    larger,
    load_lanes,
    lowest_bit,
    reordering,
    select,
)

__all__ = [
    "GROUP",
    "NUMBERS",
    "along_group",
    "first_of_highest",
    "furthest_of_few_groups",
    "furthest_of_groups",
    "half_ahead",
    "lane_of_largest",
    "largest_of",
    "quarter_ahead",
]

GROUP = LANES
_CHUNK = 4
"""So many groups are looked at before it is asked whether the point is among them."""

NUMBERS = tuple(float(lane) for lane in range(GROUP))
"""Those of the lanes."""

half_ahead, quarter_ahead = [
    reordering(*[(lane + part) % GROUP for lane in range(GROUP)])
    for part in (GROUP // 2, GROUP // 4)
]
"""Each gives lanes in the order in which those so far ahead come first."""


@inlined_kernel
def along_group(blocks, at, axes):
    """Return the heights of a group's points along a direction, in lanes."""
    return (
        load_lanes(blocks, at) * axes[0]
        + load_lanes(blocks, at + GROUP) * axes[1]
        + load_lanes(blocks, at + 2 * GROUP) * axes[2]
    )


@inlined_kernel
def _is_later(heights, places, other_heights, other_places):
    """Return the lanes in which others are to be taken: they are higher, or as high and before."""
    is_tied = other_heights == heights
    return (other_heights > heights) | (is_tied & (other_places < places))


@inlined_kernel
def first_of_highest(heights, places):
    """Return the place of the largest height, the lowest of several, by halving the lanes.

    The last two are compared as numbers: LLVM 22 drops a part of the comparison of vectors of
    which one element is taken.
    """
    others, other_places = half_ahead(heights), half_ahead(places)
    is_other = _is_later(heights, places, others, other_places)
    heights, places = select(is_other, others, heights), select(is_other, other_places, places)
    others, other_places = quarter_ahead(heights), quarter_ahead(places)
    is_other = _is_later(heights, places, others, other_places)
    heights, places = select(is_other, others, heights), select(is_other, other_places, places)
    is_other = _is_later(heights[0], places[0], heights[1], places[1])
    return int(places[1] if is_other else places[0])


@inlined_kernel
def largest_of(lanes):
    """Return the largest number of lanes."""
    lanes = larger(lanes, half_ahead(lanes))
    lanes = larger(lanes, quarter_ahead(lanes))
    return max(lanes[0], lanes[1])


@inlined_kernel
def lane_of_largest(lanes):
    """Return the lane of the largest number, the first of several; none may be nan."""
    return lowest_bit(bits_of(lanes == largest_of(lanes)))


@inlined_kernel
def furthest_of_groups(blocks, first, groups, d, stride):
    """Return the place of the x of the point furthest along d, of at least one group.

    Of points that lie as far it is the first. A group has ``stride`` numbers.
    """
    lanes = as_lanes(NUMBERS)
    best, where, start = along_group(blocks, first, d), lanes, 0.0
    for group in range(1, groups):
        heights = along_group(blocks, first + group * stride, d)
        start += stride
        is_higher = heights > best
        best = select(is_higher, heights, best)
        where = select(is_higher, start + lanes, where)
    return first + first_of_highest(best, where)


@inlined_kernel
def furthest_of_few_groups(blocks, first, groups, d, stride):
    """Do the same, in less time for one or two groups and in more for many.

    The largest height tells the lane, by another look at all of them.
    """
    best = along_group(blocks, first, d)
    for group in range(1, groups):
        best = larger(best, along_group(blocks, first + group * stride, d))
    furthest = largest_of(best)
    for chunk in range(0, groups, _CHUNK):
        bits = 0
        for group in range(chunk, min(chunk + _CHUNK, groups)):
            is_furthest = along_group(blocks, first + group * stride, d) == furthest
            bits |= bits_of(is_furthest) << (GROUP * (group - chunk))
        if bits != 0:
            k = lowest_bit(bits)
            return first + (chunk + k // GROUP) * stride + k % GROUP
    return first  # of heights that overflow none may be the largest

"""Which of many points lies furthest along a direction, eight of them in step.

Points come in groups of GROUP: their x, then their y, then their z, then GROUP numbers that are
not looked at.
"""

import numpy as np

from scene_graph_ros.geometry.compiled.code import ARRAY, generated, NUMBER, PLACE

__all__ = ["GROUP", "furthest_of_groups"]

GROUP = 8
_STRIDE = 4 * GROUP


def _furthest_plainly(blocks, first, groups, x, y, z):
    points = blocks[first : first + _STRIDE * groups].reshape(groups, 4, GROUP)
    along = points[:, 0] * x + points[:, 1] * y + points[:, 2] * z
    group, lane = divmod(int(np.argmax(along)), GROUP)
    return first + _STRIDE * group + lane


def _is_later(heights, places, other_heights, other_places):
    """Return where others are to be taken: they are higher, or as high and before."""
    is_higher, is_tied = other_heights > heights, other_heights.equals(heights)
    return is_higher | (is_tied & (other_places < places))


def _first_of_highest(code, heights, places):
    """Return the place of the largest height, the lowest of several, by halving the vectors.

    The last two are compared as numbers: LLVM 22 drops a part of the comparison of vectors of
    which one element is taken.
    """
    for half in (GROUP // 2, GROUP // 4):
        order = [(lane + half) % GROUP for lane in range(GROUP)]
        others, other_places = code.reordered(heights, order), code.reordered(places, order)
        is_other = _is_later(heights, places, others, other_places)
        heights = code.select(is_other, others, heights)
        places = code.select(is_other, other_places, places)
    is_other = _is_later(heights[0], places[0], heights[1], places[1])
    return code.select(is_other, places[1], places[0])


@generated(ARRAY, PLACE, PLACE, *[NUMBER] * 3, plain=_furthest_plainly, returns=PLACE)
def furthest_of_groups(code, blocks, first, groups, x, y, z):
    """Return the place of the x of the point furthest along (x, y, z), of at least one group.

    Of points that lie as far it is the first.
    """
    axes = [code.repeated(number, GROUP) for number in (x, y, z)]
    lanes = code.places(*range(GROUP))

    def along(at):
        return code.dot([blocks.vector(at + GROUP * axis, GROUP) for axis in range(3)], axes)

    best, where = code.kept(along(first)), code.kept(code.repeated(first, GROUP) + lanes)
    with code.loop(groups, start=1) as group:
        at = first + group * _STRIDE
        heights, known = along(at), best.read()
        is_higher = heights > known
        best.write(code.select(is_higher, heights, known))
        places = code.repeated(at, GROUP) + lanes
        where.write(code.select(is_higher, places, where.read()))
    return _first_of_highest(code, best.read(), where.read())

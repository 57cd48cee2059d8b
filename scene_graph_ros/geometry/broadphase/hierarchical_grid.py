"""Candidate pairs by a hierarchy of hashed grids.

A box lives at the finest level whose cells are at least CELL_WIDTHS times as wide as the box, so
it touches at most eight cells there. It meets the residents of its own level and, as
a visitor, those of all coarser levels. A few huge boxes among many small ones thus cost a look
each, not a search. Work grows as the number of boxes times the number of levels in use, plus the
pairs found; nothing is kept between calls.

A pair that shares several cells is reported in one of them only: the lowest cell both touch.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.pair_tests import (
    box_reaches_half_space,
    boxes_are_near,
    is_pair_wanted,
)
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = ["candidate_pairs", "sorted_pairs"]

LEVELS = 40
"""Number of levels; boxes more than LEVEL_RATIO**LEVELS times smaller than the largest share the
finest one."""
LEVEL_RATIO = 2.0
"""Width of a cell relative to that of the next finer level."""
CELL_WIDTHS = 1.5
"""Wider cells have more residents, narrower ones are touched by more boxes; measured best."""
FIRST_CAPACITY = 4
"""Pairs per row for which there is room at first; with more pairs the search runs twice."""
GOLDEN = -7046029254386353131
"""2**64 divided by the golden ratio, as a signed number."""
CELL_BITS = 20
MAX_CELL = 2.0**CELL_BITS - 1.0
"""Cells further out are one cell, which is slower but not wrong."""


class _Boxes(NamedTuple):
    """The boxes of all rows, and which pairs of them are wanted, as in ``candidate_pairs``."""

    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    frame: NDArray[np.int32]
    filter_bits: NDArray[np.uint8]
    margin: float


class _Residents(NamedTuple):
    """The cells of one level: the first row of each bucket, and the rows and keys in it."""

    start: NDArray[np.int64]
    rows: NDArray[np.int64]
    keys: NDArray[np.int64]


@inlined_kernel
def _cell(x, origin, per_cell):
    """Return the cell of a coordinate; monotone in x, so boxes that overlap share a cell."""
    return int(min(max((x - origin) * per_cell, 0.0), MAX_CELL))


@inlined_kernel
def _growth(low, high, margin):
    """Return the growth of a side: half the margin, and the rounding of a gap."""
    return 0.5 * margin + BOX_ROUNDING * (abs(low) + abs(high) + margin)


@inlined_kernel
def _key(x, y, z):
    """Pack three cell numbers into one."""
    return x | (y << CELL_BITS) | (z << (2 * CELL_BITS))


@inlined_kernel
def _bucket(key, mask):
    """Hash a cell's key: two rounds of Fibonacci hashing, since one keeps z out of low bits."""
    key = int(key) * GOLDEN
    key = (key ^ (key >> 32)) * GOLDEN
    return (key >> 32) & mask


@inlined_kernel
def _append(pairs, count, i, j):
    """Write the pair, lower row first, if there is room; count it in any case."""
    if count < len(pairs):
        pairs[count, 0] = min(i, j)
        pairs[count, 1] = max(i, j)
    return count + 1


@kernel
def sorted_pairs(pairs, count, n):
    """Sort pairs lexicographically in two stable counting passes."""
    source = pairs[:count]
    for column in (1, 0):
        start = np.zeros(n + 1, np.int64)
        for k in range(count):
            start[source[k, column] + 1] += 1
        for row in range(n):
            start[row + 1] += start[row]
        target = np.empty((count, 2), np.int64)
        for k in range(count):
            slot = start[source[k, column]]
            start[source[k, column]] += 1
            target[slot, 0] = source[k, 0]
            target[slot, 1] = source[k, 1]
        source = target
    return source


@kernel
def _choose_levels(lower, upper, bounded, margin, level):
    """Give each bounded box its level, and return the widest cell and the grid's origin."""
    widest = 0.0
    ox, oy, oz = math.inf, math.inf, math.inf
    n = len(lower)
    width = np.empty(n)
    for i in range(n):
        if not bounded[i]:
            continue
        ox, oy, oz = min(ox, lower[i, 0]), min(oy, lower[i, 1]), min(oz, lower[i, 2])
        width[i] = 0.0
        for axis in range(3):
            low, high = lower[i, axis], upper[i, axis]
            width[i] = max(width[i], high - low + 2.0 * _growth(low, high, margin))
        widest = max(widest, width[i])
    for i in range(n):
        level[i] = -1
        if bounded[i]:
            k = 0
            cell = widest / LEVEL_RATIO
            while k < LEVELS - 1 and width[i] <= cell and cell > 0.0:
                cell /= LEVEL_RATIO
                k += 1
            level[i] = k
    return widest, (ox, oy, oz)


@kernel
def _sort_by_level(level):
    """Return the start of each level in the bounded rows sorted by level, and these rows."""
    first = np.zeros(LEVELS + 1, np.int64)
    for i in range(len(level)):
        if level[i] >= 0:
            first[level[i] + 1] += 1
    for k in range(LEVELS):
        first[k + 1] += first[k]
    end = first.copy()
    rows = np.empty(first[LEVELS], np.int64)
    for i in range(len(level)):
        if level[i] >= 0:
            rows[end[level[i]]] = i
            end[level[i]] += 1
    return first, rows


@lean_kernel
def _cell_ranges(lower, upper, rows, origin, per_cell, margin, ranges):
    """Write the first and last cells (x, y, z; x, y, z) that each row's grown box touches."""
    for i in rows:
        for axis in range(3):
            low, high = lower[i, axis], upper[i, axis]
            growth = _growth(low, high, margin)
            ranges[i, axis] = _cell(low - growth, origin[axis], per_cell)
            ranges[i, 3 + axis] = _cell(high + growth, origin[axis], per_cell)


@kernel
def _fill_buckets(at_home, ranges, mask):
    """Return the ``_Residents`` of a level, the rows ``at_home``, in buckets of their cells."""
    start = np.zeros(mask + 2, np.int64)
    touched = np.empty(8 * len(at_home), np.int64)
    row_of = np.empty(8 * len(at_home), np.int64)
    count = 0
    for i in at_home:
        for x in range(ranges[i, 0], ranges[i, 3] + 1):
            for y in range(ranges[i, 1], ranges[i, 4] + 1):
                for z in range(ranges[i, 2], ranges[i, 5] + 1):
                    key = _key(x, y, z)
                    touched[count] = key
                    row_of[count] = i
                    count += 1
                    start[_bucket(key, mask) + 1] += 1
    for bucket in range(mask + 1):
        start[bucket + 1] += start[bucket]
    rows, keys = np.empty(count, np.int64), np.empty(count, np.int64)
    for k in range(count - 1, -1, -1):
        bucket = _bucket(touched[k], mask) + 1
        start[bucket] -= 1
        rows[start[bucket]] = row_of[k]
        keys[start[bucket]] = touched[k]
    # Each start was moved down to the start of its bucket, one place to the right of it.
    start[:-1] = start[1:]
    start[mask + 1] = count
    return _Residents(start, rows, keys)


@inlined_kernel
def _boxes_overlap(lower, upper, i, j):
    """Tell whether two boxes touch; without branches, since most pairs don't and none repeat."""
    return (
        (lower[i, 0] <= upper[j, 0])
        & (lower[j, 0] <= upper[i, 0])
        & (lower[i, 1] <= upper[j, 1])
        & (lower[j, 1] <= upper[i, 1])
        & (lower[i, 2] <= upper[j, 2])
        & (lower[j, 2] <= upper[i, 2])
    )


@inlined_kernel
def _is_home(ranges, i, j, key):
    """Tell whether the cell is the lowest one that rows i and j both touch."""
    x = max(ranges[i, 0], ranges[j, 0])
    y = max(ranges[i, 1], ranges[j, 1])
    z = max(ranges[i, 2], ranges[j, 2])
    return _key(x, y, z) == key


@inlined_kernel
def _is_pair(boxes, ranges, i, j, key):
    """Tell whether rows i and j, which share the cell, are a candidate to be reported here."""
    if boxes.margin == 0.0:
        if not _boxes_overlap(boxes.lower, boxes.upper, i, j):
            return False
    elif not boxes_are_near(boxes.lower, boxes.upper, i, j, boxes.margin):
        return False
    return _is_home(ranges, i, j, key) and is_pair_wanted(boxes.frame, boxes.filter_bits, i, j)


@lean_kernel
def _search_residents(boxes, ranges, residents, pairs, count):
    """Append the pairs of one level's residents with each other."""
    start, rows, keys = residents
    for bucket in range(len(start) - 1):
        for a in range(start[bucket], start[bucket + 1]):
            for b in range(a + 1, start[bucket + 1]):
                if keys[a] == keys[b] and _is_pair(boxes, ranges, rows[a], rows[b], keys[a]):
                    count = _append(pairs, count, rows[a], rows[b])
    return count


@lean_kernel
def _search_visitors(boxes, ranges, visitors, residents, pairs, count):
    """Append the pairs of finer levels' rows with one level's residents."""
    start, rows, keys = residents
    mask = len(start) - 2
    for i in visitors:
        for x in range(ranges[i, 0], ranges[i, 3] + 1):
            for y in range(ranges[i, 1], ranges[i, 4] + 1):
                for z in range(ranges[i, 2], ranges[i, 5] + 1):
                    key = _key(x, y, z)
                    bucket = _bucket(key, mask)
                    for slot in range(start[bucket], start[bucket + 1]):
                        if keys[slot] == key and _is_pair(boxes, ranges, i, rows[slot], key):
                            count = _append(pairs, count, i, rows[slot])
    return count


@lean_kernel
def _search_unbounded(boxes, is_half_space, bounded, X_WG, pairs):
    """Write the pairs of half spaces, and of boxes without bounds, with every other row."""
    lower, upper, frame, filter_bits, margin = boxes
    n, count = len(lower), 0
    for h in range(n):
        if bounded[h]:
            continue
        for i in range(n):
            if i == h or (i < h and not bounded[i]):
                continue
            if not is_pair_wanted(frame, filter_bits, h, i):
                continue
            if is_half_space[h] and not is_half_space[i]:
                near = box_reaches_half_space(lower, upper, i, X_WG, h, margin)
            elif is_half_space[i] and not is_half_space[h]:
                near = box_reaches_half_space(lower, upper, h, X_WG, i, margin)
            elif is_half_space[h]:
                near = True
            else:
                near = boxes_are_near(lower, upper, h, i, margin)
            if near:
                count = _append(pairs, count, h, i)
    return count


@kernel
def _search(boxes, is_half_space, X_WG, pairs):
    """Write pairs in any order and return how many there are, more than fit if need be."""
    lower, upper, _, _, margin = boxes
    n = len(lower)
    bounded = np.empty(n, np.bool_)
    for i in range(n):
        bounded[i] = not is_half_space[i]
        for axis in range(3):
            bounded[i] &= math.isfinite(lower[i, axis]) and math.isfinite(upper[i, axis])
    count = _search_unbounded(boxes, is_half_space, bounded, X_WG, pairs)
    level = np.empty(n, np.int64)
    widest, origin = _choose_levels(lower, upper, bounded, margin, level)
    first, by_level = _sort_by_level(level)
    ranges = np.empty((n, 6), np.int64)
    cell = CELL_WIDTHS * widest
    for k in range(LEVELS):
        at_home = by_level[first[k] : first[k + 1]]
        visitors = by_level[first[k + 1] :]
        if len(at_home) > 0:
            mask = 15
            while mask < 2 * len(at_home):
                mask = 2 * mask + 1
            per_cell = 1.0 / cell if cell > 0.0 else 0.0
            _cell_ranges(lower, upper, at_home, origin, per_cell, margin, ranges)
            _cell_ranges(lower, upper, visitors, origin, per_cell, margin, ranges)
            residents = _fill_buckets(at_home, ranges, mask)
            count = _search_residents(boxes, ranges, residents, pairs, count)
            count = _search_visitors(boxes, ranges, visitors, residents, pairs, count)
        cell /= LEVEL_RATIO
    return count


@kernel
def candidate_pairs(lower, upper, is_half_space, X_WG, frame, filter_bits, margin):
    """Find the pairs whose boxes come within ``margin`` of each other.

    Args:
        lower: (n, 3) lower corners in W, in metres, from ``world_boxes``.
        upper: (n, 3) upper corners.
        is_half_space: (n,) bool; these rows are tested by their plane, at X_WG's z = 0.
        X_WG: (n, 4, 4) poses, read for half spaces only.
        frame: (n,) int32; rows of the same frame are no pair (0 is the world: anchored).
        filter_bits: (n, ceil(n / 8)) uint8, or (0, 0): see ``is_pair_wanted``.
        margin: finite, >= 0, in metres.

    Returns:
        (k, 2) int64 rows i < j, sorted lexicographically. Two half spaces are always a candidate.

    """
    n = len(lower)
    pairs = np.empty((FIRST_CAPACITY * n + 16, 2), np.int64)
    boxes = _Boxes(lower, upper, frame, filter_bits, margin)
    count = _search(boxes, is_half_space, X_WG, pairs)
    if count > len(pairs):
        pairs = np.empty((count, 2), np.int64)
        _search(boxes, is_half_space, X_WG, pairs)
    return sorted_pairs(pairs, count, n)

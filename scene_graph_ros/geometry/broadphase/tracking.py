"""Candidate pairs of things that move a little from one call to the next.

Every box that moves has a larger one around it, its fence, and the pairs whose fences meet are
kept in a list. While all boxes stay inside of their fences, the candidates are found by a look at
the pairs of the list. A box that leaves gets a new fence, and its pairs are looked up again; when
many leave, all pairs are searched anew. Boxes that don't move have no fence but themselves.

The candidates are those that a search of all pairs finds, whatever happened before.
"""

import math

import numpy as np

from scene_graph_ros.geometry.broadphase.aabb import bound_row
from scene_graph_ros.geometry.broadphase.hierarchical_grid import candidate_pairs, sorted_pairs
from scene_graph_ros.geometry.broadphase.pair_tests import (
    box_reaches_half_space,
    is_pair_wanted,
    square_within,
)
from scene_graph_ros.geometry.broadphase.pair_vectors import square_of_gap
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.spatial.pose_vectors import remember_pose
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = ["BOUNDED", "COUNTERS", "LOOKED_AT", "REFENCED", "SEARCHED", "track"]

COUNTERS = 4
"""What was done is counted, so that tests can tell work from no work."""
BOUNDED = 0
"""Boxes computed, since their pose changed."""
LOOKED_AT = 1
"""Pairs of boxes compared."""
REFENCED = 2
"""Boxes that left their fence and were compared with every other."""
SEARCHED = 3
"""Searches of all pairs."""

MAX_MERGED = 200
"""So many new pairs are sorted and merged into the list; more, and the whole list is sorted."""
MAX_REFENCED = 200
"""When more boxes leave at once, all pairs are searched, which then takes less time."""
DENSE = (4.0, 0.3)
SPARSE = (8.0, 1.0)
"""A fence leaves room for so many steps like the last one in each direction, but for no more than
this part of the box's width. Wide fences are left seldom, but they meet more others: where there
are more pairs than boxes, looking at those takes longer than making new fences."""


@inlined_kernel
def _reaches_half_space(lower, upper, is_half_space, X_WG, i, j, margin):
    """Tell whether a box and a half space come within ``margin``; two half spaces always do."""
    if is_half_space[i]:
        return is_half_space[j] or box_reaches_half_space(lower, upper, j, X_WG, i, margin)
    return box_reaches_half_space(lower, upper, i, X_WG, j, margin)


@inlined_kernel
def _fence(lower, upper, fence, step, i, is_dense):
    """Put a new fence around the box of row i, with room for steps like its last."""
    steps, most = DENSE if is_dense else SPARSE
    width = 0.0
    for axis in range(3):
        width = max(width, upper[i, axis] - lower[i, axis])
    room = 0.0
    if width < math.inf and step[i] < width:  # what jumps has no use for a fence
        room = min(steps * step[i], most * width)
    for axis in range(3):
        fence[axis, i] = lower[i, axis] - room
        fence[3 + axis, i] = upper[i, axis] + room


@inlined_kernel
def _is_inside(lower, upper, fence, i):
    return (
        (fence[0, i] <= lower[i, 0])
        & (fence[1, i] <= lower[i, 1])
        & (fence[2, i] <= lower[i, 2])
        & (fence[3, i] >= upper[i, 0])
        & (fence[4, i] >= upper[i, 1])
        & (fence[5, i] >= upper[i, 2])
    )


@lean_kernel
def _move(geometry, X_WG, rows, is_half_space, X_last, lower, upper, fence, step, is_out, out):
    """Bring the boxes of ``rows`` up to date; return how many moved.

    Those that are out of their fence are marked, and listed in ``out`` after their number.
    """
    bounded = count = 0
    for row in rows:
        i = row & LAST_PLACE
        if not remember_pose(X_WG, i, X_last, i):
            continue
        bounded += 1
        x, y, z = lower[i, 0], lower[i, 1], lower[i, 2]
        bound_row(geometry, X_WG, i, lower, upper)
        if is_half_space[i] or not _is_inside(lower, upper, fence, i):
            step[i] = max(abs(lower[i, 0] - x), abs(lower[i, 1] - y), abs(lower[i, 2] - z))
            is_out[i] = True
            count += 1
            out[count] = i
    out[0] = count
    return bounded


@inlined_kernel
def _grown(low, high, margin):
    """Grow an interval by a margin, and by what rounding may take from a gap."""
    extra = margin + BOX_ROUNDING * (abs(low) + abs(high) + margin)
    return low - extra, high + extra


@lean_kernel
def _meet(fence, i, margin, meets):
    """Write into ``meets`` which fences come within ``margin`` of row i's."""
    x, X = _grown(fence[0, i], fence[3, i], margin)
    y, Y = _grown(fence[1, i], fence[4, i], margin)
    z, Z = _grown(fence[2, i], fence[5, i], margin)
    for j in range(fence.shape[1]):
        meets[j] = (
            (x <= fence[3, j])
            & (y <= fence[4, j])
            & (z <= fence[5, j])
            & (fence[0, j] <= X)
            & (fence[1, j] <= Y)
            & (fence[2, j] <= Z)
        )


@inlined_kernel
def _is_after(pairs, a, others, b):
    """Tell whether pair a comes after pair b of others."""
    first = others[b, 0]
    return pairs[a, 0] > first or (pairs[a, 0] == first and pairs[a, 1] > others[b, 1])


@lean_kernel
def _sort(pairs, first, last):
    """Sort a few pairs, those from first to last, by insertion."""
    for k in range(first + 1, last):
        i, j = pairs[k, 0], pairs[k, 1]
        at = k
        while at > first and (
            pairs[at - 1, 0] > i or (pairs[at - 1, 0] == i and pairs[at - 1, 1] > j)
        ):
            pairs[at, 0], pairs[at, 1] = pairs[at - 1, 0], pairs[at - 1, 1]
            at -= 1
        pairs[at, 0], pairs[at, 1] = i, j


@lean_kernel
def _merge(pairs, count, others):
    """Merge sorted others into the ``count`` sorted pairs, after which there is room for them."""
    a, b = count - 1, len(others) - 1
    for at in range(count + len(others) - 1, -1, -1):
        if b < 0:
            break
        if a >= 0 and _is_after(pairs, a, others, b):
            pairs[at, 0], pairs[at, 1] = pairs[a, 0], pairs[a, 1]
            a -= 1
        else:
            pairs[at, 0], pairs[at, 1] = others[b, 0], others[b, 1]
            b -= 1


@kernel
def _look_up(fence, frame, filter_bits, margin, is_out, out, pairs, counters):
    """Return the list with the pairs of the rows in ``out`` replaced, sorted."""
    n = fence.shape[1]
    found = np.empty((len(pairs) + 16 * MAX_REFENCED, 2), np.int64)
    count = 0
    for k in range(len(pairs)):
        i, j = pairs[k, 0] & LAST_PLACE, pairs[k, 1] & LAST_PLACE
        found[count & LAST_PLACE, 0], found[count & LAST_PLACE, 1] = i, j
        count += not (is_out[i] | is_out[j])
    kept = count
    words = np.zeros((n + 7) // 8, np.int64)
    meets = words.view(np.bool_)
    counters[REFENCED] += len(out)
    counters[LOOKED_AT] += len(out) * n
    for i in out:
        _meet(fence, i, margin, meets)
        for word in range(len(words)):
            if words[word] == 0:
                continue
            for j in range(8 * word, min(8 * word + 8, n)):
                # A half space meets all: what is infinite has no fence.
                if not meets[j] or i == j or (is_out[j] and j < i):
                    continue
                if is_pair_wanted(frame, filter_bits, i, j):
                    if count == len(found):
                        longer = np.empty((2 * count, 2), np.int64)
                        longer[:count] = found
                        found = longer
                    found[count, 0] = min(i, j)
                    found[count, 1] = max(i, j)
                    count += 1
    if count - kept > MAX_MERGED:
        return sorted_pairs(found, count, n)
    _sort(found, kept, count)
    _merge(found, kept, found[kept:count].copy())
    return found[:count]


@kernel
def _search(fence, is_half_space, X_WG, frame, filter_bits, margin):
    """Return all pairs whose fences come within ``margin``, sorted."""
    lower, upper = np.ascontiguousarray(fence[:3].T), np.ascontiguousarray(fence[3:].T)
    return candidate_pairs(lower, upper, is_half_space, X_WG, frame, filter_bits, margin)


@lean_kernel
def _select(lower, upper, is_half_space, X_WG, margin, pairs, result):
    """Write the pairs that come within ``margin`` of each other; return how many."""
    limit = square_within(margin)
    count = 0
    for k in range(len(pairs)):
        i, j = pairs[k, 0] & LAST_PLACE, pairs[k, 1] & LAST_PLACE
        result[count & LAST_PLACE, 0], result[count & LAST_PLACE, 1] = i, j
        is_near = square_of_gap(lower, upper, i, j) <= limit
        if is_half_space[i] | is_half_space[j]:
            is_near = _reaches_half_space(lower, upper, is_half_space, X_WG, i, j, margin)
        count += is_near
    return count


@kernel
def track(geometry, X_WG, rows, is_half_space, frame, filter_bits, margin, memory, pairs, is_new):
    """Return the list of pairs whose fences meet, and the candidates.

    Args:
        geometry: from ``aabb.box_geometry``.
        X_WG: (n, 4, 4) poses; those of rows that are not in ``rows`` are as they always were.
        rows: (m,) the rows that may have moved.
        is_half_space: (n,) bool.
        frame: (n,) int32, as in ``candidate_pairs``.
        filter_bits: as there.
        margin: finite, >= 0, in metres; always the same for the same memory.
        memory: X_last (n, 4, 4), lower, upper (n, CORNER), fence (6, n), step (n,), is_out (n,)
            bool, out (n + 1,), counters (COUNTERS,); written to.
        pairs: (k, 2), the list that the last call returned.
        is_new: whether there was no last call: everything is computed.

    """
    X_last, lower, upper, fence, step, is_out, out, counters = memory
    counters[BOUNDED] += _move(
        geometry, X_WG, rows, is_half_space, X_last, lower, upper, fence, step, is_out, out
    )
    count = out[0]
    is_dense = len(pairs) > len(lower)
    if is_new or count > MAX_REFENCED:
        if is_new:
            step[:] = 0.0
        for i in range(len(lower)):
            _fence(lower, upper, fence, step, i, is_dense)
        is_out[:] = False
        counters[SEARCHED] += 1
        pairs = _search(fence, is_half_space, X_WG, frame, filter_bits, margin)
    elif count > 0:
        for i in out[1 : count + 1]:
            _fence(lower, upper, fence, step, i, is_dense)
        pairs = _look_up(
            fence, frame, filter_bits, margin, is_out, out[1 : count + 1], pairs, counters
        )
        for i in out[1 : count + 1]:
            is_out[i] = False
    counters[LOOKED_AT] += len(pairs)
    result = np.empty((len(pairs) + 1, 2), np.int64)  # one place to write what is not kept
    count = _select(lower, upper, is_half_space, X_WG, margin, pairs, result)
    return pairs, result[:count]
